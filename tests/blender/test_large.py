# SPDX-License-Identifier: GPL-3.0-or-later
"""What keeps Blender answering while the add-on works on a large mesh. The tests count steps and reads of small ones."""

import sys
from pathlib import Path
from unittest import mock

import bmesh
import bpy
import pytest

from addon.estimate import memory
from addon.job import interruptions, run
from addon.mesh import mesh_io, transfer
from addon.operators import fit_modifier, lod, reference
from addon.panels import notes
from addon.proof import verdict
from addon.reference import snapshots
from scenes import cage, torus
from test_job import Context, Modal, event

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmark"))
from peak_memory import PeakMemory  # noqa: E402


class Logged:
    """The steps of an operator, which note in a list when each begins."""

    def __init__(self, steps, log):
        self._steps, self._log = steps, log

    def send(self, value):
        self._log.append("step")
        return self._steps.send(value)

    def throw(self, error):
        return self._steps.throw(error)

    def close(self):
        self._steps.close()


@pytest.fixture
def reads(monkeypatch):
    """A list that gets "read" for each mesh that is read and "step" for each step of an operator."""
    log, read, begin = [], mesh_io.read_mesh, run.Run.__init__

    def begin_logged(self, operator, context):
        begin(self, operator, context)
        self._steps = Logged(self._steps, log)

    monkeypatch.setattr(mesh_io, "read_mesh", lambda mesh: log.append("read") or read(mesh))
    monkeypatch.setattr(run.Run, "__init__", begin_logged)
    return log


def triangulated(**options):
    ob = torus(**options)
    edited = bmesh.new()
    edited.from_mesh(ob.data)
    bmesh.ops.triangulate(edited, faces=edited.faces[:])
    edited.to_mesh(ob.data)
    edited.free()
    return ob


OPERATORS = {
    "set_reference": {"replace": True},
    "check": {},
    "measure_statistics": {},
    "worst_point": {},
    "select_outside": {},
    "select_crossing": {},
    "decimate": {},
    "make_lods": {"levels": 2},
    "smooth": {},
    "deform": {},
    "apply_modifier": {"modifier": "smooth"},
    "fit_modifier": {"modifier": "fewer", "value": 0.9},
}


@pytest.mark.parametrize("name", OPERATORS)
def test_no_step_reads_two_meshes_before_the_work_begins(name, reads, monkeypatch):
    ob = triangulated()
    ob.modifiers.new("smooth", "SMOOTH").factor = 0.1
    ob.modifiers.new("fewer", "DECIMATE").show_viewport = False
    ob.tolvol.lattice = cage()
    ob.tolvol.lattice.data.points[0].co_deform.x += 0.1
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for vertex in ob.data.vertices[:20]:
        vertex.co *= 1.001
    ob.data.update()
    bpy.context.view_layer.update()
    begin = run.Job
    monkeypatch.setattr(run, "Job", lambda *about: reads.append("job") or begin(*about))
    reads.clear()
    assert getattr(bpy.ops.tolvol, name)(**OPERATORS[name]) & {"FINISHED", "CANCELLED"}
    until_job = "".join(each[0] for each in reads[: reads.index("job")])
    assert "r" in until_job and "rr" not in until_job, until_job


@pytest.fixture
def begun():
    """A run of an operator that is modal before its steps begin."""
    operator = Modal(lambda _progress: "outcome")
    operator._run._timer = object()
    interruptions.runs.append(operator._run)
    yield operator
    if operator._run in interruptions.runs:
        interruptions.runs.remove(operator._run)


def test_the_steps_of_a_run_begin_with_an_event(begun):
    assert begun._run._job is None
    while begun.modal(Context(), event("TIMER")) != {"FINISHED"}:
        pass
    assert begun.ended == ["outcome"]


def test_esc_before_the_first_step_ends_a_run_without_it(begun):
    assert begun.modal(Context(), event("ESC")) == {"RUNNING_MODAL"}
    assert begun.modal(Context(), event("TIMER")) == {"CANCELLED"}
    assert begun.said == "Modal was cancelled. It has changed nothing" and begun._run._job is None


def test_vertices_are_removed_in_parts(monkeypatch):
    prepare, parts = transfer.Writing.prepare, []

    def counted(self):
        parts.append(0)
        for part in prepare(self):
            parts[-1] += 1
            yield part

    monkeypatch.setattr(transfer.Writing, "prepare", counted)
    for piece in (10_000, 100):
        monkeypatch.setattr(transfer, "_PIECE", piece)
        torus()
        assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    assert parts[1] >= parts[0] + 6


