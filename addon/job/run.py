# SPDX-License-Identifier: GPL-3.0-or-later
"""One run of an operator: its steps, the job of the present step, and the objects that it works on."""

import time
from dataclasses import replace

import bpy

from .. import native, status_bar
from ..background import Job
from ..redraw import redraw_sidebars
from ..shared.errors import Refused
from ..wrapping import popup_text
from . import interruptions, progress_text, refusals
from .claim import Claim

# Blender waits so many seconds for a job, which is about as long as a person takes for at once. A longer job goes on while
# Blender can be used.
PATIENCE = 0.1
# So long after its beginning the status bar shows a job, so that no line flashes up for a short one.
_QUIET = 0.4
_TICK = 0.1
_ASKS = 4.0  # For so many seconds the panel and the status bar say that another operator has to wait.

# steps() of an operator yields this in place of work once nothing is left to do but to change Blender's data.
WRITE = object()


def breathe(_progress):
    """steps() of an operator yields this between parts of what it does itself, so that Blender draws and takes events."""


# Adjust Last Operation has undone the result before it repeats the operator.
_AS_BEFORE = "The mesh is as it was before that operation"

_MODES = {"OBJECT": "Object Mode", "EDIT_MESH": "Edit Mode"}


class Run:
    def __init__(self, operator, context):
        self.operator = operator
        self.label = operator.bl_label
        self.voice = operator  # reports in place of the operator: report() shows nothing after Adjust Last Operation
        self.progress = native.module.Progress()
        # Why the run was stopped, as a message; "" if its operator begins anew. Its objects must not be touched then.
        self.interrupted = None
        # Called before Blender's data is changed. Returns whether that was done in it, by write().
        self.before_writing = lambda: False
        self.has_written = False
        self.rewinding = False  # whether a step is being undone for the run itself, which that does not end
        self.something_else = False  # whether Blender has reported a change since begin_modal()
        self._mode, self._clock = context.mode, progress_text.Clock()
        self._claims = [Claim(ob) for ob in operator.objects]
        refusals.forget(self._names())
        self._steps = operator.steps(context)
        self._job = None
        self._timer = None
        self._breathes = False  # whether the present job is breathe()
        self._edited = False  # whether Blender has reported a change of a mesh since the last call of take_edited()
        self._seen = None  # what the status bar and the sidebars were told last
        self._began, self._asked_to_wait = time.monotonic(), -_ASKS

    def told(self):
        """Returns what is known about the work, for the panel and the status bar."""
        if self._gone():
            return progress_text.stopping(self.label)
        told = progress_text.tell(self.operator, self.progress, self._clock)
        asked = told.escape and time.monotonic() < self._asked_to_wait + _ASKS
        return replace(told, count="another operation has to wait") if asked else told

    def ask_to_wait(self):
        """Lets the panel and the status bar say for a while that another operator has to wait."""
        self._asked_to_wait = time.monotonic()

    def _gone(self):
        """Whether Blender has freed the operator. It keeps the last 32, and may free one that Adjust Last Operation repeats."""
        try:
            return not self.operator.bl_label
        except ReferenceError:
            return True

    def advance(self):
        """Starts the next work. Returns the operator's result if there is no more work, else None."""
        return self._told_errors(self._begin_next)

    def write(self):
        """Lets the operator change Blender's data. Returns its result."""
        self.has_written = True
        return self._told_errors(self._write)

    def _begin_next(self):
        work = self._next_work()
        self._breathes = work is breathe
        self._job = Job(work, self.progress)

    def _write(self):
        if self.rewinding:
            self.operator.objects = [claim.renewed() for claim in self._claims]
        if self.rewinding or self._breathes:
            try:
                self._check()
            except BaseException as error:
                self._steps.throw(error)
        self._steps.send(None)  # It ends the steps.

    def _told_errors(self, go_on):
        """Returns what go_on() returns, or the operator's result once its steps have ended. Reports why they failed."""
        try:
            return go_on()
        except StopIteration as end:
            return end.value or {"FINISHED"}
        except native.module.Cancelled:
            left = "It has changed nothing" if self.voice is self.operator else _AS_BEFORE
            self.voice.report({"INFO"}, f"{self.label} was cancelled. {left}")
            return {"CANCELLED"}
        except (Refused, native.module.TolvolError) as error:
            reason = native.said(error)
            refusals.keep(self._names(), self.label, reason)
            self.voice.report({"ERROR"}, popup_text(reason))
            return {"CANCELLED"}

    def _names(self):
        return [claim.name for claim in self._claims]

    def go_on(self, seconds):
        """Does as many steps as the time permits. Returns the operator's result if it has ended, else None."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0 and self._ready(left):
            if ended := self.advance():
                return ended
        return None

    def _ready(self, seconds=0.0):
        """Waits for the present job for at most so many seconds. Returns whether the next step can begin."""
        return self._job is None or self._job.done(seconds)

    def begin_modal(self, context):
        """Goes on by the events that an operator, which is or becomes modal, passes to on_event() from now on."""
        self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)
        interruptions.runs.append(self)
        context.view_layer.update()  # What has changed before is no other change.
        self.something_else = False
        return {"RUNNING_MODAL"}

    def on_event(self, context, event):
        try:
            ended = self._ended_by(context, event)
        except BaseException:
            # Blender sends no more events after an error.
            self._end()
            self._leave(context)
            raise
        if ended & {"FINISHED", "CANCELLED"}:
            self._leave(context)
        return ended

    def _ended_by(self, context, event):
        """Goes on by an event. Returns the operator's result, or what becomes of the event while there is none."""
        if self.interrupted is None:
            self._look()
        if self.interrupted is not None:
            if self.interrupted:
                self.voice.report({"WARNING"}, self.interrupted)
            return {"CANCELLED"}
        if event.type == "ESC":
            if event.value != "PRESS":
                return {"RUNNING_MODAL"}
            if self.operator.improving():
                self.progress.finish()
            else:
                self.progress.cancel()
            return {"RUNNING_MODAL"}
        if event.type == "TIMER" and (ended := self._on_timer(context)):
            return ended
        return {"PASS_THROUGH"}  # With RUNNING_MODAL beside it Blender would pass nothing on.

    def _on_timer(self, context):
        # An undo step of one mode does not hold a change that is made in another: the outcome waits until the mode is back.
        waits = context.mode != self._mode
        if not waits and self._ready() and (ended := self.go_on(_TICK)):
            return ended
        if waits or time.monotonic() >= self._began + _QUIET:
            told = self.told()
            status = progress_text.status_line(told) + (
                f"    Waits for {_MODES.get(self._mode, 'its mode')}" if waits else ""
            )
            # Without a GPU a drawing of the sidebars takes most of the time between two ticks.
            seen = status, replace(told, share=told.share and round(told.share, 2))
            if seen != self._seen or not status_bar.showing():
                self._seen = seen
                status_bar.show(status)
                redraw_sidebars()
        return None

    def close(self, context):
        """Ends the run because Blender closes the window or the file."""
        if self.interrupted:
            interruptions.to_say.append(self.interrupted)
        self._end()
        self._leave(context)

    def interrupt(self, happens, left="It has changed nothing"):
        """Ends the job while the data that it began with still exists. Blender then calls on_event() or close()."""
        if self.interrupted is None and not self.rewinding:
            self.interrupted = f"{self.label} was stopped, because {happens}. {left}"
            self._end()

    def supersede(self):
        """Ends the job without a word, because the operator begins anew."""
        self.interrupted = ""
        self._end()

    def concerns(self, data):
        """Whether the run works on this object or mesh."""
        return any(claim.concerns(data) for claim in self._claims)

    def take_edited(self):
        """Returns whether Blender has reported a change of a mesh of the run since the last call."""
        bpy.context.view_layer.update()  # Blender may not have reported the last change yet.
        edited, self._edited = interruptions.take_edited() or self._edited, False
        return edited

    def _look(self):
        """Ends the job as soon as its outcome cannot be written any more."""
        if self._gone():
            self.interrupt("Blender keeps only 32 operations, and as many have followed", _AS_BEFORE)
            return
        edited = interruptions.take_edited()
        self._edited |= edited
        try:
            self._check(thoroughly=edited)
        except Refused as error:
            self.interrupted = str(error)
            self._end()

    def _check(self, thoroughly=True):
        for claim in self._claims:
            claim.check(thoroughly)

    def _end(self):
        self.progress.cancel()
        self._ready(None)
        self._steps.close()

    def _next_work(self):
        work = self._go_on_with_outcome()
        while work is breathe and self._timer is None:  # The caller waits, and Blender takes no events meanwhile.
            work = self._steps.send(None)
        return self._last_part() if work is WRITE else work

    def _go_on_with_outcome(self):
        try:
            outcome = None if self._job is None else self._job.outcome()
            if self.progress.cancelled:  # The work may have ended before it noticed the cancel.
                raise native.module.Cancelled("cancelled")
            # That takes as long as a part between two breaths: _write() does it after them.
            if self._job is not None and not self._breathes:
                self._check()
        except BaseException as error:
            return self._steps.throw(error)
        return self._resumed(outcome)

    def _resumed(self, outcome):
        """Goes on with the steps. The scratch data that they make and remove is no change by somebody else."""
        if self._timer is None:
            return self._steps.send(outcome)
        bpy.context.view_layer.update()  # Blender may not have reported what somebody else has changed.
        something_else = self.something_else
        work = self._steps.send(outcome)
        bpy.context.view_layer.update()
        self.something_else = something_else
        return work

    def _last_part(self):
        """Ends the steps, and raises StopIteration as they do."""
        if self.before_writing():
            raise StopIteration({"CANCELLED"})  # Blender has got the result of write(), and has stored the undo step.
        self._write()

    def _leave(self, context):
        interruptions.runs.remove(self)
        context.window_manager.event_timer_remove(self._timer)
        status_bar.clear()
        redraw_sidebars()
