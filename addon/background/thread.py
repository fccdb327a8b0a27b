# SPDX-License-Identifier: GPL-3.0-or-later
"""A computation in a thread, and the list of all computations that may be running."""

import threading

_at_work = []  # Only the main thread uses this list.


class Job:
    """Runs work(progress) in a thread from now on. progress: a tolvol.Progress, by which the work can be cancelled."""

    def __init__(self, work, progress):
        self.progress = progress
        self._outcome = None
        self._error = None
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        _at_work[:] = at_work()
        _at_work.append(self)
        self._thread.start()

    def _run(self, work):
        try:
            self._outcome = work(self.progress)
        except BaseException as error:  # The main thread raises it again, even if it is no Exception.
            self._error = error

    def done(self, seconds=0.0):
        """Waits for at most so many seconds, None for as long as it takes. Returns whether the work has ended."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def outcome(self):
        """Waits for the work. Returns its result, or raises its error."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._outcome


def at_work():
    """Returns the jobs whose threads run."""
    return [job for job in _at_work if not job.done()]


def end_all():
    """Cancels every job and waits for its thread: Blender crashes if a thread outlives the Python interpreter."""
    for job in _at_work:
        job.progress.cancel()
    for job in _at_work:
        job.done(None)
    _at_work.clear()
