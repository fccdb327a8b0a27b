# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the long computation of an operator in a thread, with progress and Esc in the status bar.

An operator has three parts: prepare() reads Blender's data and returns the work; the work runs in the thread and touches
no data of Blender; finish() writes the outcome in one go. An operator whose work needs Blender between its parts
overrides steps(), a generator. For a script, for Adjust Last Operation and in Blender without a window the same parts
run one after the other, and the call returns when they are done.

While a job runs, Blender can be used: the operator takes Esc and passes all other events on. If the user changes what the job
works on, the job ends, and it writes nothing.
"""

import atexit
import hashlib
import json
import threading
import time

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import StringProperty

from . import native, status_bar
from .errors import Refused
from .mesh import mesh_io
from .redraw import redraw_sidebars
from .reference import measurements

# Blender waits so many seconds for a job before the status bar shows it: a short job makes no line flash up.
_PATIENCE = 0.4
_TICK = 0.1
# How long a stage takes is told from what it has done by then: so many seconds, and such a share of it.
_KNOWN_AFTER, _KNOWN_SHARE = 1.0, 0.05

_MODES = {"OBJECT": "Object Mode", "EDIT_MESH": "Edit Mode"}

# Only the main thread uses these lists.
_edited = False  # whether Blender has reported a change of some mesh that no operator has looked at yet
_at_work = []  # jobs whose threads may be running
_under_way = []  # modal operators: Blender goes on while their jobs run
_to_say = []  # messages for the status bar, to be shown once the next file is open


class Job:
    def __init__(self, work, progress):
        self.progress = progress
        self._outcome = None
        self._error = None
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        _at_work[:] = [job for job in _at_work if not job.done()]
        _at_work.append(self)
        self._thread.start()

    def _run(self, work):
        try:
            self._outcome = work(self.progress)
        except BaseException as error:  # The main thread raises it again, even if it is no Exception.
            self._error = error

    def done(self, seconds=0.0):
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def outcome(self):
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._outcome


def end_all():
    """Cancels every job and waits for its thread: Blender crashes if a thread outlives the Python interpreter."""
    for job in _at_work:
        job.progress.cancel()
    for job in _at_work:
        job.done(None)
    _at_work.clear()


class _Claim:
    """Remembers an object that an operator works on, as the object was when the operator began."""

    def __init__(self, ob):
        self._ob = ob
        self._name = ob.name
        self._mesh, self._content, self._place = self._state(), self._digest(), self._placed()

    def check(self, thoroughly):
        """Raises Refused unless the outcome can still be written to the object. thoroughly: compare every vertex, too."""
        try:
            name = self._ob.name
        except ReferenceError:
            raise Refused(f"{self._name} was deleted meanwhile: nothing was changed") from None
        if name != self._name:
            raise Refused(f"{self._name} was renamed to {name} meanwhile: nothing was changed")
        if self._state() != self._mesh or thoroughly and self._digest() != self._content:
            raise Refused(f"The mesh or the mode of {name} was changed meanwhile: nothing more was changed")
        (matrix, reference), (matrix_before, reference_before) = self._placed(), self._place
        if reference != reference_before:
            raise Refused(f"The reference of {name} was changed meanwhile: nothing more was changed")
        # With a reference of its own kind the object may be moved and turned: the reference goes along.
        own = self._ob.tolvol.reference_kind == "SELF" and measurements.same_shape(matrix_before, matrix)
        if not own and not np.array_equal(matrix, matrix_before):
            raise Refused(f"{name} was moved or scaled meanwhile: nothing more was changed")

    def _state(self):
        mesh = self._ob.data
        return mesh.as_pointer(), len(mesh.vertices), len(mesh.loops), len(mesh.polygons), self._ob.mode

    def _digest(self):
        """Returns a value that is equal for equal positions and faces."""
        self._ob.update_from_editmode()
        mesh = self._ob.data
        digest = hashlib.blake2b(mesh_io.column(mesh.vertices, "co", 3).tobytes(), digest_size=16)
        digest.update(mesh_io.column(mesh.loops, "vertex_index", 1, np.int32).tobytes())
        return digest.digest()

    def _placed(self):
        settings = self._ob.tolvol
        reference = settings.snapshot_fingerprint if settings.snapshot else "", settings.reference_kind
        return mesh_io.matrix_array(self._ob.matrix_world), reference


class JobOperator:
    """A base class for an Operator with prepare(context), which returns work(progress), and finish(context, outcome)."""

    # Adjust Last Operation works on the same objects again, although another object may be active by then.
    worked_on: StringProperty(
        description="The names of the objects that the operator worked on, as JSON", options={"HIDDEN", "SKIP_SAVE"}
    )

    doing = ""  # text for the status bar in place of the native stage
    part = ""  # which part of the work is under way, such as "Level 2 of 3", if there are several

    _steps = None
    _progress = None
    _job = None
    _timer = None
    _interrupted = None  # the message why the operator was stopped: its objects must not be touched any more

    def targets(self, context):
        """Returns the objects that the operator works on. The settings are those of the first one."""
        return [context.active_object]

    @property
    def ob(self):
        return self.objects[0]

    def improving(self):
        """Whether Esc keeps the present result. A second Esc cancels."""
        return self._progress.stage == "refining" and not self._progress.finishing

    def steps(self, context):
        """A generator in the main thread: yields work(progress) and is sent its outcome. It may change Blender's data only
        after the last yield."""
        outcome = yield self.prepare(context)
        self.finish(context, outcome)

    def each(self, tasks, names=None):
        """A generator for steps(): yields the work of one task after another, and returns the outcomes of task.run(progress).

        With several tasks the status says which one is at work, and an error begins with its name. names: pairs of the text
        for the status and the name, by default of the tasks' own names.
        """
        if names is None:
            names = [(f"{task.name}, {i + 1} of {len(tasks)}", task.name) for i, task in enumerate(tasks)]
        outcomes = []
        for task, (part, name) in zip(tasks, names):
            if len(tasks) > 1:
                self.part = part
            try:
                outcomes.append((yield task.run))
            except native.module.Cancelled:
                raise
            except (Refused, native.module.TolvolError) as error:
                if len(tasks) == 1:
                    raise
                raise Refused(f"{name}: {native.said(error)}") from None
        return outcomes

    def shown(self):
        """Returns what is known about the work under way, as lines of text for the panel, and its share that is done.

        The share is None where it is not known.
        """
        progress = self._progress
        if progress.cancelled:
            return [self.bl_label, "Stopping"], None
        lines = [self.bl_label, *([self.part] if self.part else [])]
        stage, count, share = _stage(progress)
        lines.append(self.doing or stage)
        if count and not self.doing:
            lines.append(count)
        left = self._clock.seconds_left(progress)
        if left is not None and not self.doing:
            lines.append(f"About {_duration(left)} left of this stage")
        lines.append(f"Esc: {_escape(self.improving())}")
        return lines, None if self.doing else share

    def execute(self, context):
        self._begin(context)
        while not (ended := self._advance()):
            pass
        return ended

    def invoke(self, context, _event):
        if _under_way:
            self.report({"WARNING"}, f"{_under_way[0].bl_label} is at work: wait until it ends, or press Esc")
            return {"CANCELLED"}
        self._begin(context)
        if ended := self._advance() or self._go_on(_PATIENCE):
            return ended
        manager = context.window_manager
        self._timer = manager.event_timer_add(_TICK, window=context.window)
        manager.modal_handler_add(self)
        _under_way.append(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if not self._interrupted:
            self._look()
        if self._interrupted:
            self._leave(context)
            self.report({"WARNING"}, self._interrupted)
            return {"CANCELLED"}
        if event.type == "ESC":
            if event.value != "PRESS":
                return {"RUNNING_MODAL"}
            if self.improving():
                self._progress.finish()
            else:
                self._progress.cancel()
            return {"RUNNING_MODAL"}
        # An undo step of one mode does not hold a change that is made in another: the outcome waits until the mode is back.
        if event.type == "TIMER" and context.mode == self._mode:
            try:
                ended = self._go_on(_TICK) if self._job.done() else None
            except BaseException:
                self._leave(context)
                raise
            if ended:
                self._leave(context)
                return ended
        if event.type == "TIMER":
            waits = "" if context.mode == self._mode else f"    Waits for {_MODES.get(self._mode, 'its mode')}"
            status = _status(self._progress, self.doing, self.part, self.improving())
            context.workspace.status_text_set(status + waits)
            redraw_sidebars()
        return {"PASS_THROUGH"}  # With RUNNING_MODAL beside it Blender would pass nothing on.

    def cancel(self, context):
        """Called when Blender closes the window or the file, or a dialog of the operator before its job has begun."""
        if self._job is None:
            return
        if self._interrupted:
            _to_say.append(self._interrupted)
        self._end()
        self._leave(context)

    def interrupt(self, happens):
        """Ends the job while the data that it began with still exists. Blender then calls modal() or cancel()."""
        self._interrupted = f"{self.bl_label} was stopped, because {happens}. It has changed nothing"
        self._end()

    def _look(self):
        """Ends the job as soon as its outcome cannot be written any more."""
        global _edited
        try:
            self._check(thoroughly=_edited)
        except Refused as error:
            self._interrupted = str(error)
            self._end()
        _edited = False

    def _check(self, thoroughly=True):
        for claim in self._claims:
            claim.check(thoroughly)

    def _end(self):
        self._progress.cancel()
        self._job.done(None)
        self._steps.close()

    def _begin(self, context):
        again = self.options.is_repeat and not self.options.is_repeat_last
        named = [bpy.data.objects.get(name) for name in json.loads(self.worked_on or "[]")] if again else []
        self.objects = named if named and all(named) else self.targets(context)
        self.worked_on = json.dumps([ob.name for ob in self.objects])
        self._mode, self._clock = context.mode, _Clock()
        self._claims = [_Claim(ob) for ob in self.objects]
        self._steps = self.steps(context)
        self._progress = native.module.Progress()
        self._job = None

    def _go_on(self, seconds):
        """Does as many steps as the time permits. Returns the operator's result if it has ended, else None."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0 and self._job.done(left):
            if ended := self._advance():
                return ended
        return None

    def _advance(self):
        """Starts the next work. Returns the operator's result if there is no more work, else None."""
        try:
            self._job = Job(self._next_work(), self._progress)
        except StopIteration:
            return {"FINISHED"}
        except native.module.Cancelled:
            self.report({"INFO"}, f"{self.bl_label} was cancelled. It has changed nothing")
            return {"CANCELLED"}
        except (Refused, native.module.TolvolError) as error:
            self.report({"ERROR"}, native.said(error))
            return {"CANCELLED"}
        return None

    def _next_work(self):
        if self._job is None:
            return next(self._steps)
        try:
            outcome = self._job.outcome()
            if self._progress.cancelled:  # The work may have ended before it noticed the cancel.
                raise native.module.Cancelled("cancelled")
            self._check()
        except BaseException as error:
            return self._steps.throw(error)
        return self._steps.send(outcome)

    def _leave(self, context):
        _under_way.remove(self)
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)


