# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooth in Tolerance: the promise on the stored mesh, every option, and bad input."""

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh import mesh_io
from addon.mesh.mesh_io import column
from addon.operators import motion
from addon.proof import verdict
from addon.reference import measurements
from scenes import add_object, dissolve, sheet, torus, world_triangles

PLACED = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.7, 4, (1, 2, 3)) @ Matrix.Diagonal((1, 2, 0.5, 1))


def coordinates(ob):
    return column(ob.data.vertices, "co", 3)


def smoothed(make=torus, **options):
    """Smooths a new object and returns the positions of its vertices."""
    ob = make()
    assert bpy.ops.tolvol.smooth(**options) == {"FINISHED"}
    return coordinates(ob)


def roughness(ob):
    """Returns the mean angle between the normals of neighbouring faces."""
    mesh = ob.data
    normals = column(mesh.polygons, "normal", 3)
    edges = column(mesh.loops, "edge_index", 1, np.int32)
    order = np.argsort(edges, kind="stable")
    one, two = (
        np.repeat(np.arange(len(mesh.polygons)), column(mesh.polygons, "loop_total", 1, np.int32))[order]
        .reshape(-1, 2)
        .T
    )
    return np.arccos((normals[one] * normals[two]).sum(1).clip(-1, 1)).mean()


@pytest.mark.parametrize("matrix", [Matrix(), PLACED], ids=["local", "placed"])
def test_stays_within_the_tolerance_in_the_world(matrix):
    ob = torus(matrix=matrix, noise=0.02)
    reference, rough = world_triangles(ob), roughness(ob)
    tolerance = 0.01 * native.module.diagonal(
        coordinates(ob), reference[1], to_world=mesh_io.matrix_array(ob.matrix_world)
    )
    bpy.ops.tolvol.smooth(iterations=20, method="LAPLACIAN")
    stored = world_triangles(ob)
    judged = native.module.hausdorff(*stored, *reference, bound=tolerance)
    assert 0.9 * tolerance < judged.upper <= tolerance
    assert roughness(ob) < 0.8 * rough
    measured = measurements.measurement_of(ob)
    assert verdict.of(ob).kind == verdict.WITHIN
    assert judged.forward.lower <= measured.forward and judged.backward.lower <= measured.backward
    assert np.array_equal(mesh_io.read_mesh(ob.tolvol.snapshot).triangles, reference[1])
    assert ob.tolvol.smooth.iterations == 20 and ob.tolvol.smooth.method == "LAPLACIAN"


def test_every_setting_counts_and_those_not_given_are_the_objects_own():
    plain = smoothed()
    for options in ({"iterations": 3}, {"method": "LAPLACIAN"}, {"weights": "UNIFORM"}):
        assert not np.array_equal(smoothed(**options), plain)
    ob = torus()
    ob.tolvol.smooth.iterations = 3
    bpy.ops.tolvol.smooth()
    assert np.array_equal(coordinates(ob), smoothed(iterations=3))


def test_one_way_smooths_farther():
    def kept(keep):
        ob = torus(noise=0.02)
        ob.tolvol.tolerance_percent, ob.tolvol.keep = 0.5, keep
        reference = world_triangles(ob)
        tolerance = 0.005 * native.module.diagonal(*reference)
        bpy.ops.tolvol.smooth(iterations=20, method="LAPLACIAN")
        judged = native.module.hausdorff(*world_triangles(ob), *reference, bound=tolerance)
        assert judged.forward.upper <= tolerance
        return judged.backward.lower > tolerance

    assert kept("ONE") and not kept("BOTH")


def test_boundary_stays_or_is_smoothed_along_itself():
    before = coordinates(sheet(bumps=0.2))
    rim = (np.abs(before[:, :2]) == 1).any(1)
    fixed = smoothed(lambda: sheet(bumps=0.2))
    assert np.array_equal(fixed[rim], before[rim]) and not np.array_equal(fixed, before)
    assert not np.array_equal(smoothed(lambda: sheet(bumps=0.2), boundary="ALONG")[rim], before[rim])


