# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of a job's objects while it runs, and jobs that run when Blender ends."""

import inspect
import threading
from types import SimpleNamespace

import bpy
import pytest

from addon import job, native, status_bar
from addon.background import queue, thread
from addon.job import interruptions, progress_text
from addon.job.run import Run
from scenes import torus

DONE = "torus: done"


class TOLVOL_OT_stand_in(job.JobOperator, bpy.types.Operator):
    """A job whose objects are changed while it runs"""

    bl_idname = "tolvol.stand_in"
    bl_label = "Stand In"

    happens = staticmethod(lambda: None)
    written = False

    def steps(self, context):
        cls = type(self)
        cls.happens()
        yield lambda _progress: None
        cls.written = True
        self.say({"WARNING"}, DONE)


@pytest.fixture
def stand_in():
    bpy.utils.register_class(TOLVOL_OT_stand_in)
    TOLVOL_OT_stand_in.written = False
    yield TOLVOL_OT_stand_in
    bpy.utils.unregister_class(TOLVOL_OT_stand_in)


def operators(base=job.JobOperator):
    for sub in base.__subclasses__():
        yield from operators(sub)
        yield sub


def test_no_operator_reports_past_say():
    """After Adjust Last Operation nobody sees what an operator itself reports."""
    found = [cls for cls in operators() if cls.__module__.startswith("addon.")]
    assert len(found) > 10
    assert [cls.__name__ for cls in found if "self.report(" in inspect.getsource(cls)] == []


def delete():
    bpy.data.objects.remove(bpy.data.objects["torus"])


def delete_with_its_mesh():
    bpy.data.meshes.remove(bpy.data.objects["torus"].data)


def rename():
    bpy.data.objects["torus"].name = "ring"


def edit():
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="FACE")
    bpy.ops.object.mode_set(mode="OBJECT")


def change_the_mode():
    bpy.ops.object.mode_set(mode="SCULPT")


@pytest.mark.parametrize(
    ("happens", "said"),
    [
        (delete, "torus was deleted meanwhile: nothing was changed"),
        (delete_with_its_mesh, "torus was deleted meanwhile: nothing was changed"),
        (rename, "torus was renamed to ring meanwhile: nothing was changed"),
        (edit, "The mesh or the mode of torus was changed meanwhile"),
        (change_the_mode, "The mesh or the mode of torus was changed meanwhile"),
    ],
)
def test_a_job_whose_object_is_another_one_writes_nothing_and_says_so(stand_in, happens, said):
    torus()
    stand_in.happens = staticmethod(happens)
    with pytest.raises(RuntimeError, match=said):
        bpy.ops.tolvol.stand_in()
    assert not stand_in.written


def test_a_job_that_nothing_happens_to_writes(stand_in):
    torus()
    stand_in.happens = staticmethod(lambda: None)
    assert bpy.ops.tolvol.stand_in() == {"FINISHED"} and stand_in.written


@pytest.mark.parametrize(
    ("happens", "why"),
    [
        (lambda: bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True), "another file was opened"),
        (bpy.ops.ed.undo, "a step was undone"),
    ],
)
def test_jobs_end_before_a_file_is_loaded_or_a_step_undone(monkeypatch, happens, why):
    torus()
    bpy.ops.ed.undo_push(message="one")
    torus("other")
    bpy.ops.ed.undo_push(message="two")
    interrupted = []
    operator = type("Operator", (), {"interrupt": lambda _self, because: interrupted.append(because)})()
    monkeypatch.setattr(interruptions, "runs", [operator])
    happens()
    assert interrupted == [why]


def stubborn(progress):
    """Work that ends only after it is cancelled and, like native code, some time later."""
    while not progress.cancelled:
        native.module.pause(0.001)
    native.module.pause(0.2)  # longer than the main thread gives a job that it only looks at


def test_jobs_are_waited_for_when_blender_ends():
    running = thread.Job(stubborn, native.module.Progress())
    assert not running.done()
    thread.end_all()
    assert running.done()


