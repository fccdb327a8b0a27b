# SPDX-License-Identifier: GPL-3.0-or-later
"""What takes too long to be done while drawing: one task at a time in a thread, and Blender's own loop between them."""

import threading
import time

import bpy

from .. import native

_TICK = 0.05  # seconds

_waiting = {}  # what it is about -> (when it may begin, prepare, finish)
_running = None


class _Task:
    def __init__(self, about, work, finish):
        self.about, self.finish = about, finish
        self.progress = native.module.Progress()
        self.outcome = self.error = None
        self.thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self.thread.start()

    def _run(self, work):
        try:
            self.outcome = work(self.progress)
        except (native.module.TolvolError, MemoryError) as error:
            self.error = error


def later(about, seconds, prepare, finish):
    """Lets a thread do prepare() -> work(progress), then calls finish(outcome, error); one of these is None.

    prepare and finish run in Blender's main thread, not while it draws. Of several calls about the same thing the first
    sets the time and the last what is done; while it is being worked on no further call counts.
    """
    if _running is not None and _running.about == about:
        return
    begin = _waiting[about][0] if about in _waiting else time.monotonic() + seconds
    _waiting[about] = begin, prepare, finish
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0)


def _tick():
    global _running
    if _running is not None and not _running.thread.is_alive():
        task, _running = _running, None
        task.finish(task.outcome, task.error)
    for about, (begin, prepare, finish) in list(_waiting.items()):
        if _running is None and begin <= time.monotonic():
            del _waiting[about]
            work = prepare()
            if work is not None:
                _running = _Task(about, work, finish)
    return _TICK if _waiting or _running is not None else None


def stop():
    """Ends what is going on, without its outcome."""
    global _running
    _waiting.clear()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    if _running is not None:
        _running.progress.cancel()
        _running.thread.join()
        _running = None
