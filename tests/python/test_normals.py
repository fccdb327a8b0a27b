# SPDX-License-Identifier: GPL-3.0-or-later
"""max_normal_angle of tolvol.decimate: no face is turned away from all of the reference that is near it.

The judge looks at points of every face of the result, and at all triangles of the reference within the tolerance of each.
"""

import numpy as np
import pytest
import tolvol

import meshes
from judge import assert_promise, decimate, largest_angles, unit_normals

PLATES = meshes.non_manifold()
ROUNDING = 1e-4  # degrees


def test_no_face_of_the_result_is_turned_over():
    vertices, triangles = PLATES
    turned, counts = [], []
    for percent in (2, 3):
        tolerance = percent / 100 * tolvol.diagonal(vertices, triangles)
        for effort in ("fast", "thorough"):
            free = decimate(vertices, triangles, tolerance, effort=effort, max_normal_angle=180)
            turned.append((largest_angles(vertices, triangles, free, tolerance) > 91).sum())
            assert free.report["normals"] is None
            result = decimate(vertices, triangles, tolerance, effort=effort)
            found = largest_angles(vertices, triangles, result, tolerance).max()
            assert found <= result.report["normals"]["largest"] + ROUNDING
            assert result.report["normals"]["largest"] <= 90
            assert result.report["normals"]["exceeded_before"] == result.report["normals"]["exceeded_after"] == 0
            assert_promise(vertices, triangles, result, tolerance)
            counts.append((len(result.triangles), len(free.triangles)))
    # A count of fifty triangles depends too much on rounding to be compared alone.
    with_rule, without = np.sum(counts, axis=0)
    assert with_rule <= 1.1 * without
    assert sum(turned) > 3, "without the rule there are faces that are turned over"


@pytest.mark.parametrize("options", [{}, {"effort": "thorough"}, {"placement": "subset"}, {"two_sided": False}])
def test_the_angle_is_a_bound_of_ones_own(options):
    vertices, triangles = meshes.torus(32, 16, noise=0.003)
    tolerance = 0.03 * tolvol.diagonal(vertices, triangles)
    free = decimate(vertices, triangles, tolerance, **options)
    largest_of_free = largest_angles(vertices, triangles, free, tolerance).max()
    for angle in (12, 40):
        result = decimate(vertices, triangles, tolerance, max_normal_angle=angle, **options)
        assert largest_angles(vertices, triangles, result, tolerance).max() <= angle + ROUNDING < largest_of_free
        assert 0 < result.report["normals"]["largest"] <= angle
        assert len(free.triangles) < len(result.triangles) < len(triangles)
        assert_promise(vertices, triangles, result, tolerance, two_sided=options.get("two_sided", True))


@pytest.mark.parametrize("effort", ["fast", "thorough"])
def test_the_bits_do_not_depend_on_the_number_of_threads(effort):
    vertices, triangles = meshes.torus(64, 32, noise=0.002)
    tolerance = 0.02 * tolvol.diagonal(vertices, triangles)
    one, three = (
        decimate(vertices, triangles, tolerance, effort=effort, max_normal_angle=25, threads=n) for n in (1, 3)
    )
    assert np.array_equal(one.vertices, three.vertices) and np.array_equal(one.triangles, three.triangles)
    assert one.report["normals"] == three.report["normals"]


def folded_plate():
    """Returns a plate, the same with one vertex moved over the faces beside it, and which faces that turns over."""
    vertices, triangles = meshes.plate(17)
    moved = vertices.copy()
    moved[17 * 8 + 8, 0] += 1.6 / 16
    over = unit_normals(moved[triangles])[:, 2] * unit_normals(vertices[triangles])[:, 2] < 0
    return vertices, triangles, moved, over


def test_faces_of_the_input_that_are_turned_over_are_counted_and_become_no_more():
    vertices, triangles, moved, over = folded_plate()
    assert over.any()
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.02)
    kept = tolvol.decimate(moved, triangles, volume, target_triangles=len(triangles))
    assert kept.report["normals"]["exceeded_before"] == kept.report["normals"]["exceeded_after"] == over.sum()
    result = tolvol.decimate(moved, triangles, volume)
    assert len(result.triangles) < len(triangles) / 4
    after = (largest_angles(vertices, triangles, result, 0.02) > 90 + ROUNDING).sum()
    assert after <= result.report["normals"]["exceeded_after"] <= over.sum()


