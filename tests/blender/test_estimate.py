# SPDX-License-Identifier: GPL-3.0-or-later
"""The estimated number of triangles. In a window panels ask for it and Blender's timer runs the work; here the tests do."""

import json
import time

import bpy
import numpy as np
import pytest

from addon import estimate, job, native
from addon.background import queue
from addon.estimate import known, runs
from addon.mesh import mesh_io
from scenes import activate, add_object, sheet, sheet_arrays, torus


@pytest.fixture(autouse=True)
def _nothing_left(monkeypatch):
    monkeypatch.setattr(runs, "_REST", 0.0)
    yield
    queue.stop()
    known.forget()


def drawn(until=None):
    """Draws the panel and runs what it asks for, until nothing is asked for. Returns the last answer.

    until: ends it earlier, as soon as the answer is such.
    """
    end = time.monotonic() + 300
    while True:
        answer = estimate.shown(bpy.context)
        if until and until(answer) or not queue._waiting and queue._running is None:
            return answer
        queue._tick()
        assert time.monotonic() < end
        time.sleep(0.001)


def is_known(answer):
    return isinstance(answer, estimate.Estimate)


def decimated(ob, **options):
    """Returns the number of triangles that Decimate leaves, and takes it back."""
    before = ob.data.copy()
    assert bpy.ops.tolvol.decimate(**options) == {"FINISHED"}
    count = len(ob.data.polygons)
    ob.data, ob.tolvol.last_run = before, ""
    bpy.ops.tolvol.clear_reference()
    return count


def ball(subdivisions):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=subdivisions)
    return bpy.context.object


def cylinders():
    """Boxes with rods of several sizes on them, as in CAD."""
    bpy.ops.mesh.primitive_cube_add()
    for i, radius in enumerate((0.5, 0.2, 0.08, 0.03)):
        bpy.ops.mesh.primitive_cylinder_add(vertices=48, radius=radius, depth=0.6, location=(0.5 * i - 0.7, 0.2, 1.3))
    for ob in bpy.data.objects:
        ob.select_set(True)
    bpy.ops.object.join()
    return bpy.context.object


def noise():
    vertices, quads = sheet_arrays(count=20, bumps=0.05)
    vertices[:, 2] += np.random.default_rng(4).normal(0, 0.004, len(vertices)).astype(np.float32)
    return add_object("noise", vertices, quads)


MODELS = {
    "small ball": lambda: ball(2),
    "ball": lambda: ball(4),
    "torus": lambda: torus(around=24, across=12, noise=0.0),
    "rough torus": lambda: torus(around=24, across=12),
    "sheet": lambda: sheet(count=14),
    "flat": lambda: sheet(count=16, bumps=0.0),
    "CAD": cylinders,
    "noise": noise,
}


@pytest.mark.parametrize("model", MODELS)
def test_within_15_percent_of_the_run_at_rest_and_while_the_tolerance_is_dragged(model):
    ob = MODELS[model]()
    rested, dragged = {}, {}
    for percent in (0.2, 1.3):
        ob.tolvol.tolerance_percent = percent
        rested[percent] = drawn()
    for percent in np.geomspace(0.0567, 4.1, 7).tolist():
        ob.tolvol.tolerance_percent = percent
        dragged[percent] = estimate.shown(bpy.context)
        queue.stop()  # There is no time for the work that is asked for now.
    triangles = sum(len(face.vertices) - 2 for face in ob.data.polygons)
    missed = []
    for percent, answer in (rested | dragged).items():
        ob.tolvol.tolerance_percent = percent
        count = decimated(ob)
        assert answer.before == triangles and not answer.known
        if percent in rested:
            assert answer.after == pytest.approx(count, rel=0.15)
        # Where only some tens of triangles are left, their number falls by steps.
        assert abs(answer.after - count) <= max(0.15 * count, 6), (percent, count, answer)
        missed.append(abs(answer.after / count - 1) > 0.15)
    assert sum(missed) <= 1


