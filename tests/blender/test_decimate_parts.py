# SPDX-License-Identifier: GPL-3.0-or-later
"""Protected parts of a decimation, several objects in one step, and effort."""

import json

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh import mesh_io, transfer
from addon.mesh.mesh_io import column
from addon.shared.proof import report
from scenes import activate, sheet, torus, world_triangles

PERCENT = 1.0


def tolerance_of(reference, percent=PERCENT):
    return percent / 100 * native.module.diagonal(*reference)


def decimate(ob, percent=PERCENT, **options):
    """Decimates, judges the stored mesh both ways, and returns the number of triangles left."""
    reference = world_triangles(ob)
    assert bpy.ops.tolvol.decimate(tolerance_percent=percent, **options) == {"FINISHED"}
    stored = world_triangles(ob)
    tolerance = tolerance_of(reference, percent)
    for pair in ((stored, reference), (reference, stored)):
        assert native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance).upper <= tolerance
    return len(stored[1])


def refused(match, **options):
    before = {ob.name: column(ob.data.vertices, "co", 3).tobytes() for ob in bpy.data.objects}
    with pytest.raises(RuntimeError, match=match):
        bpy.ops.tolvol.decimate(tolerance_percent=PERCENT, **options)
    assert before == {ob.name: column(ob.data.vertices, "co", 3).tobytes() for ob in bpy.data.objects}


def lines(mesh, edges):
    """The edges of a mesh as pairs of stored positions."""
    vertices = column(mesh.vertices, "co", 3)
    return {
        frozenset(vertices[end].tobytes() for end in ends)
        for ends in column(mesh.edges, "vertices", 2, np.int32)[edges]
    }


# Effort -------------------------------------------------------------------------------------------------------------


def test_thorough_leaves_fewer_and_says_so():
    fast = decimate(torus("one"), 2)
    ob = torus("two")
    assert decimate(ob, 2, effort="THOROUGH") < fast
    assert json.loads(ob.tolvol.last_run)["effort"] == "thorough" and ob.tolvol.effort == "THOROUGH"
    assert ob.tolvol.last_run_of


@pytest.mark.parametrize("effort", ["FAST", "THOROUGH"])
def test_a_decimation_stops_at_its_time_limit(effort):
    whole = decimate(torus("one"), 2, effort=effort)
    ob = torus("two")
    assert decimate(ob, 2, effort=effort, max_seconds=1e-6) > whole
    run = json.loads(ob.tolvol.last_run)
    assert run["stopped_by"] == "time" and "(stopped at the time limit)" in report.counts(run)


def test_faces_whose_edges_were_flipped_keep_what_they_are(monkeypatch):
    seen = []
    enter = transfer.Writing.__enter__
    monkeypatch.setattr(transfer.Writing, "__enter__", lambda self: seen.append(self._result) or enter(self))
    ob = torus()
    mesh = ob.data
    own = np.arange(len(mesh.polygons), dtype=np.int32)
    mesh.attributes.new("own", "INT", "FACE").data.foreach_set("value", own)
    mesh.attributes.new("corner", "INT", "CORNER").data.foreach_set("value", np.repeat(own, 4))
    for i in range(3):
        mesh.materials.append(bpy.data.materials.new(str(i)))
    mesh.polygons.foreach_set("material_index", own % 3)
    mesh.polygons.foreach_set("use_smooth", own % 2 == 0)
    decimate(ob, percent=1, effort="THOROUGH")
    assert seen[0].turned.sum() > 10
    own = column(mesh.attributes["own"].data, "value", 1, np.int32)
    assert len(np.unique(own)) > 50
    assert np.array_equal(column(mesh.polygons, "material_index", 1, np.int32), own % 3)
    assert np.array_equal(column(mesh.polygons, "use_smooth", 1, bool), own % 2 == 0)
    assert np.array_equal(column(mesh.attributes["corner"].data, "value", 1, np.int32), np.repeat(own, 3))