def test_vertex_group_is_the_strength():
    def half():
        ob = torus(noise=0.01)
        ob.tolvol.crossings = "ALLOW"  # Single vertices would be held back.
        group = ob.vertex_groups.new(name="half")
        group.add(np.flatnonzero(coordinates(ob)[:, 0] > 0).tolist(), 0.5, "REPLACE")
        return ob

    before = coordinates(half())
    right = before[:, 0] > 0
    whole, weak = smoothed(half, iterations=1), smoothed(half, iterations=1, vertex_group="half")
    assert np.array_equal(weak[~right], before[~right])
    far = before[:, 0] > 0.2
    assert np.abs((weak - before)[far] - 0.5 * (whole - before)[far]).max() < 1e-5
    inverted = smoothed(half, iterations=1, vertex_group="half", invert_vertex_group=True)
    left = before[:, 0] < -0.2
    assert np.abs(inverted - whole)[left].max() < 1e-6 and np.abs(inverted - weak)[far].max() < 1e-6


def test_bent_quads_stay_within_however_they_are_cut():
    ob = torus(around=32, across=16, noise=0.02)
    reference, faces = world_triangles(ob), [list(face.vertices) for face in ob.data.polygons]
    tolerance = 0.01 * native.module.diagonal(*reference)
    bpy.ops.tolvol.smooth(iterations=20, method="LAPLACIAN")
    vertices = world_triangles(ob)[0]
    inside = np.ones(len(faces), bool)
    for corners in ([0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]):
        cut = np.array(faces, np.int32)[:, corners]
        before = [
            native.module.directed_hausdorff(reference[0], face[None], *reference).upper <= tolerance for face in cut
        ]
        inside &= before
    assert inside.sum() > 0.8 * len(faces)  # Quads that were outside in the other triangulation stay as they are.
    for corners in ([0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]):
        cut = np.array(faces, np.int32)[inside][:, corners]
        assert native.module.directed_hausdorff(vertices, cut, *reference, bound=tolerance).upper <= tolerance


@pytest.mark.parametrize("noise, ngons", [(0.15, False), (0.1, True)], ids=["quads", "n-gons"])
def test_polygons_that_blender_would_cut_otherwise_beyond_the_tolerance_stay(noise, ngons, monkeypatch):
    def bent():
        ob = torus(around=24, across=12, noise=noise, seed=6)
        if ngons:
            dissolve(ob, np.random.default_rng(1), 0.25)
        ob.tolvol.tolerance_percent = 3
        return ob

    monkeypatch.setattr(motion, "_MOST_TRIES", 1)
    bent()
    with pytest.raises(RuntimeError, match="Not proved"):
        bpy.ops.tolvol.smooth(method="LAPLACIAN")
    monkeypatch.undo()
    ob = bent()
    reference = world_triangles(ob)
    bpy.ops.tolvol.smooth(method="LAPLACIAN")
    stored = world_triangles(ob)
    tolerance = 0.03 * native.module.diagonal(*reference)
    assert native.module.hausdorff(*stored, *reference, bound=tolerance).upper <= tolerance
    assert (stored[0] != reference[0]).any(1).mean() > 0.1
    assert len(native.module.crossing_pairs(*stored)) <= len(native.module.crossing_pairs(*reference))


