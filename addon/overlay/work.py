# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs tasks that take too long for a draw handler: one task at a time in a thread, started by a timer of Blender."""

import time

import bpy

from .. import native
from ..job import Job

# The timer looks for work after so many seconds.
_TICK = 0.05

_waiting = {}  # key of a task -> (the time at which it may begin, prepare, finish)
_running = None  # (about, finish, job)


def later(about, seconds, prepare, finish):
    """Calls prepare(), runs the work(progress) that it returns in a thread, then calls finish(outcome, error).

    about: a key that identifies the task. seconds: the earliest start from now. Either outcome or error is None. prepare
    and finish run in Blender's main thread, but not while it draws. Of several calls with the same key the first sets the
    time, and the last sets prepare and finish. While the task runs, further calls with its key do nothing.
    """
    if _running is not None and _running[0] == about:
        return
    begin = _waiting[about][0] if about in _waiting else time.monotonic() + seconds
    _waiting[about] = begin, prepare, finish
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0, persistent=True)  # The timer survives opening another file.


def _tick():
    global _running
    if _running is not None and _running[2].done():
        (_, finish, job), _running = _running, None
        try:
            outcome, error = job.outcome(), None
        except (native.module.TolvolError, MemoryError) as failure:
            outcome, error = None, failure
        finish(outcome, error)
    for about, (begin, prepare, finish) in list(_waiting.items()):
        if _running is None and begin <= time.monotonic():
            del _waiting[about]
            work = prepare()
            if work is not None:
                _running = about, finish, Job(work, native.module.Progress())
    return _TICK if _waiting or _running is not None else None


def cancel(about):
    """Cancels the task with this key if it runs. Its finish() is called with the error Cancelled."""
    if _running is not None and _running[0] == about:
        _running[2].progress.cancel()


def stop():
    """Cancels the running task and forgets the waiting ones."""
    global _running
    _waiting.clear()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _running is not None:
        job = _running[2]
        job.progress.cancel()
        job.done(None)
        _running = None
