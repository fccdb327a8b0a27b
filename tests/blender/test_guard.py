# SPDX-License-Identifier: GPL-3.0-or-later
"""The guard of sculpting without a window: scripts move vertices like a brush. tests/ui has real brushes."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import guard, native
from addon.mesh import mesh_io
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
