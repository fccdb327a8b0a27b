# SPDX-License-Identifier: GPL-3.0-or-later
"""In Edit and Sculpt Mode a mesh is measured by itself. Blender calls the handlers and the timer; here the tests do."""

import time

import bmesh
import bpy
import numpy as np
import pytest

from addon import measuring, native
from addon.background import queue
from addon.mesh import mesh_io
from addon.panels import deviation
from addon.proof import statistics, verdict
from addon.proof.verdict import FAIL, NOT_CHECKED, PASS
from addon.reference import measurements
from addon.shared.proof import measure
from scenes import sheet


@pytest.fixture(autouse=True)
def _nothing_left():
    yield
    queue.stop()
    measurements.forget_kept()


def in_mode(mode, **settings):
    """A flat sheet that is its own reference, in this mode."""
    ob = sheet(count=20, bumps=0.0)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for name, value in settings.items():
        setattr(ob.tolvol, name, value)
    bpy.ops.object.mode_set(mode=mode)
    measuring.note(ob)
    return ob


def measured():
    """Does what the timer does until nothing waits."""
    end = time.monotonic() + 60
    while queue._waiting or queue._running is not None:
        assert time.monotonic() < end
        queue._tick()
        time.sleep(0.01)


def cut_a_hole(ob):
    edited = bmesh.from_edit_mesh(ob.data)
    chosen = [face for face in edited.faces if face.calc_center_median().length < 0.3]
    bmesh.ops.delete(edited, geom=chosen, context="FACES")
    bmesh.update_edit_mesh(ob.data)
    measuring.note(ob)


def test_a_hole_is_a_failure_at_once_and_its_numbers_are_those_of_check():
    ob = in_mode("EDIT")
    measured()
    assert verdict.word(ob) == PASS and verdict.of(ob).largest < 1e-12
    cut_a_hole(ob)
    assert verdict.word(ob) == NOT_CHECKED, "what was measured was another mesh"
    measured()
    found = verdict.of(ob)
    assert found.word == FAIL and found.ways == "the reference" and found.forward.upper < 1e-12
    assert statistics.of(ob) is None
    # It is no operator: nothing is stored with the object, whose undo steps stay as they are.
    assert not ob.tolvol.measurement.complete
    bpy.ops.object.mode_set(mode="OBJECT")
    assert verdict.of(ob) == found, "it is still the same mesh"
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    assert verdict.of(ob).backward == found.backward and ob.tolvol.measurement.complete


def test_what_check_has_measured_is_known_in_edit_mode_without_another_measurement(monkeypatch):
    ob = sheet(count=20, bumps=0.0)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    ob.data.vertices[200].co.z += 0.05
    ob.data.update()
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    found, asked = verdict.of(ob), []
    both_ways = measure.both_ways
    monkeypatch.setattr(measure, "both_ways", lambda *given: asked.append(given) or both_ways(*given))
    bpy.ops.object.mode_set(mode="EDIT")
    measuring.note(ob)
    measured()
    assert found.word == FAIL and verdict.of(ob) == found and not asked
    cut_a_hole(ob)
    measured()
    assert verdict.word(ob) == FAIL and verdict.of(ob) != found and len(asked) == 1
    ob.tolvol.tolerance_percent *= 2
    measuring.note(ob)
    measured()
    assert len(asked) == 2, "it was measured with another tolerance"