def test_the_first_answer_comes_before_a_click_and_the_real_number_after_it():
    ob = torus()
    ob.tolvol.property_unset("percent_choice")
    assert ob.tolvol.tolerance_percent == pytest.approx(0.2)
    assert estimate.shown(bpy.context) == "Estimating"
    first = drawn(until=is_known)
    assert first.before == 2304
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    count = len(ob.data.polygons)
    assert estimate.shown(bpy.context) == estimate.Estimate(2304, count, True) and not queue._waiting
    assert first.after == count
    ob.tolvol.tolerance_percent = 1  # What Decimate would leave now.
    assert drawn(until=is_known).before == count


def test_thorough_and_stop_at():
    ob = torus()
    fast = drawn(until=is_known).after
    ob.tolvol.effort = "THOROUGH"
    thorough = estimate.shown(bpy.context).after
    assert thorough < 0.75 * fast
    ob.tolvol.target_triangles, ob.tolvol.use_target = 1500, True
    assert estimate.shown(bpy.context).after == 1500
    ob.tolvol.target_triangles = 10
    assert estimate.shown(bpy.context).after == thorough
    ob.tolvol.use_target = False
    assert thorough == pytest.approx(decimated(ob), rel=0.15)


def settle(change):
    """Returns the numbers at 1 % before and after change(ob)."""
    ob = torus()
    before = drawn(until=is_known).after
    change(ob)
    assert not is_known(estimate.shown(bpy.context)), "the estimate is of another state"
    return before, drawn(until=is_known).after


def protect_faces(ob):
    ob.tolvol.only_selected = True
    for face in ob.data.polygons:
        face.select = face.center.x > 0


def paint(ob):
    ob.vertex_groups.new(name="still").add(range(0, len(ob.data.vertices), 2), 1.0, "REPLACE")
    ob.tolvol.vertex_group, ob.tolvol.invert_vertex_group = "still", True


def reach_farther(ob):
    reference = torus("reference", noise=0.008, seed=3)
    activate(ob)
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", reference


CHANGES = {
    "unselected faces": protect_faces,
    "weights": paint,
    "placement": lambda ob: setattr(ob.tolvol, "placement", "SUBSET"),
    "normals": lambda ob: setattr(ob.tolvol, "max_normal_angle", 0.2),
    "the reference": reach_farther,
    "the shape in the world": lambda ob: setattr(ob, "scale", (1, 1, 5)) or bpy.context.view_layer.update(),
    "the mesh": lambda ob: setattr(ob, "data", sheet().data.copy()) or activate(ob),
}


@pytest.mark.parametrize("change", CHANGES)
def test_the_estimate_is_of_the_present_state(change):
    before, after = settle(CHANGES[change])
    assert before != after
    ob = bpy.context.object
    ob.tolvol.last_run = ""
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and len(ob.data.polygons) == after


def test_closed_holes_are_counted():
    vertices, quads = sheet_arrays()
    ob = add_object("holes", vertices, np.delete(quads, (100, 430, 777), axis=0))
    ob.tolvol.close_holes, ob.tolvol.tolerance_percent = True, 2
    after = drawn(until=is_known).after
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and len(ob.data.polygons) == after
    assert json.loads(ob.tolvol.last_run)["holes"]["closed"] == 3


def test_moving_and_turning_the_object_keeps_the_estimate():
    ob = torus()
    before = drawn(until=is_known)
    ob.location, ob.rotation_euler = (3, 1, 0), (1, 0.4, 0)
    bpy.context.view_layer.update()
    assert estimate.shown(bpy.context) == before


def test_several_objects_are_estimated_together():
    one, other = torus(), sheet()
    one.select_set(True)
    answer = drawn(until=is_known)
    assert answer.before == 2304 + 1800
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    assert answer.after == len(one.data.polygons) + len(other.data.polygons)
    assert estimate.shown(bpy.context) == estimate.Estimate(answer.before, answer.after, True)


