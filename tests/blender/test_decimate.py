# SPDX-License-Identifier: GPL-3.0-or-later
"""The promise on the stored mesh: both directions are within the tolerance in the world."""

import json
import math

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh import mesh_io
from addon.panels import notes
from addon.proof import verdict
from addon.reference import snapshots, tolerances
from addon.shared import volumes
from scenes import activate, assert_within, link, sampled_distance, sheet, torus, world_triangles

PERCENT = 1.0


def tolerance_of(reference):
    """Computes 1 % of the size independently: of the longest of the four diagonals of the local box, mapped to the world."""
    return PERCENT / 100 * native.module.diagonal(*reference)


def shear():
    return Matrix(((1, 0.7, 0, 0), (0, 1, 0, 0), (0, -0.4, 1, 0), (0, 0, 0, 1)))


MATRICES = {
    "identity": Matrix.Identity(4),
    "non-uniform scale": Matrix.Diagonal((0.2, 1.0, 3.0, 1.0)),
    "shear": shear(),
    "negative scale": Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0)),
    "turned, scaled and moved": Matrix.Translation((5, -3, 2))
    @ Matrix.Rotation(0.8, 4, (1, 2, 3))
    @ Matrix.Scale(40, 4),
    "tiny": Matrix.Scale(1e-4, 4),
    "far away": Matrix.Translation((1000, 2000, -500)),
}


def longest_diagonal(ob):
    low, high = (np.array([v.co for v in ob.data.vertices]).__getattribute__(end)(0) for end in ("min", "max"))
    edges = np.diag(high - low)
    matrix = np.array(ob.matrix_world)[:3, :3]
    return max(np.linalg.norm(matrix @ (edges[0] + s * edges[1] + t * edges[2])) for s in (1, -1) for t in (1, -1))


@pytest.mark.parametrize("placement", ["OPTIMAL", "SUBSET"])
@pytest.mark.parametrize("name", MATRICES)
def test_stays_within_tolerance_in_the_world(name, placement):
    ob = torus(matrix=MATRICES[name])
    reference, size = world_triangles(ob), longest_diagonal(ob)
    count = len(reference[1])
    assert bpy.ops.tolvol.decimate(tolerance_percent=PERCENT, placement=placement) == {"FINISHED"}
    run = json.loads(ob.tolvol.last_run)
    tolerance = PERCENT / 100 * size
    assert run["tolerance"]["absolute"] == pytest.approx(tolerance, rel=1e-6)
    stored = world_triangles(ob)
    assert len(stored[1]) == run["output"]["triangles"] < count / 4
    assert_within(stored, reference, tolerance)
    for way, pair in (("forward", (stored, reference)), ("backward", (reference, stored))):
        judged = native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance)
        assert judged.upper <= tolerance * (1 + 1e-6)
        assert run[way][0] <= judged.upper and judged.lower <= run[way][1] <= run["tolerance"]["absolute"]


def test_parented_object_is_measured_in_the_world():
    parent = link(bpy.data.objects.new("parent", None))
    parent.rotation_euler, parent.scale = (0.3, 0.5, 0.2), (1, 4, 0.5)
    ob = torus()
    ob.parent = parent
    ob.rotation_euler = (0.7, 0.1, 0)  # Under a scaled parent this rotation makes a shear.
    activate(ob)
    reference, size = world_triangles(ob), longest_diagonal(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=PERCENT)
    assert len(ob.data.polygons) < 600
    assert_within(world_triangles(ob), reference, PERCENT / 100 * size)


def test_scale_changes_the_result_only_by_the_scale():
    counts = []
    for scale in (1, 8):
        ob = torus(matrix=Matrix.Scale(scale, 4))
        bpy.ops.tolvol.decimate(tolerance_percent=PERCENT)
        counts.append(len(ob.data.polygons))
    assert counts[0] == counts[1]


def test_tolerance_as_a_length():
    ob = torus(matrix=Matrix.Scale(10, 4))
    reference = world_triangles(ob)
    bpy.ops.tolvol.decimate(tolerance_length=0.15)
    run = json.loads(ob.tolvol.last_run)
    assert run["tolerance"]["absolute"] == 0.15  # what was typed, not its float32
    assert (ob.tolvol.tolerance_mode, round(ob.tolvol.tolerance_length, 6)) == ("LENGTH", 0.15)
    assert_within(world_triangles(ob), reference, 0.15)