def test_loose_edges_stay_attached():
    ob = add_object(
        "spike",
        [(0, 0, 0), (1, 0, 0), (1, 1, 0.3), (0, 1, 0), (0.5, 0.5, 0.2)],
        [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
    )
    ob.tolvol.tolerance_percent = 20
    bpy.ops.tolvol.smooth()
    assert coordinates(ob)[4, 2] != np.float32(0.2)
    ob = add_object(
        "spike",
        [(0, 0, 0), (1, 0, 0), (1, 1, 0.3), (0, 1, 0), (0.5, 0.5, 0.2), (0.5, 0.5, 1)],
        [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
    )
    ob.data.edges.add(1)
    ob.data.edges[-1].vertices = (4, 5)
    ob.data.update()
    ob.tolvol.tolerance_percent = 20
    with pytest.raises(RuntimeError, match="does not move any vertex of spike"):
        bpy.ops.tolvol.smooth()


def test_shape_keys_keep_their_motion_and_one_undo_step_restores_everything():
    ob = torus()
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="up")
    for point in key.data:
        point.co.z += 0.25
    bpy.ops.ed.undo_push(message="start")
    before = coordinates(ob)
    bpy.ops.tolvol.smooth("EXEC_DEFAULT", True)
    ob = bpy.data.objects["torus"]
    after = coordinates(ob)
    assert not np.array_equal(after, before)
    basis, up = (column(block.data, "co", 3) for block in ob.data.shape_keys.key_blocks)
    assert np.array_equal(basis, after) and np.abs(up - basis - [0, 0, 0.25]).max() < 1e-6
    bpy.ops.ed.undo()
    ob = bpy.data.objects["torus"]
    assert np.array_equal(coordinates(ob), before) and ob.tolvol.snapshot is None


def in_edit_mode(make, select):
    """Returns a new object in Edit Mode with the vertices selected for which select(coordinates) is true."""
    ob = make()
    bpy.ops.object.mode_set(mode="EDIT")
    chosen = select(coordinates(ob))
    edited = bmesh.from_edit_mesh(ob.data)
    for vertex, choose in zip(edited.verts, chosen):
        vertex.select_set(bool(choose))
    bmesh.update_edit_mesh(ob.data)
    return ob, chosen


def stored(ob):
    """Returns the coordinates in Edit Mode."""
    ob.update_from_editmode()
    return coordinates(ob)


def test_in_edit_mode_the_selected_vertices_are_smoothed_in_one_undo_step():
    ob, chosen = in_edit_mode(lambda: torus(noise=0.02), lambda co: co[:, 0] > 0)
    bpy.ops.ed.undo_push(message="selected")
    reference, before = world_triangles(ob), coordinates(ob)
    tolerance = 0.01 * native.module.diagonal(*reference)
    assert bpy.ops.tolvol.smooth("EXEC_DEFAULT", True, iterations=20, method="LAPLACIAN") == {"FINISHED"}
    assert ob.mode == "EDIT"
    after = stored(ob)
    assert np.array_equal(after[~chosen], before[~chosen])
    assert (after != before).any(1)[chosen].mean() > 0.85
    judged = native.module.hausdorff(*world_triangles(ob), *reference, bound=tolerance)
    assert 0.9 * tolerance < judged.upper <= tolerance
    assert [vertex.select for vertex in bmesh.from_edit_mesh(ob.data).verts] == chosen.tolist()
    bpy.ops.ed.undo()
    ob = bpy.data.objects["torus"]
    assert ob.mode == "EDIT" and np.array_equal(stored(ob), before)
    bpy.ops.ed.redo()
    ob = bpy.data.objects["torus"]
    assert np.array_equal(stored(ob), after)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(coordinates(ob), after)
    assert verdict.of(ob).kind == verdict.WITHIN


def test_in_edit_mode_what_is_not_yet_in_the_mesh_counts():
    ob, _ = in_edit_mode(lambda: torus(noise=0.02), lambda co: co[:, 0] > 0)
    for vertex in bmesh.from_edit_mesh(ob.data).verts:
        vertex.co.z += 5
    bpy.ops.tolvol.smooth()
    assert stored(ob)[:, 2].min() > 4
    assert column(ob.tolvol.snapshot.vertices, "co", 3)[:, 2].min() > 4


def test_shape_keys_follow_what_edit_mode_smooths():
    def keyed():
        ob = torus(noise=0.02)
        ob.shape_key_add(name="Basis")
        for point in ob.shape_key_add(name="up").data:
            point.co.z += 0.25
        ob.active_shape_key_index = 0
        return ob

    ob, _ = in_edit_mode(keyed, lambda co: co[:, 0] > 0)
    before = coordinates(ob)
    bpy.ops.tolvol.smooth()
    bpy.ops.object.mode_set(mode="OBJECT")
    basis, up = (column(block.data, "co", 3) for block in ob.data.shape_keys.key_blocks)
    assert not np.array_equal(basis, before) and np.array_equal(basis, coordinates(ob))
    assert np.abs(up - basis - [0, 0, 0.25]).max() < 1e-6
    ob.active_shape_key_index = 1
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="the base mesh of torus: choose the shape key Basis first"):
        bpy.ops.tolvol.smooth()


def edited_together(select, *objects):
    """Takes the objects into Edit Mode. The first one is active. select: the selected vertices of each object."""
    for ob in objects:
        ob.select_set(True)
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.mode_set(mode="EDIT")
    for ob, chosen in zip(objects, select):
        edited = bmesh.from_edit_mesh(ob.data)
        for vertex in edited.verts:
            vertex.select_set(chosen)
        bmesh.update_edit_mesh(ob.data)


def test_in_edit_mode_all_edited_meshes_with_a_selection_are_smoothed(capfd):
    objects = [torus(name, noise=0.02, around=24, across=12) for name in ("one", "two", "three")]
    objects[1].tolvol.tolerance_percent = 0.4
    before, references = [coordinates(ob) for ob in objects], [world_triangles(ob) for ob in objects]
    edited_together((True, True, False), *objects)
    assert bpy.ops.tolvol.smooth(iterations=20, method="LAPLACIAN") == {"FINISHED"}
    after = [stored(ob) for ob in objects]
    count = sum((now != then).any(1).sum() for now, then in zip(after, before))
    said = capfd.readouterr().out.splitlines()
    assert [line for line in said if line][-1] == f"Info: 2 objects: {count:,} of 576 vertices moved, 2 of 2 PASS"
    assert [(now != then).any() for now, then in zip(after, before)] == [True, True, False]
    for ob, reference, percent in zip(objects[:2], references, (1, 0.4)):  # Each object has a tolerance of its own.
        tolerance = percent / 100 * native.module.diagonal(*reference)
        judged = native.module.hausdorff(*world_triangles(ob), *reference, bound=tolerance)
        assert 0.5 * tolerance < judged.upper <= tolerance
        assert ob.tolvol.snapshot is not None and ob.tolvol.smooth.iterations == 20
    assert objects[2].tolvol.snapshot is None


def test_in_edit_mode_one_mesh_that_is_refused_leaves_all_as_they_were():
    objects = [torus("one", noise=0.02), torus("two", noise=0.02)]
    bpy.ops.tolvol.set_reference()
    objects[1].data.vertices[5].co.z += 1
    before = [coordinates(ob) for ob in objects]
    edited_together((True, True), *objects)
    with pytest.raises(RuntimeError, match="two: .*faces are not within the tolerance"):
        bpy.ops.tolvol.smooth()
    assert all(np.array_equal(stored(ob), then) for ob, then in zip(objects, before))
    edited_together((False, False), *objects)
    with pytest.raises(RuntimeError, match="No vertex of one, two is selected"):
        bpy.ops.tolvol.smooth()


def test_in_edit_mode_nothing_selected_is_refused():
    ob, _ = in_edit_mode(torus, lambda co: co[:, 0] > 9)
    before = coordinates(ob)
    with pytest.raises(RuntimeError, match="No vertex of torus is selected"):
        bpy.ops.tolvol.smooth()
    assert np.array_equal(stored(ob), before)
    bpy.ops.object.mode_set(mode="SCULPT")
    assert not bpy.ops.tolvol.smooth.poll()


def test_what_is_outside_is_refused():
    ob = torus()
    bpy.ops.tolvol.set_reference()
    ob.data.vertices[5].co.z += 1
    before = coordinates(ob)
    with pytest.raises(RuntimeError, match="faces are not within the tolerance"):
        bpy.ops.tolvol.smooth()
    with pytest.raises(RuntimeError, match="torus has no vertex group none"):
        bpy.ops.tolvol.smooth(vertex_group="none")
    assert np.array_equal(coordinates(ob), before)
