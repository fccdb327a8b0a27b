# SPDX-License-Identifier: GPL-3.0-or-later
"""The guards without a window: scripts move vertices like a brush, a transform or a lattice. tests/ui has real brushes."""

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import guard, native
from addon.mesh import mesh_io
from addon.proof import verdict
from addon.shared.surface import to_world
from scenes import activate, add_object, plates_with_t_junctions, sheet, sheet_arrays, world_triangles

TOLERANCE = 0.02
PLACED = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.7, 4, (1, 2, 3)) @ Matrix.Diagonal((1, -2, 0.5, 1))


def guarded(ob, *kinds, tolerance=TOLERANCE, mode="SCULPT"):
    """Makes the mesh its own reference, in this mode. Returns its (vertices, triangles) in the world."""
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", tolerance
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    reference = world_triangles(ob)
    for kind in kinds:
        setattr(ob.tolvol.guard, kind, True)
    bpy.ops.object.mode_set(mode=mode)
    updated(ob)
    return reference


def updated(ob):
    """Updates the scene as Blender does after each dab."""
    ob.update_tag()
    bpy.context.view_layer.update()


def coordinates(ob):
    return mesh_io.column(guard.watch.points_of(ob), "co", 3)


def dab(ob, positions):
    guard.watch.points_of(ob).foreach_set("co", positions.astype(np.float32).ravel())
    updated(ob)
    return coordinates(ob)


def judged(ob, reference, tolerance=TOLERANCE, measure=native.module.hausdorff):
    """Returns (lower, upper) of the distance of mesh and reference, in tolerances, in Blender's triangulation."""
    scratch = ob.data.copy()
    scratch.vertices.foreach_set("co", coordinates(ob).ravel())
    arrays = mesh_io.read_mesh(scratch)
    bpy.data.meshes.remove(scratch)
    vertices = to_world(arrays.vertices, mesh_io.matrix_array(ob.matrix_world))
    found = measure(vertices, arrays.triangles, *reference, bound=tolerance)
    return found.lower / tolerance, found.upper / tolerance


def state(ob):
    return {kind: (text, on) for kind, text, on in guard.states(ob)}


def bump(ob, height, radius=0.3):
    """Returns the coordinates with a hill in the middle."""
    wish = coordinates(ob)
    wish[:, 2] += height * np.clip(1 - np.hypot(wish[:, 0], wish[:, 1]) / radius, 0, None)
    return wish


# Sculpting ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("height", [0.05, 3.0])
def test_a_stroke_far_outwards_stops_at_the_tolerance_and_touches_nothing_else(height):
    ob = sheet(count=60, bumps=0.0)
    reference = guarded(ob, "sculpting")
    before = coordinates(ob)
    wish = bump(ob, height)
    after = dab(ob, wish)
    lower, upper = judged(ob, reference)
    assert 0.95 < lower and upper <= 1
    untouched = (wish == before).all(1)
    assert untouched.any() and np.array_equal(after[untouched], before[untouched])
    inside = wish[:, 2] < 0.3 * TOLERANCE
    assert np.array_equal(after[inside], wish[inside])
    held = int((after != wish).any(1).sum())
    assert state(ob) == {"sculpting": (f"Held back {held:,} vertices", True)}


def test_switched_off_it_holds_nothing_back():
    ob = sheet(count=20, bumps=0.0)
    guarded(ob, "sculpting")
    ob.tolvol.guard.sculpting = False
    wish = bump(ob, 1)
    assert np.array_equal(dab(ob, wish), wish) and not state(ob)


@pytest.mark.parametrize("kind", ["editing", "lattice"])
def test_each_switch_is_for_its_own_mode(kind):
    ob = sheet(count=20, bumps=0.0)
    guarded(ob, kind)
    wish = bump(ob, 1)
    assert np.array_equal(dab(ob, wish), wish)


def test_stroke_upon_stroke_in_the_world():
    ob = sheet(count=40, matrix=PLACED)
    reference = guarded(ob, "sculpting")
    rng = np.random.default_rng(3)
    for _ in range(8):
        dab(ob, bump(ob, rng.uniform(-0.2, 0.2), rng.uniform(0.2, 0.9)))
        assert judged(ob, reference)[1] <= 1
    assert judged(ob, reference)[0] > 0.95


def test_undo_and_redo_bring_back_every_bit():
    ob = sheet(count=30)
    guarded(ob, "sculpting")
    states = [coordinates(ob)]
    bpy.ops.ed.undo_push(message="start")
    for height in (0.1, -0.3):
        states.append(dab(ob, bump(ob, height)))
        bpy.ops.ed.undo_push(message="stroke")
    for step, expected in ((bpy.ops.ed.undo, 1), (bpy.ops.ed.undo, 0), (bpy.ops.ed.redo, 1), (bpy.ops.ed.redo, 2)):
        step()
        ob = bpy.data.objects["sheet"]
        updated(ob)
        assert np.array_equal(coordinates(ob), states[expected])
    assert state(ob)["sculpting"][1]


def test_the_active_shape_key_is_guarded():
    ob = sheet(count=30)
    ob.shape_key_add(name="Basis")
    up = ob.shape_key_add(name="up")
    reference = guarded(ob, "sculpting")
    ob.active_shape_key_index = 1
    updated(ob)
    basis = mesh_io.column(ob.data.vertices, "co", 3)
    dab(ob, bump(ob, 1))
    lower, upper = judged(ob, reference)
    assert 0.95 < lower and upper <= 1
    assert np.array_equal(mesh_io.column(ob.data.vertices, "co", 3), basis)
    ob.active_shape_key_index = 0
    updated(ob)
    other, wish = mesh_io.column(up.data, "co", 3), bump(ob, -1)
    after = dab(ob, wish)
    assert judged(ob, reference)[1] <= 1
    assert np.array_equal(mesh_io.column(ob.data.vertices, "co", 3), after)
    # A brush moves the other shape keys along with the Basis. They have to go back along with it.
    assert np.abs(mesh_io.column(up.data, "co", 3) - (other + after - wish)).max() < 1e-6


def test_faces_of_many_corners_stay_however_blender_cuts_them():
    around = np.arange(12) * np.pi / 6
    vertices = [(np.cos(a), np.sin(a), 0) for a in around]
    ob = add_object("disc", vertices, [range(12)])
    reference = guarded(ob, "sculpting")
    said = "faces may turn over: 1 face has more than four corners. Triangulate Faces helps"
    assert state(ob)["sculpting"] == (f"One way only, {said}", True)
    # What is not kept is said with every choice of what shall be kept.
    for keep, crossings, lost in (
        ("BOTH", True, "One way only, crossings allowed, "),
        ("ONE", True, "Crossings allowed, "),
        ("ONE", False, ""),
    ):
        ob.tolvol.keep, ob.tolvol.guard.crossings = keep, crossings
        dab(ob, coordinates(ob))
        text = lost + said
        assert state(ob)["sculpting"] == (text[0].upper() + text[1:], True)
    rng = np.random.default_rng(5)
    for _ in range(10):
        dab(ob, coordinates(ob) + rng.normal(0, 0.03, (12, 3)))
        assert judged(ob, reference, measure=native.module.directed_hausdorff)[1] <= 1


def needle():
    """A thin pyramid. Its tip may slide down inside of it without leaving the tolerance."""
    feet = [(0.03, 0, 0), (-0.02, 0.03, 0), (-0.02, -0.03, 0)]
    return add_object("needle", [*feet, (0, 0, 1)], [(0, 1, 3), (1, 2, 3), (2, 0, 3)])


@pytest.mark.parametrize(("keep", "height"), [("BOTH", 0.925), ("ONE", 0.5)])
def test_the_reference_stays_within_the_tolerance_unless_one_way_is_asked_for(keep, height):
    ob = needle()
    ob.tolvol.keep = keep
    reference = guarded(ob, "sculpting", tolerance=0.1)
    co = coordinates(ob)
    co[3, 2] = 0.5
    after = dab(ob, co)
    assert abs(after[3, 2] - height) <= 0.025
    backward = judged(ob, reference, 0.1)[1]
    assert backward <= 1 if keep == "BOTH" else backward > 4


def test_parts_of_the_reference_that_are_beyond_the_tolerance_are_named():
    ob = needle()
    guarded(ob, tolerance=0.1, mode="OBJECT")
    ob.data.vertices[3].co.z = 0.5
    ob.tolvol.guard.sculpting = True
    bpy.ops.object.mode_set(mode="SCULPT")
    updated(ob)
    said = "3 faces of the reference are beyond the tolerance: what is nearest stays"
    assert state(ob)["sculpting"] == (said, True)
    ob.tolvol.keep = "ONE"
    updated(ob)
    assert state(ob)["sculpting"] == ("Guarding one way", True)


def test_what_holds_t_junctions_together_stays_and_the_guard_says_so():
    ob = plates_with_t_junctions()
    guarded(ob, "sculpting")
    before = coordinates(ob)
    between = before[:, 0] == 0
    assert state(ob)["sculpting"] == (f"{between.sum()} vertices hold T-junctions together and cannot move", True)
    moved = (dab(ob, before + [0, 0, 0.001]) != before).any(1)
    assert np.array_equal(moved, ~between)


def test_corners_of_a_concave_face_stay_where_they_are():
    quads = [(0, 1, 2, 3), (1, 4, 5, 2)]
    ob = add_object("arrow", [(0, 0, 0), (1, 0, 0), (0.3, 0.3, 0), (0, 1, 0), (3, 0, 0), (3, 2, 0)], quads)
    reference = guarded(ob, "sculpting")
    assert state(ob)["sculpting"] == ("1 concave faces stay where they are", True)
    before = coordinates(ob)
    after = dab(ob, before + [0, 0, 0.01])
    moved = (after != before).any(1)
    assert list(moved) == [False, False, False, False, True, True]
    assert state(ob)["sculpting"] == ("Held back 4 vertices", True)
    assert judged(ob, reference)[1] <= 1


# Meshes without a guard ---------------------------------------------------------------------------------------------


def test_a_mesh_that_is_outside_is_left_alone_with_the_reason():
    ob = sheet(count=20)
    reference = guarded(ob, "sculpting", mode="OBJECT")
    co = coordinates(ob)
    co[100, 2] += 1
    ob.data.vertices.foreach_set("co", co.ravel())
    bpy.ops.object.mode_set(mode="SCULPT")
    updated(ob)
    assert state(ob)["sculpting"] == ("4 faces are outside: Select Outside in Object Mode shows them", False)
    wish = bump(ob, 0.5)
    assert np.array_equal(dab(ob, wish), wish)
    # Back inside and switched on anew.
    dab(ob, np.asarray(sheet_arrays(20)[0]))
    ob.tolvol.guard.sculpting = False
    updated(ob)
    ob.tolvol.guard.sculpting = True
    updated(ob)
    dab(ob, bump(ob, 0.5))
    assert judged(ob, reference)[1] <= 1


def test_reasons():
    ob = sheet(count=10)
    ob.tolvol.guard.sculpting = True
    assert state(ob)["sculpting"] == ("Set the reference first", False)
    guarded(ob, "sculpting")
    bpy.ops.sculpt.dynamic_topology_toggle()
    assert "Switch off Dyntopo" in state(ob)["sculpting"][0]
    bpy.ops.sculpt.dynamic_topology_toggle()
    bpy.ops.object.mode_set(mode="OBJECT")
    multires = ob.modifiers.new("multires", "MULTIRES")
    assert "Apply the Multiresolution modifier first" in state(ob)["sculpting"][0]
    ob.modifiers.remove(multires)
    ob.tolvol.reference_kind = "OBJECT"
    assert "another kind of reference was chosen" in state(ob)["sculpting"][0]
    ob.tolvol.reference_kind = "SELF"
    ob.tolvol.guard.lattice = True
    assert state(ob)["lattice"] == ("sheet has no Lattice modifier with a lattice", False)


def test_a_face_of_very_many_corners_is_refused():
    around = np.arange(65) * 2 * np.pi / 65
    ob = add_object("disc", [(np.cos(a), np.sin(a), 0) for a in around], [range(65)])
    guarded(ob, "sculpting")
    assert "65 corners, too many for a guard: use Face > Triangulate" in state(ob)["sculpting"][0]


def test_a_tolerance_that_is_changed_counts_at_once():
    ob = sheet(count=30, bumps=0.0)
    reference = guarded(ob, "sculpting")
    dab(ob, bump(ob, 0.015))
    ob.tolvol.tolerance_length = 0.05
    updated(ob)
    dab(ob, bump(ob, 1))
    lower, upper = judged(ob, reference, 0.05)
    assert 0.95 < lower and upper <= 1
    ob.tolvol.tolerance_length = 0.01
    updated(ob)
    assert "faces are outside" in state(ob)["sculpting"][0]


def test_nothing_is_left_of_objects_that_change_or_go():
    ob = sheet(count=20)
    reference = guarded(ob, "sculpting")
    ob.name = "renamed"
    updated(ob)
    assert [name for name, _ in guard.sculpt.watches] == ["renamed"]
    dab(ob, bump(ob, 1))
    assert judged(ob, reference)[1] <= 1
    twin = ob.copy()
    twin.data = ob.data.copy()
    bpy.context.collection.objects.link(twin)
    updated(twin)
    bpy.ops.object.mode_set(mode="OBJECT")
    updated(ob)
    assert not list(guard.sculpt.watches)
    activate(twin)
    bpy.ops.object.mode_set(mode="SCULPT")
    updated(twin)
    bpy.data.objects.remove(ob)
    dab(twin, bump(twin, -1))
    assert judged(twin, reference)[1] <= 1
    bpy.data.objects.remove(twin)
    bpy.context.view_layer.update()
    guard._sweep()
    assert not list(guard.sculpt.watches)
    guarded(sheet(count=5), "sculpting")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert not list(guard.sculpt.watches)


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
    lattice.data.points.foreach_set("co_deform", points.ravel())
    lattice.data.update_tag()
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()  # Blender evaluates the points that the guard wrote without calling a handler.


def evaluated(ob, reference):
    surface = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    arrays = mesh_io.read_mesh(surface)
    vertices = to_world(arrays.vertices, mesh_io.matrix_array(ob.matrix_world))
    found = native.module.directed_hausdorff(vertices, arrays.triangles, *reference, bound=TOLERANCE)
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
    assert state(ob)["lattice"] == ("Guarding one way", True)
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