def test_larger_tolerance_leaves_fewer_triangles():
    counts = []
    for percent in (0.3, 1.0, 3.0):
        ob = torus()
        bpy.ops.tolvol.decimate(tolerance_percent=percent)
        counts.append(len(ob.data.polygons))
    assert counts[0] > counts[1] > counts[2]


def test_one_way_lets_the_reference_vanish_and_says_so():
    # On a plate stands a thin needle. Only its tip is far from the surface of the plate.
    results = {}
    for keep in ("BOTH", "ONE"):
        ob = sheet(f"sheet {keep}", bumps=0.0)
        centre = len(ob.data.vertices) // 2
        ob.data.vertices[centre].co.z = 0.2
        ob.data.update()
        reference = world_triangles(ob)
        bpy.ops.tolvol.decimate(tolerance_length=0.05, keep=keep)
        results[keep] = world_triangles(ob), reference, json.loads(ob.tolvol.last_run)
    both, reference, run = results["BOTH"]
    assert_within(both, reference, 0.05)
    one, reference, run = results["ONE"]
    assert run["two_sided"] is False
    assert sampled_distance(one, reference) <= 0.05 + 1e-6
    assert run["forward"][1] <= 0.05
    # The report has both intervals, and the judge agrees with the one of the direction that was not promised.
    judged = native.module.directed_hausdorff(*reference, *one)
    assert judged.lower <= run["backward"][1] and run["backward"][0] <= judged.upper


def test_target_stops_early_and_a_target_out_of_reach_is_said(capfd):
    ob = torus()
    bpy.ops.tolvol.decimate(tolerance_percent=PERCENT, target_triangles=900)
    run = json.loads(ob.tolvol.last_run)
    assert 850 <= len(ob.data.polygons) <= 900 and run["stopped_by"] == "target"
    bpy.ops.tolvol.decimate(tolerance_percent=PERCENT, target_triangles=10)
    run = json.loads(ob.tolvol.last_run)
    assert len(ob.data.polygons) > 10 and run["stopped_by"] == "tolerance"


def test_decimating_twice_does_not_drift():
    ob = torus()
    original = world_triangles(ob)
    tolerance = tolerance_of(original)
    for _ in range(4):
        bpy.ops.tolvol.decimate(tolerance_percent=PERCENT)
        assert_within(world_triangles(ob), original, tolerance)
    assert len(ob.tolvol.snapshot.polygons) == len(original[1])


def test_saved_and_reopened(tmp_path):
    matrix = MATRICES["turned, scaled and moved"] @ shear()
    ob = torus(matrix=matrix)
    original = world_triangles(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=0.2)
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    decimated = world_triangles(ob)
    bpy.ops.wm.open_mainfile(filepath=path)
    ob = bpy.context.active_object
    again = world_triangles(ob)
    assert np.array_equal(again[0], decimated[0]) and np.array_equal(again[1], decimated[1])
    assert np.array_equal(mesh_io.read_mesh(ob.tolvol.snapshot).triangles, original[1])
    assert json.loads(ob.tolvol.last_run)["output"]["triangles"] == len(again[1])
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    assert verdict.of(ob).forward_within and verdict.of(ob).backward_within
    bpy.ops.tolvol.decimate(tolerance_percent=PERCENT)
    assert len(ob.data.polygons) < len(again[1])
    assert_within(world_triangles(ob), original, tolerance_of(original))


def test_another_objects_reference():
    scan = torus("scan")
    reference = world_triangles(scan)
    tolerance = 0.04
    model = torus("model", seed=2, around=64, across=32)
    model.tolvol.reference_kind, model.tolvol.reference_object = "OBJECT", scan
    bpy.ops.tolvol.decimate(tolerance_length=tolerance)
    assert len(model.data.polygons) < 600
    assert_within(world_triangles(model), reference, tolerance)
    # The scan may be removed: the reference is the snapshot, at the place where the scan was.
    bpy.data.objects.remove(scan)
    bpy.ops.tolvol.check()
    assert verdict.of(model).forward_within
    model.location.x += 0.5
    bpy.ops.tolvol.check()
    assert not verdict.of(model).forward_within
    assert model.tolvol.measurement.forward == pytest.approx(0.5, abs=0.1)