def test_an_angle_that_the_input_exceeds_does_not_rise():
    """The faces of a corrugated sheet over a flat one have 45 degrees, and only the flat ones at its ends have less."""
    vertices, triangles = meshes.plate(33)
    inner = (vertices[:, 0] > 0.2) & (vertices[:, 0] < 0.8)
    raised = vertices + np.where(inner & (np.arange(len(vertices)) % 2 == 1), 1 / 32, 0)[:, None] * [0, 0, 1]
    before = np.degrees(np.arccos(unit_normals(raised[triangles])[:, 2]))
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.04)
    result = tolvol.decimate(raised, triangles, volume, max_normal_angle=20)
    normals = result.report["normals"]
    assert normals["exceeded_before"] == (before > 20).sum() > 500
    assert normals["exceeded_after"] < normals["exceeded_before"]
    assert normals["largest"] <= 20
    after = np.degrees(np.arccos(unit_normals(result.vertices[result.triangles])[:, 2]))
    assert after.max() <= before.max() + 0.1 and (after > 20 + ROUNDING).sum() <= normals["exceeded_after"]


def test_a_far_origin_costs_nothing():
    """Coordinates of a terrain are often millions of metres, in float64 arrays or behind a matrix."""
    vertices, triangles = meshes.torus(64, 32, noise=0.002)
    vertices = vertices.astype(np.float64)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    count = len(decimate(vertices, triangles, tolerance).triangles)
    for away in (1e5, 1e8, 1e11):
        matrix = np.eye(4)
        matrix[:3, 3] = -away
        moved = vertices + away
        there = decimate(moved, triangles, tolerance)
        back = decimate(moved, triangles, tolerance, to_world=matrix)
        assert_promise(moved, triangles, there, tolerance)
        assert_promise(moved, triangles, back, tolerance, to_world=matrix)
        for result in (there, back):
            assert abs(len(result.triangles) / count - 1) < 0.1
            assert 0 < result.report["normals"]["largest"] <= 90 and result.report["normals"]["unsure"] == 0
            assert result.report["warnings"] == []


def test_no_angle_is_kept_where_faces_are_too_small_for_the_size_of_the_reference():
    vertices, triangles = meshes.torus(32, 16)
    vertices = np.vstack([vertices.astype(np.float64) * 1e-6, [[1, 0, 0], [1, 1e-6, 0], [1, 0, 1e-6]]])
    triangles = np.vstack([triangles, [np.arange(3) + len(vertices) - 3]])
    result, free = (decimate(vertices, triangles, 1e-8, max_normal_angle=angle) for angle in (None, 180))
    assert result.report["normals"] is None
    assert "no angle of normals is kept" in result.report["warnings"][0]
    assert len(result.triangles) == len(free.triangles) < len(triangles)


def test_degenerate_faces_are_counted_as_faces_without_an_angle():
    vertices, triangles = meshes.needles(height=1e-9)
    result = decimate(vertices, triangles, 1e-6)
    assert result.report["normals"]["unsure"] > 0


def test_a_part_that_faces_the_other_way_is_compared_by_its_other_side():
    vertices, triangles = meshes.torus(48, 24)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles))
    result = tolvol.decimate(vertices, triangles[:, ::-1], volume)
    assert result.report["normals"]["exceeded_before"] == 0 and result.report["normals"]["largest"] <= 90
    assert len(result.triangles) < len(triangles) / 5


@pytest.mark.parametrize("mesh", [meshes.misoriented, meshes.degenerate, meshes.needles])
def test_orientation_and_needles_of_the_input_are_no_error(mesh):
    vertices, triangles = mesh()
    result = decimate(vertices, triangles, 0.02 * tolvol.diagonal(vertices, triangles))
    normals = result.report["normals"]
    assert normals["exceeded_before"] == normals["exceeded_after"] == 0 and normals["largest"] <= 90
    # A face that is compared by the wrong side finds no witness, and its vertices cannot go.
    free = decimate(vertices, triangles, 0.02 * tolvol.diagonal(vertices, triangles), max_normal_angle=180)
    assert len(result.triangles) <= 1.5 * len(free.triangles)


@pytest.mark.parametrize("angle", [0, -1, 180.001, np.nan, np.inf])
def test_other_angles_are_refused(angle):
    with pytest.raises(tolvol.InvalidInput, match="max_normal_angle must be more than 0 and at most 180 degrees"):
        decimate(*PLATES, 0.03, max_normal_angle=angle)


def test_without_a_volume_there_is_no_angle():
    result = tolvol.decimate(*PLATES, None, target_triangles=500, max_normal_angle=10)
    assert result.report["normals"] is None
