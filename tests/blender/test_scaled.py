# SPDX-License-Identifier: GPL-3.0-or-later
"""The verdict of an object that is scaled together with its reference."""

import bpy
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh.mesh_io import read_mesh
from addon.proof import verdict
from addon.proof.verdict import FAIL, NOT_CHECKED, PASS
from addon.reference import snapshots, tolerances
from scenes import torus


def decimated(percent=1.0, **options):
    ob = torus(matrix=Matrix.Rotation(0.4, 4, (1, 2, 3)), **options)
    assert bpy.ops.tolvol.decimate(tolerance_percent=percent) == {"FINISHED"} and verdict.word(ob) == PASS
    return ob


def scaled(ob, *factors):
    ob.scale = [axis * factor for axis, factor in zip(ob.scale, factors)]
    bpy.context.view_layer.update()


def judged(ob):
    """Returns the larger distance of the mesh and its reference as they are stored, both in the world."""
    own, reference = snapshots.surface_of(ob), snapshots.reference_of(ob)
    surfaces = [part for each in (own, reference) for part in (each.world(), each.arrays.triangles)]
    return native.module.hausdorff(*surfaces)


@pytest.mark.parametrize("factor", (3.7, 0.001, 12345.0, -1.3))
def test_what_is_proved_in_percent_stays_proved(factor):
    ob = decimated()
    before = verdict.of(ob)
    scaled(ob, factor, factor, factor)
    ob.rotation_euler.x, ob.location = 2, (0.5, -3, 1)
    bpy.context.view_layer.update()
    after, now = verdict.of(ob), judged(ob)
    assert after.word == PASS and after.tolerance == pytest.approx(abs(factor) * before.tolerance)
    size = snapshots.reference_of(ob).size()
    assert after.tolerance == tolerances.tolerance_length(ob.tolvol, size)
    # What is said is true of the stored surfaces, and no worse than rounding makes it.
    assert now.lower <= after.largest <= after.tolerance and now.upper <= after.tolerance
    assert after.largest == pytest.approx(abs(factor) * before.largest, rel=1e-5)


def test_a_length_stays_and_the_deviation_grows():
    ob = decimated()
    tolerances.set_length(ob.tolvol, verdict.of(ob).tolerance)
    scaled(ob, 0.5, 0.5, 0.5)
    assert verdict.word(ob) == PASS
    scaled(ob, 6, 6, 6)
    assert verdict.word(ob) == FAIL and verdict.of(ob).surely_beyond


def test_what_rounding_could_change_is_not_checked():
    ob = decimated()
    found = verdict.of(ob)
    # The lower and the upper end of the largest deviation are about a thousandth apart.
    largest = max((found.forward, found.backward), key=lambda way: way.upper)
    assert largest.lower < largest.upper
    tolerances.set_length(ob.tolvol, 2 * largest.upper * (1 + 1e-12))
    scaled(ob, 2, 2, 2)
    assert verdict.word(ob) == NOT_CHECKED
    assert bpy.ops.tolvol.check() == {"FINISHED"} and verdict.word(ob) != NOT_CHECKED


def test_a_place_so_far_away_that_coordinates_are_rounded_is_not_checked():
    ob = decimated(percent=0.001)
    scaled(ob, 2, 2, 2)
    assert verdict.word(ob) == PASS
    ob.location.x = 1e12
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED


@pytest.mark.parametrize("factors", ((2, 2, 2.001), (2, 1, 1), (1, 1, 1.0003)))
def test_other_scales_are_not_checked(factors):
    ob = decimated()
    scaled(ob, *factors)
    assert verdict.word(ob) == NOT_CHECKED


def test_a_reference_that_stays_where_it_is_is_not_scaled():
    other = torus("other")
    ob = torus()
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", other
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and verdict.word(ob) == PASS
    scaled(ob, 2, 2, 2)
    assert verdict.word(ob) == NOT_CHECKED


def test_a_changed_mesh_is_not_checked():
    ob = decimated()
    before = read_mesh(ob.data).fingerprint()
    ob.data.vertices[0].co.z += 0.01
    ob.data.update()
    scaled(ob, 2, 2, 2)
    assert read_mesh(ob.data).fingerprint() != before and verdict.word(ob) == NOT_CHECKED


def test_a_turned_object_is_not_proved_without_the_margin_of_its_rounding():
    ob = decimated()
    tolerances.set_length(ob.tolvol, verdict.of(ob).largest)
    assert verdict.word(ob) == PASS
    ob.rotation_euler.z += 1
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED


def test_an_object_that_was_measured_far_away_is_not_proved_nearer():
    ob = torus(matrix=Matrix.Translation((5e9, 0, 0)))
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    tolerances.set_length(ob.tolvol, 1e-6)
    assert bpy.ops.tolvol.check() == {"FINISHED"} and verdict.word(ob) == PASS
    ob.data.vertices[0].co.z += 2e-7  # which the rounding of the world hides
    ob.data.update()
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    ob.location = (0, 0, 0)
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED


def test_a_sheared_object_whose_short_axis_grows_is_not_checked():
    parent = bpy.data.objects.new("parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale = (100, 1, 1)
    ob = decimated()
    ob.parent = parent
    ob.rotation_euler = (0, 0, 0.8)
    bpy.context.view_layer.update()
    assert bpy.ops.tolvol.check() == {"FINISHED"} and verdict.word(ob) != NOT_CHECKED
    parent.scale.y = 1.001
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED
