# SPDX-License-Identifier: GPL-3.0-or-later
"""The guards of edited meshes and of lattices without a window, as test_guard.py tests that of sculpting."""

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import guard, native
from addon.mesh import mesh_io
from addon.proof import verdict
from addon.shared.surface import to_world
from scenes import activate, add_object, sheet, sheet_arrays
from test_guard import PLACED, TOLERANCE, coordinates, guarded, judged, state, updated

# Editing ------------------------------------------------------------------------------------------------------------


def edit(ob, move):
    edited = bmesh.from_edit_mesh(ob.data)
    for vertex in edited.verts:
        vertex.co = move(vertex.co)
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
    ob.update_from_editmode()
    return coordinates(ob)


def test_what_is_moved_in_edit_mode_stops_at_the_tolerance():
    ob = sheet(count=20, matrix=PLACED)
    reference = guarded(ob, "editing", mode="EDIT")
    edit(ob, lambda co: (co.x, co.y, co.z + 3 * (co.x > 0.5)))
    lower, upper = judged(ob, reference)
    assert 0.95 < lower and upper <= 1
    assert state(ob)["editing"][1]
    ob.tolvol.guard.editing = False
    edit(ob, lambda co: (co.x, co.y, co.z + 3 * (co.x > 0.5)))
    assert judged(ob, reference)[0] > 1


def test_a_wish_that_redo_brings_back_ends_where_it_did():
    """Stores the undo step before the guard corrects the mesh, as Blender does for an operator."""
    ob = sheet(count=20)
    reference = guarded(ob, "editing", mode="EDIT")
    start = coordinates(ob)
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.translate(value=(0, 0.001, 0.3))
    bpy.ops.ed.undo_push(message="move")
    bpy.context.view_layer.update()
    ob.update_from_editmode()
    held = coordinates(ob)
    assert judged(ob, reference)[1] <= 1 and not np.array_equal(held, start)
    for step, expected in ((bpy.ops.ed.undo, start), (bpy.ops.ed.redo, held)):
        step()
        ob = bpy.data.objects["sheet"]
        updated(ob)
        ob.update_from_editmode()
        assert np.array_equal(coordinates(ob), expected)


def test_new_faces_that_are_inside_are_guarded_on():
    ob = sheet(count=10, bumps=0.0)
    reference = guarded(ob, "editing", mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=1)
    bpy.context.view_layer.update()
    assert state(ob)["editing"] == ("Guarding both ways", True)
    assert len(edit(ob, lambda co: (co.x, co.y, 1))) == 441
    lower, upper = judged(ob, reference)
    assert 0.95 < lower and upper <= 1


@pytest.mark.parametrize("height", (0.3, 3.0))
def test_extruded_faces_rise_as_far_as_the_tolerance_permits(height):
    ob = sheet(count=10, bumps=0.0)
    reference = guarded(ob, "editing", mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    edited = bmesh.from_edit_mesh(ob.data)
    for face in edited.faces:
        face.select_set(max(map(abs, face.calc_center_median()[:2])) < 0.2)
    bpy.ops.mesh.extrude_region()
    bpy.context.view_layer.update()
    edited = bmesh.from_edit_mesh(ob.data)
    rising = [vertex.index for vertex in edited.verts if vertex.select]
    for vertex in edited.verts:
        vertex.co.z += height * TOLERANCE * vertex.select
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
    ob.update_from_editmode()
    at = coordinates(ob)[rising, 2] / TOLERANCE
    assert len(rising) == 9 and at.min() > 0.95 * min(height, 1) and at.max() < 1.001 * min(height, 1)
    assert judged(ob, reference)[1] <= 1 and state(ob)["editing"][1]


def remove_faces(ob, chosen, kind="FACE"):
    """Deletes or dissolves the faces for whose middle chosen() is true, as a user does in Edit Mode."""
    edited = bmesh.from_edit_mesh(ob.data)
    bpy.ops.mesh.select_mode(type="FACE")
    for face in edited.faces:
        face.select = chosen(face.calc_center_median())
    bmesh.update_edit_mesh(ob.data)
    if kind == "DISSOLVE":
        bpy.ops.mesh.dissolve_faces()
    else:
        bpy.ops.mesh.delete(type=kind)
    bpy.context.view_layer.update()


def in_the_middle(co):
    return max(abs(co.x), abs(co.y)) < 0.25


@pytest.mark.parametrize("many_corners", (False, True))
@pytest.mark.parametrize("keep", ("BOTH", "ONE"))
def test_a_hole_is_put_back_unless_one_way_is_asked_for(keep, many_corners):
    ob = sheet(count=20, bumps=0.0)
    ob.tolvol.keep = keep
    guarded(ob, "editing", mode="EDIT")
    if many_corners:
        remove_faces(ob, lambda co: co.x < -0.7, "DISSOLVE")
        assert max(len(face.vertices) for face in ob.data.polygons) > 4
        assert guard.edit.outside() is None and state(ob)["editing"][1], "nothing was lost"
    remove_faces(ob, in_the_middle)
    if keep == "ONE":
        assert guard.edit.outside() is None and state(ob)["editing"][1]
        return
    assert guard.edit.outside() == ob
    text, on = state(ob)["editing"]
    assert not on and text.endswith("faces of the reference are no longer within the tolerance of the mesh")


_THROUGH = (
    (0.02, 0.03, -0.005),
    (0.07, 0.03, -0.005),
    (0.05, 0.04, 0.005),
)  # the corners of a triangle through the sheet


@pytest.mark.parametrize("keeps_out", (False, True))
def test_an_edit_of_faces_that_makes_faces_cross_is_put_back_if_crossings_are_kept_out(keeps_out):
    ob = sheet(count=10, bumps=0.0)
    ob.tolvol.guard.crossings = keeps_out
    guarded(ob, "editing", mode="EDIT")
    edited = bmesh.from_edit_mesh(ob.data)
    edited.faces.new([edited.verts.new(co) for co in _THROUGH])
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
    text, on = state(ob)["editing"]
    if not keeps_out:
        assert on and guard.edit.outside() is None
        return
    assert not on and text == "Crossing pairs of faces: 1, before the edit 0"
    assert guard.edit.outside() == ob
    # A further edit does not make it right.
    remove_faces(ob, lambda co: co.x > 0.9 and co.y > 0.9, "DISSOLVE")
    assert guard.edit.outside() == ob and state(ob)["editing"][0] == text


def test_what_crosses_is_counted_just_before_the_edit():
    ob = sheet(count=10, bumps=0.0)
    edited = bmesh.new()
    edited.from_mesh(ob.data)
    edited.faces.new([edited.verts.new(co) for co in _THROUGH])
    edited.to_mesh(ob.data)
    edited.free()
    ob.tolvol.guard.crossings = True
    guarded(ob, "editing", mode="EDIT")
    edited = bmesh.from_edit_mesh(ob.data)
    edited.verts.ensure_lookup_table()
    edited.verts[-1].co.z = -0.005  # Now no faces cross.
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
    assert state(ob)["editing"][1]
    edited = bmesh.from_edit_mesh(ob.data)
    edited.faces.new([edited.verts.new(np.add(co, (0.4, 0.4, 0))) for co in _THROUGH])
    bmesh.update_edit_mesh(ob.data)
    bpy.context.view_layer.update()
    assert state(ob)["editing"] == ("Crossing pairs of faces: 1, before the edit 0", False)


@pytest.mark.parametrize("keep", ("BOTH", "ONE"))
def test_a_mesh_of_which_all_faces_were_deleted_is_put_back(keep):
    ob = sheet(count=10, bumps=0.0)
    ob.tolvol.keep = keep
    guarded(ob, "editing", mode="EDIT")
    remove_faces(ob, lambda _: True, "ONLY_FACE")
    assert not ob.data.polygons and state(ob)["editing"] == ("sheet has no faces", False)
    assert guard.edit.outside() == (ob if keep == "BOTH" else None)
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.delete(type="VERT")
    bpy.context.view_layer.update()
    assert guard.edit.outside() == (ob if keep == "BOTH" else None)


def test_a_hole_that_was_there_before_the_guard_stays_and_grows_no_larger():
    ob = sheet(count=20, bumps=0.0)
    guarded(ob, mode="EDIT")
    remove_faces(ob, in_the_middle)
    ob.tolvol.guard.editing = True
    updated(ob)
    assert state(ob)["editing"][1]
    remove_faces(ob, lambda co: co.x < -0.7, "DISSOLVE")
    assert guard.edit.outside() is None and state(ob)["editing"][1]
    remove_faces(ob, lambda co: co.y > 0.7)
    assert guard.edit.outside() == ob


# Lattices -----------------------------------------------------------------------------------------------------------


def caged(ob, name="cage"):
    data = bpy.data.lattices.new(name)
    data.points_u = data.points_v = 3
    lattice = bpy.data.objects.new(name, data)
    lattice.matrix_world = ob.matrix_world @ Matrix.Diagonal((1, 1, 0.5, 1))
    bpy.context.collection.objects.link(lattice)
    ob.modifiers.new(name, "LATTICE").object = lattice
    bpy.context.view_layer.update()
    return lattice


def lift(lattice, height):
    points = mesh_io.column(lattice.data.points, "co_deform", 3)
    points[4, 2] += height
    points[13, 2] += height
    place(lattice, points)


def place(lattice, points):
    lattice.data.points.foreach_set("co_deform", points.ravel())
    lattice.data.update_tag()
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()  # Blender evaluates the points that the guard wrote without calling a handler.


def deformed(ob):
    """Returns the (vertices, triangles) of the evaluated mesh in the world."""
    surface = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    arrays = mesh_io.read_mesh(surface)
    return to_world(arrays.vertices, mesh_io.matrix_array(ob.matrix_world)), arrays.triangles


def evaluated(ob, reference):
    found = native.module.directed_hausdorff(*deformed(ob), *reference, bound=TOLERANCE)
    return found.lower / TOLERANCE, found.upper / TOLERANCE


def test_the_lattice_guard_does_not_say_that_a_mesh_with_a_hole_is_within():
    ob = sheet(count=20)
    guarded(ob, mode="OBJECT")
    edited = bmesh.new()
    edited.from_mesh(ob.data)
    bmesh.ops.delete(edited, geom=edited.faces[100:200], context="FACES")
    edited.to_mesh(ob.data)
    edited.free()
    caged(ob)
    ob.tolvol.guard.lattice = True
    updated(ob)
    assert bpy.ops.tolvol.check() == {"FINISHED"} and verdict.word(ob) == verdict.FAIL
    said, on = state(ob)["lattice"]
    assert on and said.endswith("faces of the reference are beyond the tolerance")
    ob.tolvol.keep = "ONE"
    assert verdict.word(ob) == verdict.PASS and verdict.of(ob).ways.startswith("one way")


@pytest.mark.parametrize("matrix", [Matrix(), PLACED], ids=["local", "placed"])
def test_the_points_of_a_lattice_stop_at_the_tolerance(matrix):
    ob = sheet(count=20, matrix=matrix)
    lattice = caged(ob)
    reference = guarded(ob, "lattice", mode="OBJECT")
    before = coordinates(ob)
    lift(lattice, 0.02)
    assert mesh_io.column(lattice.data.points, "co_deform", 3)[4, 2] == np.float32(-0.5) + np.float32(0.02)
    for _ in range(3):
        lift(lattice, 0.7)
        assert evaluated(ob, reference)[1] <= 1
    assert evaluated(ob, reference)[0] > 0.9
    assert state(ob)["lattice"] == ("The lattice was stopped at the tolerance", True)
    assert np.array_equal(coordinates(ob), before)
    ob.tolvol.guard.lattice = False
    lift(lattice, 0.7)
    assert evaluated(ob, reference)[0] > 1


@pytest.mark.parametrize("keep", ["BOTH", "ONE"])
def test_a_lattice_that_draws_the_border_in_stops_only_where_both_ways_are_kept(keep):
    """All that the mesh loses is the part of the reference beside it: in the plane it stays on the reference."""
    ob = sheet(count=20, bumps=0.0)
    ob.tolvol.keep = keep
    lattice = caged(ob)
    reference = guarded(ob, "lattice", mode="OBJECT")
    points = mesh_io.column(lattice.data.points, "co_deform", 3)
    for _ in range(3):
        points[:, 0] *= 0.7
        place(lattice, points)
    backward = native.module.directed_hausdorff(*reference, *deformed(ob), bound=TOLERANCE)
    if keep == "BOTH":
        assert 0.9 * TOLERANCE < backward.lower and backward.upper <= TOLERANCE
        assert state(ob)["lattice"] == ("The lattice was stopped at the tolerance", True)
    else:
        assert backward.lower > 5 * TOLERANCE
        assert state(ob)["lattice"] == ("Guarding one way", True)


@pytest.mark.parametrize("crossings_out", [True, False])
def test_a_lattice_that_exchanges_two_sheets_stops_only_where_crossings_are_kept_out(crossings_out):
    vertices, quads = sheet_arrays(count=20, bumps=0.0)
    above, below = vertices + np.float32([0, 0, 0.01]), vertices - np.float32([0, 0, 0.01])
    ob = add_object("sheets", np.concatenate([below, above]), np.concatenate([quads, quads + len(vertices)]))
    activate(ob)
    lattice = caged(ob)
    lattice.data.interpolation_type_w = "KEY_LINEAR"
    bpy.context.view_layer.update()
    ob.tolvol.guard.crossings = crossings_out
    guarded(ob, "lattice", mode="OBJECT")
    points = mesh_io.column(lattice.data.points, "co_deform", 3)
    points[4, 2] += 3
    points[13, 2] -= 3
    place(lattice, points)
    crossing = len(native.module.crossing_pairs(*deformed(ob)))
    assert (crossing == 0) == crossings_out
    said = "The lattice was stopped where faces would cross" if crossings_out else "Guarding both ways"
    assert state(ob)["lattice"] == (said, True)


def test_a_lattice_may_not_exchange_crossings_for_others():
    """Of two crossing sheets one is moved aside: as many pairs cross as before, and others."""
    vertices, quads = sheet_arrays(count=20, bumps=0.0)
    upright = 0.4 * vertices[:, [0, 2, 1]] + np.float32([0, 0.013, 0])
    ob = add_object("sheets", np.concatenate([vertices, upright]), np.concatenate([quads, quads + len(vertices)]))
    activate(ob)
    ob.vertex_groups.new(name="upright").add(range(len(vertices), 2 * len(vertices)), 1.0, "REPLACE")
    lattice = caged(ob)
    ob.modifiers[0].vertex_group = "upright"
    bpy.context.view_layer.update()
    ob.tolvol.guard.crossings = True
    guarded(ob, "lattice", mode="OBJECT", tolerance=0.2)
    points = mesh_io.column(lattice.data.points, "co_deform", 3)
    before = len(native.module.crossing_pairs(*deformed(ob)))
    assert before > 10
    points[:, 1] += 0.1  # across a row of quads
    place(lattice, points)
    assert state(ob)["lattice"] == ("The lattice was stopped where faces would cross", True)
    ob.tolvol.guard.crossings = False
    updated(ob)
    place(lattice, points)
    assert len(native.module.crossing_pairs(*deformed(ob))) == before and state(ob)["lattice"][1]


def test_a_lattice_that_shrinks_the_mesh_to_a_point_stops_too():
    """A mesh that is smaller than the tolerance is no reference, so that nothing could be covered by it."""
    ob = sheet(count=20, bumps=0.0)
    lattice = caged(ob)
    lattice.scale = (2, 2, 2)  # around all of the sheet
    lattice.data.interpolation_type_u = lattice.data.interpolation_type_v = "KEY_LINEAR"
    bpy.context.view_layer.update()
    reference = guarded(ob, "lattice", mode="OBJECT")
    place(lattice, 1e-4 * mesh_io.column(lattice.data.points, "co_deform", 3))
    backward = native.module.directed_hausdorff(*reference, *deformed(ob), bound=TOLERANCE)
    assert backward.upper <= TOLERANCE
    assert state(ob)["lattice"] == ("The lattice was stopped at the tolerance", True)


def test_what_is_not_the_points_doing_is_said_and_left():
    ob = sheet(count=10)
    lattice = caged(ob)
    reference = guarded(ob, "lattice", mode="OBJECT")
    points = mesh_io.column(lattice.data.points, "co_deform", 3)
    ob.modifiers.new("displace", "DISPLACE").strength = 0.5
    bpy.context.view_layer.update()
    assert state(ob)["lattice"] == ("100 faces of the deformed mesh are outside", False)
    assert np.array_equal(mesh_io.column(lattice.data.points, "co_deform", 3), points)
    ob.modifiers.remove(ob.modifiers["displace"])
    bpy.context.view_layer.update()
    lift(lattice, 1)
    assert evaluated(ob, reference)[1] <= 1 and state(ob)["lattice"][1]


def test_a_wished_lattice_that_redo_brings_back_ends_where_it_did():
    ob = sheet(count=10)
    lattice = caged(ob)
    guarded(ob, "lattice", mode="OBJECT")
    start = mesh_io.column(lattice.data.points, "co_deform", 3)
    wish = start.copy()
    wish[:, 2] += 0.3
    bpy.ops.ed.undo_push(message="start")
    lattice.data.points.foreach_set("co_deform", wish.ravel())
    bpy.ops.ed.undo_push(message="move")
    lattice.data.update_tag()
    bpy.context.view_layer.update()
    held = mesh_io.column(lattice.data.points, "co_deform", 3)
    assert not np.array_equal(held, wish) and not np.array_equal(held, start)
    for step, expected in ((bpy.ops.ed.undo, start), (bpy.ops.ed.redo, held)):
        step()
        lattice = bpy.data.objects["cage"]
        lattice.data.update_tag()
        bpy.context.view_layer.update()
        assert np.array_equal(mesh_io.column(lattice.data.points, "co_deform", 3), expected)