def test_no_mesh_is_made_to_cut_triangles():
    ob = triangulated()
    polygons, positions = mesh_io.Polygons.of(ob.data), mesh_io.column(ob.data.vertices, "co", 3)
    expected = mesh_io.read_mesh(ob.data).triangles
    with mock.patch.object(mesh_io, "_add_polygons", side_effect=AssertionError):
        assert (polygons.triangles_at(positions) == expected).all()
    with mock.patch.object(mesh_io, "triangles_at", side_effect=AssertionError):
        assert bpy.ops.tolvol.smooth() == {"FINISHED"}


# What changes meanwhile ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("work", ("check", "worst_point", "decimate", "smooth"))
def test_a_mesh_and_its_own_reference_are_at_one_place_although_the_object_moves_while_they_are_read(work, monkeypatch):
    ob = torus()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for vertex in ob.data.vertices:
        vertex.co.z += 0.3
    ob.data.update()
    read = snapshots.reference_of

    def moved(ob, own=None):
        ob.location.z += 0.3
        bpy.context.view_layer.update()
        return read(ob, own)

    monkeypatch.setattr(snapshots, "reference_of", moved)
    if work in ("decimate", "smooth"):
        with pytest.raises(RuntimeError, match="not within the tolerance"):
            getattr(bpy.ops.tolvol, work)()
        return
    assert getattr(bpy.ops.tolvol, work)() == {"FINISHED"}
    found = verdict.of(ob)
    assert found is None or not found.passed and found.forward.upper > 0.25


def test_levels_and_their_reference_are_at_one_place_although_the_object_moves_while_they_are_read(monkeypatch):
    ob = torus()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    limits = lod.TOLVOL_OT_make_lods._limits

    def moved(operator, context, size):
        ob.location.z += 0.3
        bpy.context.view_layer.update()
        return limits(operator, context, size)

    monkeypatch.setattr(lod.TOLVOL_OT_make_lods, "_limits", moved)
    assert bpy.ops.tolvol.make_lods(levels=2) == {"FINISHED"}
    assert all(verdict.of(level).passed for level in ob.tolvol.lods.objects)


def test_a_change_that_blender_does_not_tell_of_is_seen_with_the_next_one():
    ob = torus()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and verdict.of(ob).passed
    other = torus(name="other")
    co = mesh_io.column(ob.data.vertices, "co", 3)
    co[0] += 1
    ob.data.vertices.foreach_set("co", co.ravel())
    ob.data.update()
    bpy.context.scene.frame_set(5)  # It evaluates the mesh, and calls no handler of changes.
    other.data.vertices[0].co.x += 1
    bpy.context.view_layer.update()
    assert verdict.of(ob) is None and reference.loses_something(ob)


def test_esc_before_the_first_step_of_a_fit_finds_no_result_to_keep():
    assert not fit_modifier.TOLVOL_OT_fit_modifier._found


# Memory --------------------------------------------------------------------------------------------------------------


def named(ob):
    """Returns the sentence of Notes about memory with its icon, or None."""
    return next((line for line in notes.notes(bpy.context, ob)[0] if "of memory" in line[0]), None)


def test_notes_name_the_memory_before_it_is_taken(monkeypatch):
    ob = torus()
    assert named(ob) is None
    monkeypatch.setattr(memory, "_OF_MESH", 1_000_000)
    monkeypatch.setattr(memory, "free", lambda: 8_000_000_000)
    assert named(ob) == ("Decimate takes about 2.3 GB of memory, and 8 GB are free", "INFO")
    monkeypatch.setattr(memory, "free", lambda: 1_000_000_000)
    assert named(ob) == ("Decimate takes about 2.3 GB of memory, and 1 GB are free", "ERROR")
    monkeypatch.setattr(memory, "free", lambda: None)
    assert named(ob) == ("Decimate takes about 2.3 GB of memory", "INFO")


def test_decimate_takes_about_the_memory_that_is_named():
    ob = torus(around=400, across=200, noise=1e-4)
    need = memory.needed(ob)
    assert need == 40_000_000 + 1000 * 160_000 and memory.free() > need
    peak = PeakMemory()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    assert need / 2 < peak.peak() - peak.before < 1.3 * need
