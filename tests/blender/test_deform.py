# SPDX-License-Identifier: GPL-3.0-or-later
"""Deform in Tolerance: reading Blender's lattice, the promise on the stored mesh, and bad input."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh import mesh_io
from addon.operators.deform import native_lattice
from addon.proof import verdict
from addon.reference import measurements
from addon.shared.surface import to_world
from scenes import (
    add_object,
    assert_within,
    cage,
    plates_with_t_junctions,
    sheet,
    torus,
    world_triangles,
)

PLACED = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.7, 4, (1, 2, 3)) @ Matrix.Diagonal((1, 2, 0.5, 1))


def lift(ob, height, above=-1.0, below=1.0):
    """Moves the points of a lattice between `above` and `below` along u (-0.5 to 0.5) by a length in the world along w."""
    for point in ob.data.points:
        if above <= point.co.x / (ob.data.points_u - 1) <= below:
            point.co_deform.z += height / ob.matrix_world.to_scale().z


def coordinates(ob):
    return mesh_io.column(ob.data.vertices, "co", 3)


def refused(match, **options):
    before = {ob.name: coordinates(ob).tobytes() for ob in bpy.data.objects if ob.type == "MESH"}
    with pytest.raises(RuntimeError, match=match):
        bpy.ops.tolvol.deform(**options)
    assert before == {ob.name: coordinates(ob).tobytes() for ob in bpy.data.objects if ob.type == "MESH"}


# The lattice --------------------------------------------------------------------------------------------------------


def test_a_lattice_of_two_points_an_axis_deforms_as_blenders_own():
    ob = torus()
    ob.tolvol.tolerance_percent = 50
    lattice = cage(points=(2, 2, 2), interpolation="KEY_LINEAR", matrix=Matrix.Rotation(0.4, 4, "Z"))
    rng = np.random.default_rng(3)
    for point in lattice.data.points:
        point.co_deform = np.array(point.co) + rng.uniform(-0.15, 0.15, 3)
    modifier = ob.modifiers.new("lattice", "LATTICE")
    modifier.object = lattice
    bpy.context.view_layer.update()
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    expected = mesh_io.column(evaluated.vertices, "co", 3)
    ob.modifiers.remove(modifier)
    assert bpy.ops.tolvol.deform(lattice="cage") == {"FINISHED"}
    assert np.abs(coordinates(ob) - expected).max() < 2e-6


def test_points_are_read_along_their_axes():
    lattice = cage(points=(2, 3, 5))
    lattice.data.points[1].co_deform.x += 0.5  # the next point along u
    read = native_lattice(lattice)
    assert read.shape == (2, 3, 5) and read.degree == (1, 2, 3)
    corner = np.array([[1.4, -1.4, -0.5], [-1.4, 1.4, -0.5], [-1.4, -1.4, 0.5]])
    moved = native.module.deform(corner, read).vertices
    assert np.allclose(moved - corner, [[1.4, 0, 0], [0, 0, 0], [0, 0, 0]], atol=1e-6)


def test_all_points_moved_alike_move_the_mesh_alike_wherever_it_is():
    ob = torus(matrix=PLACED)
    before, triangles = world_triangles(ob)
    lattice = cage(points=(5, 6, 4), matrix=PLACED)
    turn = Matrix.Rotation(0.005, 4, "Z") @ Matrix.Translation((0.002, 0.001, 0))
    for point in lattice.data.points:
        point.co_deform = turn @ point.co
    assert bpy.ops.tolvol.deform(lattice="cage") == {"FINISHED"}
    local = np.array(lattice.matrix_world @ turn @ lattice.matrix_world.inverted())
    assert np.abs(world_triangles(ob)[0] - to_world(before, local)).max() < 5e-6


def test_vertices_outside_of_the_lattice_or_far_from_its_moved_points_stay_bit_for_bit():
    ob = sheet(matrix=PLACED)
    before = coordinates(ob)
    lattice = cage(points=(9, 4, 2), size=(1.5, 3, 1), matrix=PLACED)
    lift(lattice, 0.01, below=-0.4)
    bpy.ops.tolvol.deform(lattice="cage")
    moved = (coordinates(ob) != before).any(1)
    assert moved.any() and not moved[np.abs(before[:, 0]) > 0.751].any() and not moved[before[:, 0] > 0.2].any()


# The promise --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["BLOCKED", "FARTHEST", "PULL_BACK"])
@pytest.mark.parametrize("matrix", [Matrix(), PLACED], ids=["local", "placed"])
def test_stays_within_the_tolerance_in_the_world(matrix, mode):
    ob = torus(matrix=matrix)
    reference = world_triangles(ob)
    tolerance = 0.01 * native.module.diagonal(
        coordinates(ob), reference[1], to_world=mesh_io.matrix_array(ob.matrix_world)
    )
    lattice = cage(matrix=matrix)
    lift(lattice, 0.9 * tolerance if mode == "BLOCKED" else 8 * tolerance, above=0)
    assert bpy.ops.tolvol.deform(lattice="cage", mode=mode) == {"FINISHED"}
    stored = world_triangles(ob)
    assert not np.array_equal(stored[0], reference[0])
    judged = native.module.hausdorff(*stored, *reference, bound=tolerance)
    assert judged.upper <= tolerance * (1 + 1e-6)
    assert_within(stored, reference, tolerance)
    measured = measurements.measurement_of(ob)
    assert verdict.of(ob).kind == verdict.WITHIN
    assert judged.forward.lower <= measured.forward and judged.backward.lower <= measured.backward
    assert np.array_equal(mesh_io.read_mesh(ob.tolvol.snapshot).triangles, reference[1])
    assert ob.tolvol.lattice == lattice and ob.tolvol.deform_mode == mode


def test_blocked_says_how_far_and_changes_nothing():
    ob = sheet(bumps=0.0)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    lift(cage(), 0.2)
    refused(r"900 faces of sheet would leave.*24\.\d % of the way is permitted", lattice="cage")
    assert ob.tolvol.snapshot is None
    bpy.ops.tolvol.deform(lattice="cage", mode="FARTHEST")
    assert 0.0485 < coordinates(ob)[:, 2].min() == coordinates(ob)[:, 2].max() <= 0.05


def test_pulled_back_only_the_vertices_there_are_held():
    ob = sheet(bumps=0.0)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    lattice = cage(points=(6, 4, 2))
    lift(lattice, 0.2, above=0.45)
    lift(lattice, 0.01, below=-0.45)
    wish = native.module.deform(coordinates(ob), native_lattice(lattice)).vertices
    bpy.ops.tolvol.deform(lattice="cage", mode="PULL_BACK")
    free = wish[:, 2] < 0.03
    assert np.array_equal(coordinates(ob)[free], wish[free])
    assert 0.0475 < coordinates(ob)[:, 2].max() <= 0.05


def test_quads_that_blender_cuts_along_their_other_diagonal_stay_within():
    """Blender triangulates a quad along its other diagonal as soon as it is concave as seen along its normal."""
    ob = add_object("kite", [(-1, 0, 0), (0, -1, 0), (1, 0, 0), (0, -0.3, 0.5)], [(0, 1, 2, 3)])
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 1.2
    ob.tolvol.keep = "ONE"
    before = world_triangles(ob)
    lattice = cage(points=(2, 2, 2), size=(2, 2, 2))
    for point in lattice.data.points:
        point.co_deform.z *= 0.8
    bpy.ops.tolvol.deform(lattice="cage")
    stored = world_triangles(ob)
    assert not np.array_equal(stored[1], before[1])
    judged = native.module.directed_hausdorff(*stored, *before)
    measured = measurements.measurement_of(ob)
    assert judged.lower <= measured.forward <= judged.upper * 1.02


def test_a_corner_stops_before_its_face_would_turn_over():
    """A corner that is pushed in beyond the diagonal turns a triangle of the quad over."""
    ob = add_object("kite", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)], [(0, 1, 2, 3), (0, 1, 4)])
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.9
    ob.tolvol.keep = "ONE"
    ob.tolvol.crossings = "ALLOW"  # Cut along the other diagonal, the quad crosses the triangle beside it.
    lattice = cage(points=(2, 2, 2), size=(1, 1, 2), matrix=Matrix.Translation((0.5, 0.5, 0.5)))
    for point in lattice.data.points:
        if point.co.x > 0 and point.co.y < 0:
            point.co_deform.x, point.co_deform.y = -0.2, 0.2
    with pytest.raises(RuntimeError, match="1 faces of kite would turn away from the reference. 71.4 % of the way is"):
        bpy.ops.tolvol.deform(lattice="cage")
    bpy.ops.tolvol.deform(lattice="cage", mode="FARTHEST")
    x, y, _ = coordinates(ob)[1]
    assert 0.49 < y < x < 0.51


def test_plates_that_meet_in_t_junctions_go_on_to_meet():
    ob = plates_with_t_junctions()
    ob.tolvol.tolerance_percent = 10
    before = coordinates(ob)
    lattice = cage(points=(5, 5, 2), size=(3, 3, 1))
    rng = np.random.default_rng(1)
    for point in lattice.data.points:
        point.co_deform.z += rng.uniform(-0.1, 0.1)
    bpy.ops.tolvol.deform(lattice="cage", mode="PULL_BACK")
    after = coordinates(ob)
    on_line = before[:, 0] == 0
    assert np.array_equal(after[on_line], before[on_line])
    assert (after != before).any(1).sum() > 0.5 * len(before)


def test_again_and_again_it_does_not_drift():
    ob = torus()
    reference = world_triangles(ob)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.03
    lift(cage(), 0.02)
    for _ in range(4):
        bpy.ops.tolvol.deform(lattice="cage", mode="PULL_BACK")
        assert_within(world_triangles(ob), reference, 0.03)
    assert np.array_equal(mesh_io.read_mesh(ob.tolvol.snapshot).vertices, reference[0].astype(np.float32))


# Attributes of the mesh ---------------------------------------------------------------------------------------------


def test_one_undo_step_restores_everything_bit_for_bit():
    ob = torus()
    lift(cage(), 0.01)
    bpy.ops.ed.undo_push(message="start")
    before = coordinates(ob).tobytes()
    bpy.ops.tolvol.deform("EXEC_DEFAULT", True, lattice="cage")
    after = coordinates(bpy.data.objects["torus"]).tobytes()
    assert after != before
    bpy.ops.ed.undo()
    ob = bpy.data.objects["torus"]
    assert coordinates(ob).tobytes() == before and ob.tolvol.snapshot is None
    bpy.ops.ed.redo()
    assert coordinates(bpy.data.objects["torus"]).tobytes() == after


def test_shape_keys_keep_their_motion_and_attributes_stay():
    ob = torus()
    ob.data.uv_layers.new()
    uvs = mesh_io.corner_uvs(ob.data)
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="up")
    for point in key.data:
        point.co.z += 0.25
    lift(cage(), 0.01, above=0)
    before = coordinates(ob)
    bpy.ops.tolvol.deform(lattice="cage")
    basis, up = (mesh_io.column(block.data, "co", 3) for block in ob.data.shape_keys.key_blocks)
    assert np.array_equal(basis, coordinates(ob)) and not np.array_equal(basis, before)
    assert np.abs(up - basis - [0, 0, 0.25]).max() < 1e-6
    assert np.array_equal(mesh_io.corner_uvs(ob.data), uvs)


def test_the_lattice_is_the_panels_or_the_selected_one():
    ob = torus()
    ob.tolvol.tolerance_percent = 2
    refused("Add a lattice first")
    lattice, other = cage(), cage("other")
    refused("torus: choose a lattice object")  # None is selected.
    lift(lattice, 0.01)
    lift(other, 0.015)
    lattice.select_set(True)
    other.select_set(True)
    refused("torus: choose a lattice object")  # There are two lattices.
    other.select_set(False)
    bpy.ops.tolvol.deform()
    assert ob.tolvol.lattice == lattice
    ob.tolvol.lattice = other
    before = coordinates(ob)
    bpy.ops.tolvol.deform()
    assert np.allclose(coordinates(ob) - before, [0, 0, 0.015], atol=1e-6)
    poll = type(ob.tolvol).__annotations__["lattice"].keywords["poll"]
    assert poll(ob.tolvol, lattice) and not poll(ob.tolvol, ob)


def test_a_modifier_with_the_same_lattice_is_named(capfd):
    ob = torus()
    lattice = cage()
    lift(lattice, 0.01)
    ob.modifiers.new("bend", "LATTICE").object = lattice
    bpy.ops.tolvol.deform(lattice="cage")
    assert "The modifier bend of torus deforms the mesh by cage again: remove it" in capfd.readouterr().out


# Refused ------------------------------------------------------------------------------------------------------------


def test_what_is_no_use_is_refused_with_the_name():
    ob = torus()
    cage()
    refused("nowhere: choose a lattice object", lattice="nowhere")
    refused("torus: choose a lattice object", lattice="torus")
    cage()
    refused("cage does not move torus: the lattice is at rest", lattice="cage")
    flat = cage("flat", points=(4, 4, 1))
    lift(flat, 0.01)
    refused("flat: a lattice needs at least 2 control points.*along w it has 1", lattice="flat")
    squashed = cage("squashed")
    lift(squashed, 0.01)
    squashed.scale.z = 0
    refused("squashed: the domain of the lattice", lattice="squashed")
    broken = cage("broken")
    broken.data.points[5].co_deform.x = float("nan")
    refused(r"broken: control point \(1, 1, 0\) is not finite", lattice="broken")
    ob.modifiers.new("multires", "MULTIRES")
    refused("Apply the Multiresolution modifier first", lattice="cage")


def test_a_mesh_that_is_outside_already_is_refused():
    scan = torus("scan", noise=0)
    model = torus("model", noise=0)
    model.data.vertices[100].co *= 1.2
    model.data.update()
    model.tolvol.reference_kind, model.tolvol.reference_object = "OBJECT", scan
    lift(cage(), 0.001)
    for mode in ("BLOCKED", "FARTHEST", "PULL_BACK"):
        refused(r"faces are not within the tolerance.*first is face", lattice="cage", mode=mode)