def test_a_tolerance_that_float32_cannot_hold_is_refused_although_nearly_all_triangles_stay():
    ob = torus()
    ob.data.vertices.foreach_set("co", mesh_io.column(ob.data.vertices, "co", 3).ravel() + np.float32(100))
    ob.data.update()
    ob.tolvol.tolerance_percent = 0.01
    assert drawn().after > 0.9 * 2304
    ob.tolvol.tolerance_percent = 1e-5
    assert drawn() == "No result at this tolerance"


def test_what_is_refused_is_said(monkeypatch):
    ob = sheet(bumps=0.0)
    bpy.ops.tolvol.set_reference()
    ob.data.vertices[0].co.z += 0.1
    ob.data.update()
    assert drawn() == "No result at this tolerance"
    ob.tolvol.tolerance_percent = 20
    assert is_known(drawn(until=is_known))
    ob.tolvol.vertex_group = "nowhere"
    assert drawn() == ""
    monkeypatch.setattr(runs, "MOST_TRIANGLES", 1000)
    assert estimate.shown(bpy.context) == "Too large to estimate"
    bpy.ops.object.mode_set(mode="EDIT")
    assert estimate.shown(bpy.context) == "Decimate needs Object Mode" and not queue._waiting


def under_way():
    """Returns the job of a decimation that runs for the estimate of a large mesh."""
    ball(7)
    estimate.shown(bpy.context)
    while queue._running is None:
        queue._tick()
    return queue._running[2]


def dragged(_):
    bpy.context.object.tolvol.tolerance_percent = 0.7
    estimate.shown(bpy.context)


def edited(_):
    bpy.context.object.data.vertices[0].co.z += 0.1
    bpy.context.object.data.update_tag()
    bpy.context.view_layer.update()


def another_setting(_):
    bpy.context.object.tolvol.keep = "ONE"
    estimate.shown(bpy.context)


def other_work(_):
    queue.later(("urgent",), 0, lambda: None, None)
    queue._tick()


ENDS = {
    "the tolerance is dragged": dragged,
    "the mesh changes": edited,
    "a setting changes": another_setting,
    "the mode changes": lambda _: bpy.ops.object.mode_set(mode="EDIT") and estimate.shown(bpy.context),
    "a file is opened": lambda _: bpy.ops.wm.read_factory_settings(use_empty=True),
    "something more urgent waits": other_work,
    "a step is undone": lambda _: [handler() for handler in bpy.app.handlers.undo_pre],
    "an operator is at work": lambda patch: (
        patch.setattr(job, "under_way", lambda: True) or estimate.shown(bpy.context)
    ),
}


@pytest.mark.parametrize("happens", ENDS)
def test_the_work_ends_when(happens, monkeypatch):
    work = under_way()
    assert not work.progress.cancelled
    ENDS[happens](monkeypatch)
    assert work.progress.cancelled
    with pytest.raises(native.module.Cancelled):  # The work has not gone on to its end.
        work.outcome()


def test_nothing_runs_while_an_animation_plays_or_the_panel_is_not_drawn(monkeypatch):
    torus()
    drawn(until=is_known)
    end = time.monotonic() + 60
    while queue._waiting or queue._running is not None:
        queue._tick()
        assert time.monotonic() < end
    assert queue._running is None and not queue._waiting


def test_without_memory_nothing_more_is_tried(monkeypatch):
    torus()

    def none_left(*_):
        raise MemoryError

    monkeypatch.setattr(runs.volumes, "passing_volume", none_left)
    assert drawn() == "Too large to estimate" and not queue._waiting


def test_a_mesh_without_extent_along_an_axis():
    ob = torus()
    for _ in range(2):
        ob.scale.z = 0
        bpy.context.view_layer.update()
        assert estimate.shown(bpy.context) == "" and not queue._waiting
        with pytest.raises(RuntimeError, match="torus has no extent along an axis: Object > Clear > Scale"):
            bpy.ops.tolvol.decimate()
        ob.scale.z = 1
        bpy.context.view_layer.update()
        bpy.ops.tolvol.set_reference()
