# SPDX-License-Identifier: GPL-3.0-or-later
"""The guard of sculpting without a window: scripts move vertices like a brush. tests/ui has real brushes."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import guard, native
from addon.mesh import mesh_io
from addon.shared.surface import to_world
from scenes import activate, add_object, dissolve, plates_with_t_junctions, sheet, sheet_arrays, world_triangles

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


def drawn(ob):
    """Returns the arrays of the mesh at the coordinates that are edited."""
    scratch = ob.data.copy()
    scratch.vertices.foreach_set("co", coordinates(ob).ravel())
    arrays = mesh_io.read_mesh(scratch)
    bpy.data.meshes.remove(scratch)
    return arrays


def judged(ob, reference, tolerance=TOLERANCE):
    """Returns (lower, upper) of the distance of mesh and reference, in tolerances, in Blender's triangulation."""
    arrays = drawn(ob)
    vertices = to_world(arrays.vertices, mesh_io.matrix_array(ob.matrix_world))
    found = native.module.hausdorff(vertices, arrays.triangles, *reference, bound=tolerance)
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


def crossing_polygons(ob):
    """Returns the pairs of polygons that cross in the triangles that Blender draws, as a set."""
    arrays = drawn(ob)
    pairs = arrays.polygons[native.module.crossing_pairs(arrays.vertices, arrays.triangles)]
    return {tuple(sorted(pair)) for pair in pairs.tolist() if pair[0] != pair[1]}


@pytest.mark.parametrize("count", [12, 65])
def test_a_face_of_many_corners_keeps_both_ways(count):
    around = np.arange(count) * 2 * np.pi / count
    ob = add_object("disc", [(np.cos(a), np.sin(a), 0) for a in around], [range(count)])
    reference = guarded(ob, "sculpting")
    assert state(ob)["sculpting"] == ("Guarding both ways", True)
    rng = np.random.default_rng(5)
    for _ in range(10):
        before = coordinates(ob)
        after = dab(ob, before + rng.normal(0, 0.03, before.shape))
        assert judged(ob, reference)[1] <= 1
    assert (after != reference[0]).any(1).all()


@pytest.mark.parametrize("keeps_out", [False, True])
@pytest.mark.parametrize("bumps", [0.0, 0.05])
def test_what_blender_draws_is_kept_however_it_cuts_faces_after_a_dab(monkeypatch, keeps_out, bumps):
    """Dabs by which Blender cuts faces of many corners otherwise: the guard takes the new triangles where it can."""
    asked, refused = 0, 0

    class Guard:
        def __init__(self, *given, **options):
            self._native = made(*given, **options)

        def __getattr__(self, name):
            return getattr(self._native, name)

        def replace_faces(self, faces):
            nonlocal asked, refused
            found = self._native.replace_faces(faces)
            asked, refused = asked + 1, refused + (len(found) > 0)
            return found

    made = native.module.Guard
    monkeypatch.setattr(native.module, "Guard", Guard)
    rng = np.random.default_rng(1)
    ob = sheet(count=20, bumps=bumps)
    dissolve(ob, rng)
    ob.tolvol.guard.crossings = keeps_out
    reference = guarded(ob, "sculpting", tolerance=0.06)
    assert state(ob)["sculpting"] == ("Guarding both ways", True)
    crossing, moved = crossing_polygons(ob), 0
    for _ in range(15):
        before = coordinates(ob)
        centre = rng.uniform(-1, 1, 2)
        near = np.clip(1 - np.linalg.norm(before[:, :2] - centre, axis=1) / 0.5, 0, None)[:, None]
        wish = (before + near * rng.normal(0, 0.08, before.shape)).astype(np.float32)
        after = dab(ob, wish)
        assert judged(ob, reference, 0.06)[1] <= 1
        assert not keeps_out or crossing_polygons(ob) <= crossing
        moved += int((after != before).any(1).sum())
    assert asked > 15 and 5 < refused < asked and moved > 300


@pytest.mark.parametrize("seed", [302, 1, 2])
def test_bent_quads_keep_both_ways_also_where_blender_cuts_them_along_different_diagonals(seed):
    """A piece of the reference may have its witness in one quad along the one diagonal and in another quad along the other
    diagonal. Blender draws neither if it cuts the first quad along the other diagonal and the second along the one."""
    rng = np.random.default_rng(seed)
    vertices, quads = sheet_arrays(3, 0.0)
    ob = add_object("bent", vertices + rng.normal(0, 0.25, vertices.shape).astype(np.float32), quads)
    tolerance = rng.choice([0.05, 0.1, 0.2])
    reference = guarded(ob, "sculpting", tolerance=tolerance)
    for _ in range(4):
        before = coordinates(ob)
        dab(ob, before + rng.normal(0, 1.5 * tolerance, before.shape))
        assert judged(ob, reference, tolerance)[1] <= 1


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
    assert state(ob)["sculpting"] == ("1 bent or concave face stays where it is", True)
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
