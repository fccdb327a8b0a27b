# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of operators that work in threads."""

import json
import time

import bpy
from bpy.props import StringProperty

from .. import native, status_bar
from ..shared.errors import Refused
from . import adjusting, progress_text, run
from .interruptions import runs, under_way, undo_count

# Blender draws nothing while a run takes its objects' meshes, which takes 0.05 to 0.1 s for this many faces together. For as
# many or more, the operator first shows in the status bar that it has begun, and reads the meshes in parts, between which it
# takes Esc.
LARGE = 100_000

_SOON = 0.02  # seconds, in which Blender draws the status bar


def _one_step(task):
    return (yield task.run)


class JobOperator:
    """A base class for an Operator with prepare(context), a generator that yields `breathe` between its parts and returns
    work(progress), and finish(context, outcome), which may return the operator's result, as steps() may."""

    # Adjust Last Operation works on the same objects again, although another object may be active by then.
    worked_on: StringProperty(
        description="The names of the objects that the operator worked on, as JSON", options={"HIDDEN", "SKIP_SAVE"}
    )

    # Texts for the status bar and the panel. If `doing` is set, it, `share` and `count` replace the native stage, the share
    # of it that is done, and its count.
    doing = ""
    share = 0.0
    count = ""
    part = ""  # which part of the work is under way, such as "Level 2 of 3", if there are several

    _run = None
    _waiting = None  # a _Waiting before the run of an operator on large meshes begins, and None afterwards

    def targets(self, context):
        """Returns the objects that the operator works on. The settings are those of the first one."""
        return [context.active_object]

    @property
    def ob(self):
        return self.objects[0]

    @property
    def progress(self):
        return self._run.progress

    def edited(self):
        """Whether Blender has reported a change of the objects' meshes since the last call, be it of their attributes alone."""
        return self._run.take_edited()

    def improving(self):
        """Whether Esc keeps the present result. A second Esc cancels."""
        return self.progress.stage == "refining" and not self.progress.finishing

    def steps(self, context):
        """A generator in the main thread: yields work(progress) and is sent its outcome. It may change Blender's data only
        after the last yield, which should be that of WRITE: the panel of Adjust Last Operation then stays. Blender may have
        made its data anew meanwhile, so that the generator has to take the objects from self.objects after that. Where it
        works for long itself, it yields `breathe` from time to time. It returns the operator's result, or None for FINISHED:
        CANCELLED makes no undo step."""
        outcome = yield (yield from self.prepare(context))
        yield run.WRITE
        return self.finish(context, outcome)

    def each(self, tasks, names=None, steps=_one_step):
        """A generator for steps(): yields the work of one task after another, and returns the outcomes.

        With several tasks the status says which one is at work, and an error begins with its name. names: pairs of the text
        for the status and the name, by default of the tasks' own names. steps(task): a generator like steps(), which returns
        the outcome; by default that of task.run(progress).
        """
        if names is None:
            names = [(f"{task.name}, {i + 1} of {len(tasks)}", task.name) for i, task in enumerate(tasks)]
        outcomes = []
        for task, (part, name) in zip(tasks, names):
            if len(tasks) > 1:
                self.part = part
            try:
                outcomes.append((yield from steps(task)))
            except native.module.Cancelled:
                raise
            except (Refused, native.module.TolvolError) as error:
                if len(tasks) == 1:
                    raise
                raise Refused(f"{name}: {native.said(error)}") from None
        return outcomes

    def say(self, kind, text):
        """Reports the text where the user sees it: after Adjust Last Operation, report() of this operator shows nothing.

        kind: a set, as for report().
        """
        self._run.voice.report(kind, text)

    def execute(self, context):
        for earlier in runs:
            if earlier.operator == self:
                if earlier.rewinding:
                    return earlier.write()
                earlier.supersede()
        self._begin(context)
        ended = self._run.advance()
        if self.options.is_repeat and not bpy.app.background:
            return ended or self._run.go_on(run.PATIENCE) or adjusting.hand_over(self._run)
        while not ended:
            ended = self._run.advance()
        return ended

    def invoke(self, context, _event):
        if self._has_to_wait():
            return {"CANCELLED"}
        if sum(len(ob.data.polygons) for ob in self.targets(context)) < LARGE:
            self._begin(context)
            started = self._run.advance() or self._run.go_on(run.PATIENCE) or self._run.begin_modal(context)
            if started == {"RUNNING_MODAL"}:
                context.window_manager.modal_handler_add(self)
            return started
        self._waiting = _Waiting(context, self._asked(context))
        status_bar.show(progress_text.status_line(progress_text.preparing(self.bl_label)))
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _has_to_wait(self):
        """Whether another run is at work, which is reported."""
        other = under_way()
        if other:
            # Blender shows reports in the status bar, which the progress covers now. A popup would catch Esc.
            other.ask_to_wait()
            self.report({"WARNING"}, f"{other.label} is at work: wait until it ends, or press Esc")
        return other is not None

    def _asked(self, context):
        """Returns a value that changes where other objects, another mode or another number of vertices would be worked on, or a
        step was undone."""
        meshes = [(ob.name, ob.data.as_pointer(), len(ob.data.vertices)) for ob in self.targets(context)]
        return context.mode, undo_count(), meshes

    def modal(self, context, event):
        if self._waiting is None:
            return self._run.on_event(context, event)
        if not self._waiting.is_ended_by(event):
            return {"PASS_THROUGH"}
        waiting, self._waiting = self._waiting, None
        waiting.end(context)
        ended = {"CANCELLED"}
        try:
            ended = self._after_waiting(context, event, waiting)
        finally:
            if not runs:  # A run clears its own line.
                status_bar.clear()
        return ended

    def _after_waiting(self, context, event, waiting):
        if event.type == "ESC":
            self.report({"INFO"}, f"{self.bl_label} was cancelled. It has changed nothing")
            return {"CANCELLED"}
        if self._has_to_wait():
            return {"CANCELLED"}
        if not self.poll(context) or self._asked(context) != waiting.asked:
            self.report(
                {"WARNING"}, f"{self.bl_label} did not begin, because something has changed since it was pressed"
            )
            return {"CANCELLED"}
        self._begin(context)
        return self._run.begin_modal(context)

    def cancel(self, context):
        """Called when Blender closes the window or the file, or a dialog of the operator before its job has begun."""
        if self._waiting is not None:
            self._waiting.end(context)
            status_bar.clear()
        if self._run is not None:
            self._run.close(context)

    def _begin(self, context):
        again = self.options.is_repeat and not self.options.is_repeat_last
        named = [bpy.data.objects.get(name) for name in json.loads(self.worked_on or "[]")] if again else []
        self.objects = named if named and all(named) else self.targets(context)
        self.worked_on = json.dumps([ob.name for ob in self.objects])
        self.doing, self.share, self.count, self.part = "", 0.0, "", ""
        self._run = run.Run(self, context)


class _Waiting:
    """The time in which Blender draws the status bar before the run of an operator begins."""

    def __init__(self, context, asked):
        self.asked = asked
        self._timer = context.window_manager.event_timer_add(_SOON, window=context.window)
        self._ends_at = time.monotonic() + _SOON  # Other timers send the same events.

    def is_ended_by(self, event):
        if event.type == "ESC":
            return event.value == "PRESS"
        return event.type == "TIMER" and time.monotonic() >= self._ends_at

    def end(self, context):
        context.window_manager.event_timer_remove(self._timer)
