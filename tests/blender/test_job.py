# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of a job's objects while it runs, and jobs that run when Blender ends."""

import threading

import bpy
import pytest

from addon import job, native
from addon.overlay import work
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
        self.report({"WARNING"}, DONE)


@pytest.fixture
def stand_in():
    bpy.utils.register_class(TOLVOL_OT_stand_in)
    TOLVOL_OT_stand_in.written = False
    yield TOLVOL_OT_stand_in
    bpy.utils.unregister_class(TOLVOL_OT_stand_in)


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
    monkeypatch.setattr(job, "_under_way", [operator])
    happens()
    assert interrupted == [why]


def stubborn(progress):
    """Work that ends only after it is cancelled and, like native code, some time later."""
    while not progress.cancelled:
        pass
    threading.Event().wait(0.2)


def test_jobs_are_waited_for_when_blender_ends():
    running = job.Job(stubborn, native.module.Progress())
    assert not running.done()
    job.end_all()
    assert running.done()


def test_what_the_overlay_had_begun_ends_though_another_file_was_opened(monkeypatch):
    began, ended = threading.Event(), []
    work.later("it", 0, lambda: lambda _progress: began.set(), lambda *outcome: ended.append(outcome))
    work._tick()
    assert began.wait(60)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert bpy.app.timers.is_registered(work._tick)
    while not ended:
        work._tick()
    work.stop()