class _Clock:
    """Estimates how long the present stage of a job goes on."""

    def __init__(self):
        self._stage = None
        self._began = 0.0

    def seconds_left(self, progress):
        """Returns the seconds, or None as long as too little of the stage is done."""
        if progress.stage != self._stage or progress.fraction == 0:
            self._stage, self._began = progress.stage, time.monotonic()
        took, share = time.monotonic() - self._began, progress.fraction
        return took * (1 - share) / share if took >= _KNOWN_AFTER and share >= _KNOWN_SHARE else None


def _duration(seconds):
    return f"{seconds:.0f} s" if seconds < 60 else f"{seconds / 60:.0f} min"


def _stage(progress):
    """Returns the native stage, what it counts, and its share that is done, or None."""
    # In these two stages the count is the number of triangles left.
    counts = progress.count and progress.stage in {"decimating", "refining"}
    return (
        progress.stage.capitalize(),
        f"{progress.count:,} triangles left" if counts else "",
        progress.fraction or None,
    )


def _escape(improving):
    return "Keep Present Result" if improving else "Cancel"


def _status(progress, doing, part, improving):
    if progress.cancelled:
        return "Stopping"
    stage, count, share = _stage(progress)
    native_stage = stage + (f" {share:.0%}" if share else "") + (f", {count}" if count else "")
    prefix = f"{part}: " if part else ""
    return f"{prefix}{doing or native_stage}    Esc: {_escape(improving)}"


