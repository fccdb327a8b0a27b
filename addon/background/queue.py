# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs tasks that nobody waits for, such as those that a draw handler asks for: one at a time in a thread, by a timer.

The key of a task is a tuple, which begins with the kind of the task.
"""

import time
import traceback

import bpy

from .. import native
from .thread import Job

# The timer looks for work after so many seconds.
_TICK = 0.05

_waiting = {}  # key of a task -> (the time at which it may begin, prepare, finish, rank)
_running = None  # (about, finish, job, rank)


def later(about, seconds, prepare, finish, rank=0):
    """Calls prepare(), runs the work(progress) that it returns in a thread, then calls finish(outcome, error).

    about: a key that identifies the task. seconds: the earliest start from now. Either outcome or error is None. prepare
    and finish run in Blender's main thread, but not while it draws. Of several calls with the same key the first sets the
    time, and the last sets prepare and finish. While the task runs, further calls with its key do nothing.
    rank: of the tasks that may begin the one with the lowest rank is first, and it cancels a running one with a higher rank.
    """
    if _running is not None and _running[0] == about:
        return
    begin = _waiting[about][0] if about in _waiting else time.monotonic() + seconds
    _waiting[about] = begin, prepare, finish, rank
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0, persistent=True)  # The timer survives opening another file.


def _tick():
    global _running
    if _running is not None and _running[2].done():
        (_, finish, job, _), _running = _running, None
        _call(_end, finish, job)
    due = [(about, task) for about, task in _waiting.items() if task[0] <= time.monotonic()]
    for about, (_, prepare, finish, rank) in sorted(due, key=lambda waiting: waiting[1][3]):
        if _running is None:
            del _waiting[about]
            work = _call(prepare)
            if work is not None:
                _running = about, finish, Job(work, native.module.Progress()), rank
        elif rank < _running[3]:
            _running[2].progress.cancel()
    return _TICK if _waiting or _running is not None else None


def _end(finish, job):
    try:
        outcome, error = job.outcome(), None
    except (native.module.TolvolError, MemoryError) as failure:
        outcome, error = None, failure
    finish(outcome, error)


def _call(function, *arguments):
    """Calls a function of a task. An exception ends this task alone. Blender would end the timer, and with it all tasks."""
    try:
        return function(*arguments)
    except Exception:
        traceback.print_exc()
        return None


def cancel(about):
    """Forgets the task with this key if it waits, and cancels it if it runs: its finish() is called with the error Cancelled."""
    _waiting.pop(about, None)
    if _running is not None and _running[0] == about:
        _running[2].progress.cancel()


def stop(*kinds):
    """Cancels the running task and forgets the waiting ones, of all kinds if none is given. finish() is not called."""
    global _running
    for about in [about for about in _waiting if not kinds or about[0] in kinds]:
        del _waiting[about]
    if _running is not None and (not kinds or _running[0][0] in kinds):
        job, _running = _running[2], None
        job.progress.cancel()
        job.done(None)
    if not _waiting and _running is None and bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