@pytest.mark.parametrize("placement", ["OPTIMAL", "SUBSET"])
def test_corners_of_flipped_faces_read_where_they_lie(placement):
    ob = sheet(bumps=0.2)
    mesh = ob.data
    corners = column(mesh.loops, "vertex_index", 1, np.int32)
    flat = column(mesh.vertices, "co", 3)[corners, :2]
    mesh.uv_layers.new().data.foreach_set("uv", flat.ravel())
    colours = np.hstack([flat, flat]) / 4 + 0.5
    mesh.color_attributes.new("colour", "FLOAT_COLOR", "CORNER").data.foreach_set("color", colours.ravel())
    tolerance = tolerance_of(world_triangles(ob))
    decimate(ob, effort="THOROUGH", placement=placement)
    corners = column(mesh.loops, "vertex_index", 1, np.int32)
    flat = column(mesh.vertices, "co", 3)[corners, :2]
    assert np.abs(mesh_io.corner_uvs(mesh) - flat).max() < 2 * tolerance
    read = column(mesh.color_attributes["colour"].data, "color", 4)
    assert np.abs((read[:, :2] - 0.5) * 4 - flat).max() < 2 * tolerance


# Protected ----------------------------------------------------------------------------------------------------------


def marked(kind):
    """Returns a mesh with edges of one kind, and these edges."""
    ob = sheet(count=16, bumps=0.1) if kind == "BOUNDARY" else torus(around=30, across=15)
    mesh = ob.data
    ends = column(mesh.edges, "vertices", 2, np.int32)
    ring = np.isin(ends // 15, (7, 20)).all(1) & (ends[:, 0] // 15 == ends[:, 1] // 15)
    sides = np.isin(np.arange(len(mesh.polygons)) // 15, range(7, 20))
    if kind == "BOUNDARY":
        ring = np.bincount(column(mesh.loops, "edge_index", 1, np.int32)) == 1
    elif kind in {"SHARP", "SEAM"}:
        mesh.edges.foreach_set({"SHARP": "use_edge_sharp", "SEAM": "use_seam"}[kind], ring)
    elif kind == "CREASE":
        if bpy.app.version < (4, 0):
            mesh.edges.foreach_set("crease", ring.astype(np.float32))
        else:
            mesh.attributes.new("crease_edge", "FLOAT", "EDGE").data.foreach_set("value", ring.astype(np.float32))
    elif kind == "MATERIAL":
        for name in "ab":
            mesh.materials.append(bpy.data.materials.new(name))
        mesh.polygons.foreach_set("material_index", sides.astype(np.int32))
    elif kind == "UV":
        corners = column(mesh.loops, "vertex_index", 1, np.int32)
        uvs = column(mesh.vertices, "co", 3)[corners, :2] + 5 * np.repeat(sides, 4)[:, None]
        mesh.uv_layers.new().data.foreach_set("uv", uvs.astype(np.float32).ravel())
    return ob, ring


@pytest.mark.parametrize(
    ("kind", "effort"),
    [
        ("BOUNDARY", "FAST"),
        ("SHARP", "FAST"),
        ("SEAM", "FAST"),
        ("CREASE", "FAST"),
        ("MATERIAL", "THOROUGH"),
        ("UV", "FAST"),
    ],
)
def test_protected_edges_stay_bit_for_bit(kind, effort):
    left = {}
    for protect in (set(), {kind}):
        ob, ring = marked(kind)
        before = lines(ob.data, ring)
        assert len(before) >= 30
        left[bool(protect)] = decimate(ob, protect=protect, effort=effort)
        kept = before <= lines(ob.data, np.ones(len(ob.data.edges), bool))
        assert kept == bool(protect)
        if protect and kind == "MATERIAL":
            x, y = np.array([face.center[:2] for face in ob.data.polygons]).T
            between = np.arctan2(y, x) % (2 * np.pi) * 30 / (2 * np.pi)
            inside = column(ob.data.polygons, "material_index", 1, np.int32) == 1
            # A face whose corners are all on a border has its centre within a hundredth of a square of the border.
            beside = (np.abs(between - 7) > 0.01) & (np.abs(between - 20) > 0.01)
            assert beside.mean() > 0.95
            assert (inside == ((between > 7) & (between < 20)))[beside].all()
    assert left[False] < left[True] < len(ob.data.polygons) * 4


def test_vertices_on_a_symmetry_plane_stay():
    for axis, column_of in (("X", 0), ("Y", 1)):
        for symmetry in (set(), {axis}):
            ob = torus(around=32, across=12, noise=0)
            coordinates = column(ob.data.vertices, "co", 3)
            on = {row.tobytes() for row in coordinates[np.abs(coordinates[:, column_of]) < 1e-6]}
            assert len(on) == 24
            decimate(ob, symmetry=symmetry)
            left = {row.tobytes() for row in column(ob.data.vertices, "co", 3)}
            assert (on <= left) == bool(symmetry)


def test_only_selected_faces_change():
    ob = torus()
    mesh = ob.data
    centers = np.array([face.center.x for face in mesh.polygons])
    mesh.polygons.foreach_set("select", centers > 0.1)

    def stored(of):
        vertices = column(mesh.vertices, "co", 3)
        _, triangles = world_triangles(ob)
        return {frozenset(vertices[v].tobytes() for v in triangle) for triangle in triangles[of]}

    arrays = mesh_io.read_mesh(mesh)
    unselected = stored((centers <= 0.1)[arrays.polygons])
    left = decimate(ob, only_selected=True, effort="THOROUGH")
    assert unselected <= stored(slice(None))
    assert len(unselected) < left < len(unselected) + 300
    assert ob.tolvol.only_selected

    mesh.polygons.foreach_set("select", np.zeros(len(mesh.polygons), bool))
    refused("No face of torus is selected")


def test_weights_are_shares_of_the_tolerance():
    left = []
    for weight, invert in ((1.0, False), (0.25, False), (0.75, True), (0.0, False)):
        ob = torus()
        reference = world_triangles(ob)
        x = column(ob.data.vertices, "co", 3)[:, 0]
        group = ob.vertex_groups.new(name="room")
        group.add(np.flatnonzero(x > 0).tolist(), 0.0 if invert else 1.0, "REPLACE")
        group.add(np.flatnonzero(x <= 0).tolist(), weight, "REPLACE")
        before = {v.tobytes() for v in column(ob.data.vertices, "co", 3)[x <= 0]}
        left.append(decimate(ob, vertex_group="room", invert_vertex_group=invert))
        vertices, triangles = world_triangles(ob)
        there = triangles[(vertices[triangles, 0] < -0.1).all(1)]
        judged = native.module.directed_hausdorff(vertices, there, *reference)
        if weight == 0:
            assert before <= {v.tobytes() for v in column(ob.data.vertices, "co", 3)}
        elif weight < 1:
            assert judged.upper <= 0.25 * tolerance_of(reference)
        else:
            assert judged.lower > 0.5 * tolerance_of(reference)
    assert left[0] < left[1] == left[2] < left[3]
    ob = sheet(bumps=0.0)  # On a flat sheet all vertices that are not protected could vanish.
    ob.vertex_groups.new(name="room").add(range(100), 1.0, "REPLACE")
    before = {v.tobytes() for v in column(ob.data.vertices, "co", 3)[100:]}
    assert decimate(ob, vertex_group="room") < 1800
    assert before <= {v.tobytes() for v in column(ob.data.vertices, "co", 3)}
    activate(bpy.data.objects["torus"])
    refused("torus.* has no vertex group none", vertex_group="none")


# Several objects ----------------------------------------------------------------------------------------------------


def three():
    objects = [torus("a"), torus("b", Matrix.Scale(3, 4), seed=2), sheet("c", bumps=0.2)]
    for ob in objects:
        ob.select_set(True)
    return objects


def test_all_selected_meshes_in_one_step():
    objects = three()
    alone = torus("not selected")
    alone.select_set(False)
    bpy.context.view_layer.objects.active = objects[0]
    for ob in objects:
        ob.select_set(True)
    references = [world_triangles(ob) for ob in objects]
    bpy.ops.ed.undo_push(message="start")
    assert bpy.ops.tolvol.decimate("EXEC_DEFAULT", True, tolerance_percent=PERCENT) == {"FINISHED"}
    objects = [bpy.data.objects[name] for name in "abc"]
    for ob, reference in zip(objects, references):
        stored, tolerance = world_triangles(ob), tolerance_of(reference)
        assert len(stored[1]) < len(reference[1]) / 4
        assert native.module.directed_hausdorff(*stored, *reference, bound=tolerance).upper <= tolerance
        assert native.module.directed_hausdorff(*reference, *stored, bound=tolerance).upper <= tolerance
        run = json.loads(ob.tolvol.last_run)
        assert run["tolerance"]["absolute"] == pytest.approx(tolerance, rel=1e-6)
        assert run["output"]["triangles"] == len(stored[1])
        assert np.array_equal(mesh_io.read_mesh(ob.tolvol.snapshot).triangles, reference[1])
    assert bpy.data.objects["not selected"].tolvol.snapshot is None
    bpy.ops.ed.undo()
    for name, reference in zip("abc", references):
        ob = bpy.data.objects[name]
        assert np.array_equal(world_triangles(ob)[0], reference[0]) and ob.tolvol.snapshot is None


def placements(objects):
    return [json.loads(ob.tolvol.last_run)["placement"] for ob in objects]


def test_a_placement_that_nobody_chose_is_that_of_each_mesh():
    objects = three()
    objects[1].data.uv_layers.new()
    activate(objects[0])
    for ob in objects:
        ob.select_set(True)
    bpy.ops.tolvol.decimate()
    assert placements(objects) == ["optimal", "subset", "optimal"]
    assert [ob.tolvol.placement_choice for ob in objects] == [-1, -1, -1]
    # A placement that was chosen is used for all objects, whether it was chosen on the active object or for this run.
    for choose in ("object", "run"):
        for ob in objects:
            ob.tolvol.placement_choice = -1
        if choose == "object":
            objects[0].tolvol.placement = "OPTIMAL"
        bpy.ops.tolvol.decimate(**({"placement": "OPTIMAL"} if choose == "run" else {}))
        assert placements(objects) == ["optimal"] * 3
        assert [ob.tolvol.placement for ob in objects] == ["OPTIMAL"] * 3


def test_a_placement_chosen_in_adjust_last_operation_holds_for_all():
    objects = three()
    objects[1].data.uv_layers.new()
    bpy.ops.tolvol.decimate("EXEC_DEFAULT", True)
    adjusted = bpy.context.window_manager.operators[-1].properties
    assert adjusted.own_placements
    adjusted.placement = adjusted.placement
    assert not adjusted.own_placements


def test_one_that_cannot_be_done_leaves_all_as_they_are(monkeypatch):
    objects = three()
    other = bpy.data.objects.new("user", objects[1].data)
    bpy.context.collection.objects.link(other)
    refused("b: 2 users share the mesh b:")
    bpy.data.objects.remove(other)

    enter = transfer.Writing.__enter__

    def fails(self):
        if self._mesh.name == "b":
            raise transfer.MeshMismatch("a test says so")
        return enter(self)

    monkeypatch.setattr(transfer.Writing, "__enter__", fails)
    refused("a test says so")
    assert not any(ob.tolvol.snapshot for ob in objects)

    objects[1].tolvol.tolerance_percent = PERCENT
    activate(objects[1])
    monkeypatch.undo()
    bpy.ops.tolvol.set_reference()
    objects[1].data.vertices[0].co.z += 1
    for ob in objects:
        ob.select_set(True)
    refused("b: .* faces are not within the tolerance")