def test_operators_get_a_context_from_python_while_jobs_run():
    """Beside ordinary threads that run Python code, Blender 3.4 crashes here (native/python/worker.h tells why)."""
    ob = torus()

    def work(progress):
        while not progress.cancelled:
            [str(number) * 3 for number in range(1000)]
            native.module.pause(0.0)

    jobs = [thread.Job(work, native.module.Progress()) for _ in range(2)]
    for _ in range(100):
        assert not any(job.done() for job in jobs)
        with bpy.context.temp_override(active_object=ob, selected_objects=[ob]):
            for _ in range(20):
                bpy.ops.object.shade_smooth()
    thread.end_all()


def test_what_the_overlay_had_begun_ends_though_another_file_was_opened(monkeypatch):
    began, ended = [], []
    queue.later(("it",), 0, lambda: lambda _progress: began.append(1), lambda *outcome: ended.append(outcome))
    queue._tick()
    while not began:
        native.module.pause(0.01)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert bpy.app.timers.is_registered(queue._tick)
    while not ended:
        queue._tick()
    queue.stop()


# While a job runs, Blender can be used -------------------------------------------------------------------------------


def nudge():
    """Moves one vertex: the numbers of all elements stay."""
    bpy.data.objects["torus"].data.vertices[7].co.x += 0.01


def scale():
    bpy.data.objects["torus"].scale = (2, 1, 1)
    bpy.context.view_layer.update()


def set_reference():
    bpy.ops.tolvol.set_reference()


@pytest.mark.parametrize(
    ("happens", "said"),
    [
        (nudge, "The mesh or the mode of torus was changed meanwhile"),
        (scale, "torus was moved or scaled meanwhile"),
        (set_reference, "The reference of torus was changed meanwhile"),
    ],
)
def test_a_job_whose_object_is_changed_unseen_writes_nothing(stand_in, happens, said):
    torus()
    stand_in.happens = staticmethod(happens)
    with pytest.raises(RuntimeError, match=said):
        bpy.ops.tolvol.stand_in()
    assert not stand_in.written


def turn():
    bpy.data.objects["torus"].location.x = 3
    bpy.data.objects["torus"].rotation_euler.z = 1
    bpy.context.view_layer.update()


def work_on_another():
    other = bpy.data.objects["other"]
    bpy.context.view_layer.objects.active = other
    other.data.vertices[0].co.x += 1
    bpy.data.objects["torus"].select_set(False)


@pytest.mark.parametrize("happens", [turn, work_on_another])
def test_what_does_not_concern_a_job_does_not_end_it(stand_in, happens):
    torus("other")
    torus()
    stand_in.happens = staticmethod(happens)
    assert bpy.ops.tolvol.stand_in() == {"FINISHED"} and stand_in.written


def test_a_moved_object_with_another_reference_is_refused(stand_in):
    other = torus("other")
    ob = torus()
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", other
    stand_in.happens = staticmethod(turn)
    with pytest.raises(RuntimeError, match="torus was moved or scaled meanwhile"):
        bpy.ops.tolvol.stand_in()
    assert not stand_in.written


def event(kind, value="PRESS"):
    return type("Event", (), {"type": kind, "value": value})()


class Context:
    """What modal() uses of Blender's context."""

    mode = "OBJECT"

    def __init__(self):
        self.removed = []
        self.window_manager = type("Manager", (), {"event_timer_remove": self.removed.append})()


class Modal(job.JobOperator):
    """A JobOperator without the base class of Blender."""

    bl_label = "Modal"

    def __init__(self, work):
        self.objects, self.ended, self._work = [], [], work
        self._run = Run(self, Context())

    def steps(self, _context):
        self.ended.append((yield self._work))

    def report(self, kind, text):
        self.said = text