def test_the_progress_of_both_directions_is_that_of_one_measurement(monkeypatch):
    arrays = mesh_io.read_mesh(sheet(count=20, bumps=0.1).data)
    surface, other = ((arrays.vertices * scale, arrays.triangles) for scale in (np.float32(1), np.float32(1.1)))
    progress, seen = native.module.Progress(), []
    measured_way = native.module.directed_hausdorff

    def noted(*given, **options):
        found = measured_way(*given, **options)
        seen.append(progress.fraction)
        return found

    monkeypatch.setattr(native.module, "directed_hausdorff", noted)
    measure.both_ways(surface, other, progress=progress)
    assert 0 < seen[0] <= 0.5 < seen[1] <= 1
    monkeypatch.setattr(native.module, "directed_hausdorff", lambda *given, **options: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        measure.both_ways(surface, other, progress=progress)
    measured_way(*surface, *other, progress=progress)
    assert progress.fraction > 0.5, "the part has ended"


def test_a_change_of_the_mesh_tolerance_or_reference_counts():
    ob = in_mode("SCULPT")
    ob.data.vertices[200].co.z += 0.05
    measuring.note(ob)
    measured()
    assert verdict.word(ob) == FAIL
    ob.tolvol.tolerance_percent = 5
    assert verdict.word(ob) == PASS
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.data.vertices[200].co.z += 1
    ob.data.update()
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED
    ob.data.vertices[200].co.z = 0.05
    ob.data.update()
    bpy.context.view_layer.update()
    assert verdict.of(ob).largest > 0.04
    assert bpy.ops.tolvol.set_reference(replace=True) == {"FINISHED"}
    assert verdict.of(ob).largest == 0, "it is its own reference now"


def test_a_mesh_that_changes_meanwhile_is_measured_again():
    ob = in_mode("EDIT")
    queue._tick()
    while queue._running is None:
        queue._tick()
    cut_a_hole(ob)
    assert queue._running is None or queue._running[2].progress.cancelled
    measured()
    assert verdict.word(ob) == FAIL


def test_a_mesh_that_cannot_be_measured_has_a_reason():
    ob = in_mode("EDIT")
    measured()
    edited = bmesh.from_edit_mesh(ob.data)
    bmesh.ops.delete(edited, geom=edited.verts[:], context="VERTS")
    bmesh.update_edit_mesh(ob.data)
    measuring.note(ob)
    assert deviation._why_not_checked(ob) == "Being measured"
    measured()
    assert verdict.word(ob) == NOT_CHECKED and deviation._why_not_checked(ob) == "sheet has no faces"


def test_a_measurement_that_fails_has_a_reason_until_the_mesh_changes(monkeypatch):
    def fail(*_arguments):
        raise MemoryError

    monkeypatch.setattr(measuring.measure, "both_ways", fail)
    ob = in_mode("EDIT")
    measured()
    reason = "The memory is not enough to measure the mesh"
    assert verdict.word(ob) == NOT_CHECKED and deviation._why_not_checked(ob) == reason
    monkeypatch.undo()
    measuring.note(ob)
    assert deviation._why_not_checked(ob) == "Being measured"
    measured()
    assert verdict.word(ob) == PASS


@pytest.mark.parametrize("share", (0.9e-6, 1.1e-6))
def test_what_is_no_more_than_rounding_is_said_to_be_almost_nothing(share):
    texts = deviation._distance(bpy.context, share * 0.02, 0.02)
    assert (texts == ["almost 0"]) == (share < 1e-6)


def test_only_what_is_shown_or_guarded_is_measured():
    ob = in_mode("EDIT", show_deviation=False)
    measured()
    assert verdict.word(ob) == NOT_CHECKED and not measuring.wanted(ob)
    ob.tolvol.guard.editing = True
    measuring.refresh()
    measuring.note(ob)
    measured()
    assert verdict.word(ob) == PASS
    bpy.ops.object.mode_set(mode="OBJECT")
    assert not measuring.wanted(ob), "there is Check"


def test_what_is_sculpted_outside_of_the_stored_mesh_is_not_measured():
    ob = in_mode("SCULPT")
    assert measuring.wanted(ob)
    bpy.ops.sculpt.dynamic_topology_toggle()
    assert not measuring.wanted(ob)
    bpy.ops.sculpt.dynamic_topology_toggle()
    assert measuring.wanted(ob)
    ob.modifiers.new("multires", "MULTIRES")
    assert not measuring.wanted(ob)


def test_a_change_in_another_mode_outdates_what_was_measured_in_edit_mode():
    ob = in_mode("EDIT")
    measured()
    assert verdict.word(ob) == PASS
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.data.vertices[0].co.z += 1
    ob.data.update()
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    assert verdict.word(ob) == NOT_CHECKED


def test_measuring_by_itself_keeps_the_statistics_of_the_same_mesh():
    ob = in_mode("OBJECT")
    bpy.ops.tolvol.measure_statistics()
    known = measurements.measurement_of(ob).statistics
    bpy.ops.object.mode_set(mode="EDIT")
    measuring.note(ob)
    measured()
    assert known and measurements.measurement_of(ob).statistics == known


def test_a_name_that_passes_to_another_object_takes_no_measurement_along():
    one, other = in_mode("EDIT"), sheet("other", count=20, bumps=0.0)
    measured()
    assert verdict.word(one) == PASS
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for vertex in other.data.vertices:
        vertex.co.z += 1
    other.data.update()
    name, one.name = one.name, "gone"
    other.name = name
    bpy.ops.object.mode_set(mode="EDIT")
    assert other.mode == "EDIT" and verdict.word(other) == NOT_CHECKED


def test_what_changes_while_another_mesh_is_read_counts():
    one = in_mode("EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")
    other = sheet("other", count=20, bumps=0.0)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for ob in (one, other):
        ob.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    handlers = bpy.app.handlers.depsgraph_update_post
    handlers.append(measuring._note_changes)
    try:
        measuring.note(one), measuring.note(other)
        measured()
        assert verdict.word(other) == PASS
        edited = bmesh.from_edit_mesh(other.data)
        for vertex in edited.verts:
            vertex.co.z += 1
        bmesh.update_edit_mesh(other.data)
        measuring._read(one)
        assert verdict.word(other) == NOT_CHECKED
    finally:
        handlers.remove(measuring._note_changes)