def under_way():
    """Returns the operator whose job runs now, or None."""
    return _under_way[0] if _under_way else None


def _interrupt(happens):
    for operator in _under_way:
        operator.interrupt(happens)


@persistent
def _before_load(*_):
    _interrupt("another file was opened")


@persistent
def _before_undo(*_):
    _interrupt("a step was undone")


@persistent
def _before_redo(*_):
    _interrupt("a step was redone")


@persistent
def _after_load(*_):
    for text in _to_say:
        status_bar.say(text)
    _to_say.clear()


@persistent
def _after_update(_scene, depsgraph):
    """Notes a change of any mesh, so that the operators look whether it is one of theirs."""
    global _edited
    if _under_way and any(update.is_updated_geometry for update in depsgraph.updates):
        _edited = True


_HANDLERS = (
    ("depsgraph_update_post", _after_update),
    ("load_pre", _before_load),
    ("undo_pre", _before_undo),
    ("redo_pre", _before_redo),
    ("load_post", _after_load),
)


def register():
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)
    atexit.register(end_all)  # On exit Blender does not unregister an add-on that a script has registered.


def unregister():
    atexit.unregister(end_all)
    end_all()
    for name, handler in reversed(_HANDLERS):
        getattr(bpy.app.handlers, name).remove(handler)
    status_bar.clear()
