# SPDX-License-Identifier: GPL-3.0-or-later
"""A computation in a thread, and the list of all computations that may be running."""

import functools

import bpy

from .. import native

# The timer lets jobs run their Python code after so many seconds.
_TICK = 0.02

_at_work = []  # Only the main thread uses this list.


class Job:
    """Runs work(progress) in a thread from now on. progress: a tolvol.Progress, by which the work can be cancelled.

    Python code of the work runs only while Blender's main thread waits in this file or in native.module.pause(). Calls of the
    native module run at any time. Work that waits for something calls native.module.pause(), because the main thread waits for
    its Python code.
    """

    def __init__(self, work, progress):
        self.progress = progress
        self._outcome = None
        self._error = None
        self._worker = native.module.Worker(functools.partial(self._run, work))
        _at_work[:] = [*at_work(), self]
        if not bpy.app.timers.is_registered(_tick):
            bpy.app.timers.register(_tick, first_interval=_TICK, persistent=True)

    def _run(self, work):
        try:
            self._outcome = work(self.progress)
        except BaseException as error:  # The main thread raises it again, even if it is no Exception.
            self._error = error

    def done(self, seconds=0.0):
        """Waits for at most so many seconds, None for as long as it takes. Returns whether the work has ended."""
        if seconds is not None:
            return self._worker.done(seconds)
        self._worker.join()
        return True

    def outcome(self):
        """Waits for the work. Returns its result, or raises its error."""
        self._worker.join()
        if self._error is not None:
            raise self._error
        return self._outcome


def at_work():
    """Returns the jobs whose threads run. It lets them run their Python code, for about 0.01 s each."""
    return [job for job in _at_work if not job.done()]


def _tick():
    _at_work[:] = at_work()
    return _TICK if _at_work else None


def end_all():
    """Cancels every job and waits for its thread: Blender crashes if a thread outlives the Python interpreter."""
    for job in _at_work:
        job.progress.cancel()
    for job in _at_work:
        job.done(None)
    _at_work.clear()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