@pytest.fixture
def waiting():
    """(a job that ends when `go` is set, go)"""
    go = threading.Event()

    def wait(_progress):
        while not go.is_set():
            native.module.pause(0.001)
        return True

    operator = Modal(wait)
    operator._run.advance()
    interruptions.runs.append(operator._run)
    yield operator, go
    go.set()
    if operator._run in interruptions.runs:
        interruptions.runs.remove(operator._run)


def test_all_events_but_esc_are_passed_on(waiting):
    operator, go = waiting
    context = Context()
    for kind in ("MIDDLEMOUSE", "WHEELUPMOUSE", "LEFTMOUSE", "G", "TAB", "MOUSEMOVE", "TIMER"):
        assert operator.modal(context, event(kind)) == {"PASS_THROUGH"}
    assert operator.modal(context, event("ESC", "RELEASE")) == {"RUNNING_MODAL"} and not operator.progress.cancelled
    assert operator.modal(context, event("ESC")) == {"RUNNING_MODAL"} and operator.progress.cancelled
    go.set()
    operator._run._job.outcome()
    assert operator.modal(context, event("TIMER")) == {"CANCELLED"} and not operator.ended
    assert operator.said == "Modal was cancelled. It has changed nothing"


@pytest.mark.parametrize("kind", ("ESC", "TIMER", "MOUSEMOVE"))
def test_an_error_while_an_event_is_handled_ends_the_run(waiting, monkeypatch, kind):
    operator, go = waiting
    go.set()  # Its end is waited for.
    operator._run._job.done(None)

    def fail(*_):
        raise RuntimeError("unexpected")

    failing = {"ESC": (Modal, "improving"), "TIMER": (Run, "go_on"), "MOUSEMOVE": (Run, "_look")}
    monkeypatch.setattr(*failing[kind], fail)
    context = Context()
    with pytest.raises(RuntimeError, match="unexpected"):
        operator.modal(context, event(kind))
    assert not interruptions.runs and len(context.removed) == 1
    assert operator.progress.cancelled and operator._run._steps.gi_frame is None


def test_an_outcome_waits_until_the_mode_is_that_of_the_start(waiting, monkeypatch):
    texts = []
    monkeypatch.setattr(status_bar, "show", texts.append)
    operator, go = waiting
    go.set()
    operator._run._job.outcome()
    context = Context()
    context.mode = "EDIT_MESH"
    assert operator.modal(context, event("TIMER")) == {"PASS_THROUGH"} and not operator.ended
    assert texts[-1].endswith("Waits for Object Mode")
    context.mode = "OBJECT"
    assert operator.modal(context, event("TIMER")) == {"FINISHED"} and operator.ended == [True]


def test_the_status_bar_is_told_again_once_something_else_has_removed_the_text(waiting, monkeypatch):
    texts, shown = [], []
    monkeypatch.setattr(status_bar, "show", lambda text: (texts.append(text), shown.append(text)))
    monkeypatch.setattr(status_bar, "showing", lambda: bool(shown))
    operator, _ = waiting
    operator._run._began -= 10
    for _ in range(3):
        assert operator.modal(Context(), event("TIMER")) == {"PASS_THROUGH"}
    assert len(texts) == 1
    shown.clear()
    operator.modal(Context(), event("TIMER"))
    assert len(texts) == 2 and texts[0] == texts[1]


def test_a_second_job_waits_for_the_first(waiting):
    second = type("Second", (Modal,), {"__init__": lambda self: None})()
    assert second.invoke(None, None) == {"CANCELLED"}
    assert second.said == "Modal is at work: wait until it ends, or press Esc"
    assert waiting[0]._run.told().count == "another operation has to wait"


class Progress:
    stage, fraction, count, cancelled, finishing = "decimating", 0.0, 0, False, False


