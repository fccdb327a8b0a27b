# SPDX-License-Identifier: GPL-3.0-or-later
"""One long call of an operator: in a thread with progress in the status bar and Esc, or at once.

An operator gives prepare(), which reads Blender's data and returns the work to do; the work, which runs in the thread
and touches nothing of Blender; and finish(), which writes the outcome in one go. A script, Adjust Last Operation and
Blender without a window run the same three at once.
"""

import threading

from . import native
from .errors import Refused

# What ends sooner than this is waited for: no status line has to flash up for it.
_PATIENCE = 0.4
_TICK = 0.1


class Job:
    def __init__(self, work, progress):
        self.progress = progress
        self._outcome = None
        self._error = None
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self._thread.start()

    def _run(self, work):
        try:
            self._outcome = work(self.progress)
        except BaseException as error:  # handed to the main thread, whatever it is
            self._error = error

    def done(self, seconds=0.0):
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def outcome(self):
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._outcome


class JobOperator:
    """Mixed into an Operator that has prepare(context) -> work(progress) -> outcome, and finish(context, outcome)."""

    _job = None
    _timer = None
    _ob = None

    @property
    def ob(self):
        """The object that was active when the operator began."""
        try:
            self._ob.name  # noqa: B018
        except ReferenceError:
            raise Refused("The object was removed meanwhile") from None
        return self._ob

    def execute(self, context):
        self._ob = context.active_object
        return self._guarded(context, lambda: self.prepare(context)(native.module.Progress()))

    def invoke(self, context, _event):
        self._ob = context.active_object
        try:
            work = self.prepare(context)
        except (Refused, native.module.TolvolError) as error:
            return self._refuse(error)
        self._job = Job(work, native.module.Progress())
        if self._job.done(_PATIENCE):
            return self._guarded(context, self._job.outcome)
        manager = context.window_manager
        self._timer = manager.event_timer_add(_TICK, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        progress = self._job.progress
        if event.type == "ESC":
            progress.cancel()
        if event.type == "TIMER":
            if self._job.done():
                self._leave(context)
                return self._guarded(context, self._job.outcome)
            context.workspace.status_text_set(_status(progress))
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        """Blender closes the window, or the file."""
        self._job.progress.cancel()
        self._job.done(None)
        self._leave(context)

    def _leave(self, context):
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)

    def _guarded(self, context, outcome):
        try:
            self.finish(context, outcome())
        except native.module.Cancelled:
            self.report({"INFO"}, f"{self.bl_label} was cancelled, nothing was changed")
            return {"CANCELLED"}
        except (Refused, native.module.TolvolError) as error:
            return self._refuse(error)
        return {"FINISHED"}

    def _refuse(self, error):
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


def _status(progress):
    if progress.cancelled:
        return "Stopping"
    # The count is of the stage that counts: triangles left.
    left = f", {progress.count:,} triangles left" if progress.stage == "decimating" else ""
    return f"{progress.stage.capitalize()} {progress.fraction:.0%}{left}    Esc: Cancel"