def test_input_outside_the_reference():
    scan = torus("scan", noise=0)
    model = torus("model", noise=0, around=64, across=32)
    model.data.vertices[100].co *= 1.2
    model.data.update()
    before = world_triangles(model)
    model.tolvol.reference_kind, model.tolvol.reference_object = "OBJECT", scan
    with pytest.raises(RuntimeError, match=r"faces are not within the tolerance.*first is face"):
        bpy.ops.tolvol.decimate(tolerance_length=0.02)
    assert np.array_equal(world_triangles(model)[0], before[0]) and not model.tolvol.last_run
    bpy.ops.tolvol.decimate(tolerance_length=0.02, outside="KEEP")
    run = json.loads(model.tolvol.last_run)
    stored = world_triangles(model)
    assert run["outside"]["faces"] > 0 and len(stored[1]) < len(before[1]) / 2
    # The vertex that sticks out stays with all its faces. All other faces have to be within the tolerance.
    spike = np.flatnonzero((stored[0] == before[0][100]).all(1))
    assert len(spike) == 1
    around = (stored[1] == spike[0]).any(1)
    assert around.sum() == 6
    assert run["outside"]["rest"][1] <= 0.02 < run["forward"][1]
    far = [
        t
        for t in stored[1]
        if native.module.directed_hausdorff(stored[0], t[None], *world_triangles(scan), bound=0.02).lower > 0.02
    ]
    assert len(far) <= run["outside"]["faces"]


def test_hits_the_same_result_for_any_number_of_threads():
    results = []
    for threads in (1, 2, 3):
        ob = torus()
        bpy.ops.tolvol.decimate(tolerance_percent=PERCENT, threads=threads)
        results.append(world_triangles(ob))
    for other in results[1:]:
        assert np.array_equal(results[0][0], other[0]) and np.array_equal(results[0][1], other[1])


def test_the_button_is_greyed_while_one_of_the_selected_meshes_cannot_be_decimated():
    ob, other = torus(), sheet()
    other.modifiers.new("levels", "MULTIRES")
    activate(ob)
    assert bpy.ops.tolvol.decimate.poll()
    other.select_set(True)
    assert not bpy.ops.tolvol.decimate.poll()
    with pytest.raises(RuntimeError, match="sheet: Apply the Multiresolution modifier first"):
        bpy.ops.tolvol.decimate()
    assert ("sheet: Apply the Multiresolution modifier first", "ERROR") in notes.notes(bpy.context, ob)[0]


def test_more_than_float32_can_hold_is_refused():
    ob = torus()
    for vertex in ob.data.vertices:
        vertex.co.x += 1e6
    ob.data.update()
    before = world_triangles(ob)
    with pytest.raises(RuntimeError, match="which are rounded: take at least"):
        bpy.ops.tolvol.decimate(tolerance_length=0.01)
    assert np.array_equal(world_triangles(ob)[0], before[0])


def test_not_finite_coordinates_are_refused():
    ob = torus()
    ob.data.vertices[12].co.y = math.nan
    ob.data.update()
    with pytest.raises(RuntimeError, match="12.*finite"):
        bpy.ops.tolvol.decimate(tolerance_percent=PERCENT)


def test_tolerance_larger_than_the_reference_is_refused():
    ob = torus()
    with pytest.raises(RuntimeError, match="tolerance"):
        bpy.ops.tolvol.decimate(tolerance_length=100)
    assert len(ob.data.polygons) == 48 * 24 and ob.tolvol.snapshot is None


def test_volume_is_built_once_for_equal_content():
    ob = torus()
    bpy.ops.tolvol.set_reference()
    reference = snapshots.reference_of(ob)
    tolerance = tolerances.tolerance_length(ob.tolvol, reference.size())
    first = volumes.native_volume(reference, tolerance)
    assert volumes.native_volume(snapshots.reference_of(ob), tolerance) is first
    assert volumes.native_volume(reference, tolerance * 1.5) is not first
    ob.rotation_euler.x = 0.3
    bpy.context.view_layer.update()
    assert volumes.native_volume(snapshots.reference_of(ob), tolerance) is not first