def test_the_panel_is_told_stage_count_part_and_time_left(waiting, monkeypatch):
    operator, _ = waiting
    now = [100.0]
    monkeypatch.setattr(progress_text.time, "monotonic", lambda: now[0])
    operator._run.progress = progress = Progress()
    operator.improving = lambda: False
    operator.part = "torus, 2 of 3"
    progress.stage = ""  # as before the first stage
    assert operator._run.told().stage == "Preparing"
    progress.stage = "decimating"
    assert operator._run.told() == progress_text.Told("Modal", "torus, 2 of 3", "Decimating", None, "", "", "Cancel")
    now[0] += 10
    progress.fraction, progress.count = 0.25, 12_400
    told = operator._run.told()
    assert (told.share, told.left, told.count) == (0.25, "30 s left", "12,400 triangles left")
    assert progress_text.status_line(told) == ("torus, 2 of 3: Decimating (25%), 12,400 triangles left    Esc: Cancel")
    progress.stage, progress.fraction = "measuring", 0.5
    told = operator._run.told()
    assert (told.stage, told.left, told.count) == ("Measuring", "", "")  # A new stage has just begun.
    now[0] += 200
    assert operator._run.told().left == ""  # A stage may begin in the middle, and nothing was done of it.
    progress.fraction = 0.75
    assert operator._run.told().left == "3 min left"


def test_after_the_first_escape_the_panel_says_that_it_was_heard_and_what_a_second_one_does(waiting, monkeypatch):
    operator, _ = waiting
    operator._run.progress = progress = Progress()
    operator.improving = lambda: progress.stage == "refining" and not progress.finishing
    progress.stage, progress.count = "refining", 1859
    assert (operator._run.told().stage, operator._run.told().escape) == ("Refining", "Keep Present Result")
    progress.finishing = True
    assert progress_text.status_line(operator._run.told()) == "Ending, 1,859 triangles left    Esc: Discard Result"
    progress.stage = "measuring"
    assert (operator._run.told().stage, operator._run.told().escape) == ("Measuring", "Discard Result")


def test_an_operator_that_says_what_it_does_says_how_far_it_is_over_all_its_steps(waiting, monkeypatch):
    operator, _ = waiting
    now = [100.0]
    monkeypatch.setattr(progress_text.time, "monotonic", lambda: now[0])
    operator._run.progress = progress = Progress()
    progress.fraction = 0.9  # of the native stage, which is one of many
    operator.improving = lambda: True
    operator.part, operator.doing, operator.share, operator.count = "Fitting Decimate", "Ratio 0.1", 0.0, ""
    assert operator._run.told().share is None and operator._run.told().left == ""
    now[0] += 10
    operator.doing, operator.share, operator.count, progress.stage = (
        "Ratio 0.12",
        0.25,
        "900 triangles so far",
        "sampling",
    )
    told = operator._run.told()
    assert (told.stage, told.share, told.left) == ("Ratio 0.12", 0.25, "30 s left")
    text = "Fitting Decimate: Ratio 0.12 (25%), 900 triangles so far    Esc: Keep Present Result"
    assert progress_text.status_line(told) == text


def test_a_batch_names_each_object_and_reports_totals(monkeypatch, capfd):
    objects = [torus(name) for name in ("one", "two", "three")]
    for ob in objects:
        ob.select_set(True)
    parts = []
    work = Run._next_work
    monkeypatch.setattr(Run, "_next_work", lambda self: (work(self), parts.append(self.operator.part))[0])
    bpy.ops.tolvol.decimate()
    assert parts == ["three, 1 of 3", "one, 2 of 3", "two, 3 of 3"]
    left = sum(len(ob.data.polygons) for ob in objects)
    assert f"Info: 3 objects: 6,912 -> {left:,} triangles, 3 of 3 PASS, " in capfd.readouterr().out


def test_a_job_that_stops_keeps_the_name_that_the_panel_has_shown():
    operator = SimpleNamespace(bl_label="A name without room in the panel", part="Short")
    progress = SimpleNamespace(cancelled=True, stage="reading", fraction=0.0, count=0)
    told = progress_text.tell(operator, progress, progress_text.Clock())
    assert (told.part, told.stage) == ("Short", "Stopping")
