# SPDX-License-Identifier: GPL-3.0-or-later
"""max_normal_angle of the operations that move vertices: they turn no face away from all of the reference near it."""

import numpy as np
import pytest
import tolvol

import meshes
from judge import angles_of, assert_promise, unit_normals

ROUNDING = 1e-3  # degrees


def scene(percent=3):
    """A torus (vertices float32, triangles), its volume, and a wish that throws its vertices about."""
    vertices, triangles = meshes.torus(20, 14)
    vertices = vertices.astype(np.float32)
    tolerance = percent / 100 * tolvol.diagonal(vertices, triangles)
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    wish = vertices + np.random.default_rng(3).standard_normal(vertices.shape) * tolerance
    return vertices, triangles, volume, wish.astype(np.float32)


def angles(reference, triangles, vertices, tolerance):
    return angles_of(reference[triangles].astype(float), vertices[triangles].astype(float), tolerance)


def judged(vertices, triangles, volume, result, angle=90):
    """Returns the number of faces that exceed 90 degrees. Requires that the report has the largest angle if one is kept."""
    found = angles(vertices, triangles, result.vertices, volume.tolerance)
    normals = result.report["normals"]
    if normals is not None:
        assert normals["exceeded_before"] == normals["exceeded_after"] == normals["unsure"] == 0
        assert found.max() <= normals["largest"] + ROUNDING and normals["largest"] <= angle
    return (found > 90 + ROUNDING).sum()


@pytest.mark.parametrize(
    "options", [{}, {"crossings": "allow"}, {"mode": "reset"}, {"two_sided": False, "crossings": "allow"}]
)
def test_constrain_turns_no_face(options):
    vertices, triangles, volume, wish = scene()
    free = tolvol.constrain(vertices, wish, triangles, volume, max_normal_angle=180, **options)
    assert free.report["normals"] is None
    if options.get("mode") != "reset":
        assert judged(vertices, triangles, volume, free) > 20, "without the rule faces are turned over"
    result = tolvol.constrain(vertices, wish, triangles, volume, **options)
    assert judged(vertices, triangles, volume, result) == 0
    assert_promise(
        vertices, triangles, Moved(result, triangles), volume.tolerance, two_sided=options.get("two_sided", True)
    )
    narrow = tolvol.constrain(vertices, wish, triangles, volume, max_normal_angle=20, **options)
    assert judged(vertices, triangles, volume, narrow, 20) == 0
    assert narrow.factors.sum() < result.factors.sum() or options.get("mode") == "reset"


class Moved:
    """A result of a motion as one of a decimation."""

    def __init__(self, result, triangles):
        self.vertices, self.triangles = result.vertices, triangles


def test_constrain_turns_no_quad_in_any_triangulation():
    n = 16
    x, y = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(0, 1, n)], indexing="ij"))
    vertices = np.stack([x, y, 0.02 * np.sin(9 * x)], 1).astype(np.float32)
    at = np.arange(n * n).reshape(n, n)
    quads = np.stack([a.ravel() for a in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:])], 1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    tolerance = 0.06
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    wish = (vertices + np.random.default_rng(5).standard_normal(vertices.shape) * 0.03).astype(np.float32)

    def turned(**options):
        moved = tolvol.constrain(vertices, wish, quads, volume, crossings="allow", **options).vertices
        count = 0
        for corners in ([0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]):
            reference = vertices[triangles].astype(float)
            count += (angles_of(reference, moved[quads[:, corners]].astype(float), tolerance) > 90 + ROUNDING).sum()
        return count

    assert turned(max_normal_angle=180) > 20
    assert turned() == 0


def test_smooth_turns_no_face():
    """Smoothing draws the middle of half a ring over its inner border, and folds it there."""
    rows, columns = 13, 8
    r, turn = (a.ravel() for a in np.meshgrid(np.linspace(1, 2, rows), np.linspace(0, np.pi, columns), indexing="ij"))
    vertices = np.stack([r * np.cos(turn), r * np.sin(turn), 0 * r], 1)
    triangles = meshes.grid_triangles(columns, rows)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.4)
    given = {"operator": "laplacian", "weights": "uniform", "iterations": 100, "crossings": "allow"}
    free = tolvol.smooth(vertices, triangles, volume, max_normal_angle=180, **given)
    assert judged(vertices, triangles, volume, free) > 10, "without the rule faces are turned over"
    result = tolvol.smooth(vertices, triangles, volume, **given)
    assert judged(vertices, triangles, volume, result) == 0
    assert_promise(vertices, triangles, Moved(result, triangles), volume.tolerance)


@pytest.fixture(scope="module")
def turning():
    """A torus, its volume, and a lattice that would turn faces of it over."""
    vertices, triangles, volume, _ = scene(20)
    low, size = vertices.min(0), np.ptp(vertices, axis=0)
    domain = np.eye(4)
    domain[:3, :3], domain[:3, 3] = np.diag(size * 1.02), low - 0.01 * size
    points = tolvol.lattice_points((5, 5, 5), domain)
    points += np.random.default_rng(2).standard_normal(points.shape) * 0.7
    lattice = tolvol.Lattice(points, domain)
    wished = tolvol.deform(vertices, lattice).vertices
    assert (angles(vertices, triangles, wished, volume.tolerance) > 90).any()
    return vertices, triangles, volume, lattice


@pytest.mark.parametrize("mode", ["blocked", "farthest", "pull_back"])
@pytest.mark.parametrize("two_sided", [True, False])
def test_deform_turns_no_face(turning, mode, two_sided):
    vertices, triangles, volume, lattice = turning
    given = {"mode": mode, "two_sided": two_sided, "crossings": "allow"}
    result = tolvol.deform(vertices, lattice, triangles, volume, **given)
    assert judged(vertices, triangles, volume, result) == 0
    assert (mode == "blocked") == np.array_equal(result.vertices, vertices)


def test_deform_says_that_faces_would_turn():
    """A sheet is turned upside down within a wide tolerance: all of it stays inside."""
    x, y = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(0, 1, 9)], indexing="ij"))
    vertices = np.stack([x, y, 0 * x], 1)
    at = np.arange(81).reshape(9, 9)
    quads = np.stack([a.ravel() for a in (at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:])], 1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    volume = tolvol.ToleranceVolume(vertices, triangles, 1.2)
    domain = np.diag([1.0, 1, 1, 1])
    domain[2, 3] = -0.5
    points = tolvol.lattice_points((2, 2, 2), domain)
    points[..., 0] = 1 - points[..., 0]
    lattice = tolvol.Lattice(points, domain)
    given = {"two_sided": False, "crossings": "allow"}
    result = tolvol.deform(vertices, lattice, triangles, volume, **given)
    assert result.report["leaving"]["faces"] == 0 and result.report["turning"]["faces"] == len(triangles)
    assert np.array_equal(result.vertices, vertices)
    free = tolvol.deform(vertices, lattice, triangles, volume, max_normal_angle=180, **given)
    assert free.report["turning"]["faces"] == 0 and free.report["moved"] > 0


def test_the_guard_turns_no_face():
    vertices, triangles, volume, wish = scene()
    turned = []
    for options in ({}, {"max_normal_angle": 180}):
        guard = tolvol.Guard(vertices, triangles, volume, **options)
        moved, rng = vertices.copy(), np.random.default_rng(7)
        for _ in range(5):
            moved += (rng.standard_normal(moved.shape) * volume.tolerance / 3).astype(np.float32)
            indices, back = guard.constrain(moved)
            moved[indices] = back
        turned.append((angles(vertices, triangles, moved, volume.tolerance) > 90 + ROUNDING).sum())
        assert guard.exceeding == 0
    assert turned[0] == 0 and turned[1] > 20


def test_faces_that_exceed_the_angle_before_are_counted_and_become_no_worse():
    vertices, triangles, volume, wish = scene()
    rough = tolvol.constrain(vertices, wish, triangles, volume, max_normal_angle=180, crossings="allow").vertices
    before = angles(vertices, triangles, rough, volume.tolerance)
    again = rough + (np.random.default_rng(4).standard_normal(rough.shape) * volume.tolerance / 2).astype(np.float32)
    worse = []
    for angle in (None, 180):
        result = tolvol.constrain(rough, again, triangles, volume, crossings="allow", max_normal_angle=angle)
        after = angles(vertices, triangles, result.vertices, volume.tolerance)
        worse.append(after - np.maximum(before, 90))
        if angle is None:
            normals = result.report["normals"]
            assert normals["exceeded_before"] >= (before > 90 + ROUNDING).sum() > 0
            assert normals["exceeded_before"] >= normals["exceeded_after"] >= (after > 90 + ROUNDING).sum()
    # The least angle that is proved is known to a degree, and the judge looks at points of each face alone.
    assert (worse[0] > 1.01).sum() < 5 and worse[0].max() < 5
    assert (worse[1] > 5).sum() > 0.05 * len(triangles), "without the rule they become worse"
    # Smoothing turns most of them back.
    smooth = tolvol.smooth(rough, triangles, volume, operator="laplacian", iterations=20, crossings="allow")
    assert smooth.report["normals"]["exceeded_after"] < normals["exceeded_before"] / 2


def test_the_largest_angle_is_also_that_of_faces_that_exceeded_it_before():
    plane = np.array([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], float), np.array([(0, 1, 2), (0, 2, 3)])
    volume = tolvol.ToleranceVolume(*plane, tolerance=0.5)
    # The first face lies on the plane, and the second one stands on an edge of it at an angle.
    triangles = np.array([(0, 1, 2), (1, 0, 3)])

    def standing(degrees):
        away, up = -np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        return np.array([(0, 0, 0), (4, 0, 0), (2, 4, 0), (2, 0.2 * away, 0.2 * up)], float)

    result = tolvol.constrain(standing(120), standing(60), triangles, volume, two_sided=False, crossings="allow")
    np.testing.assert_array_equal(result.vertices, standing(60))
    normals = result.report["normals"]
    assert (normals["exceeded_before"], normals["exceeded_after"], normals["unsure"]) == (1, 0, 0)
    assert 60 - ROUNDING <= normals["largest"] <= 61


def test_a_mesh_that_faces_against_the_reference_is_compared_by_its_other_side():
    vertices, triangles, volume, wish = scene()
    result = tolvol.constrain(vertices, wish, triangles[:, ::-1], volume)
    assert result.report["normals"]["exceeded_before"] == 0
    assert judged(vertices, triangles, volume, result) == 0


def test_neighbours_oriented_against_each_other_move_as_if_they_were_not():
    vertices, triangles, volume, wish = scene()
    mixed = triangles.copy()
    mixed[::3] = mixed[::3, ::-1]
    own = tolvol.ToleranceVolume(vertices, mixed, volume.tolerance)
    plain = tolvol.constrain(vertices, wish, triangles, volume)
    result = tolvol.constrain(vertices, wish, mixed, own)
    assert result.report["normals"]["exceeded_before"] == 0
    assert judged(vertices, triangles, volume, result) == 0
    assert abs(result.report["held_back"] - plain.report["held_back"]) < 0.1 * plain.report["held_back"]


def test_a_reference_without_sure_normals_keeps_no_angle_and_warns():
    vertices, triangles, _, _ = scene()
    far = vertices.astype(np.float64) * 1e-9
    far = np.concatenate([far, [[1e3, 0, 0], [1e3, 1, 0], [1e3, 0, 1]]])
    faces = np.concatenate([triangles, [[len(vertices), len(vertices) + 1, len(vertices) + 2]]])
    volume = tolvol.ToleranceVolume(far, faces, 0.5)
    result = tolvol.constrain(far, far, faces, volume)
    assert result.report["normals"] is None
    assert "no angle of normals is kept" in result.report["warnings"][0]
    assert "no angle" in tolvol.Guard(far.astype(np.float32), faces, volume, outside="keep").warnings[0]


@pytest.mark.parametrize("angle", [0, -1, 181, np.nan])
def test_bad_angles(angle):
    vertices, triangles, volume, wish = scene()
    for call in (
        lambda: tolvol.constrain(vertices, wish, triangles, volume, max_normal_angle=angle),
        lambda: tolvol.smooth(vertices, triangles, volume, max_normal_angle=angle),
        lambda: tolvol.Guard(vertices, triangles, volume, max_normal_angle=angle),
        lambda: tolvol.deform(
            vertices, tolvol.Lattice(tolvol.lattice_points(2)), triangles, volume, max_normal_angle=angle
        ),
    ):
        with pytest.raises(tolvol.InvalidInput, match="max_normal_angle"):
            call()


def test_the_bits_do_not_depend_on_the_number_of_threads():
    vertices, triangles, volume, wish = scene()
    one, three = (tolvol.constrain(vertices, wish, triangles, volume, threads=n) for n in (1, 3))
    assert np.array_equal(one.vertices, three.vertices) and one.report["normals"] == three.report["normals"]


def test_a_face_without_a_normal_may_stay_so_and_keeps_the_angle_once_it_has_one():
    vertices, triangles, _, _ = scene()
    flat = np.concatenate([triangles, [[0, 1, 1]], [[2, 3, 4]]])
    vertices = vertices.copy()
    vertices[4] = (vertices[2] + vertices[3]) / 2
    volume = tolvol.ToleranceVolume(vertices, flat, 0.1)
    wish = (vertices + np.random.default_rng(3).standard_normal(vertices.shape) * 0.1).astype(np.float32)
    result = tolvol.constrain(vertices, wish, flat, volume, crossings="allow")
    has_area = (
        np.linalg.norm(np.cross(*(result.vertices[flat[:, k]] - result.vertices[flat[:, 0]] for k in (1, 2))), axis=1)
        > 1e-4
    )
    had_area = np.linalg.norm(np.cross(*(vertices[flat[:, k]] - vertices[flat[:, 0]] for k in (1, 2))), axis=1) > 1e-4
    reference = vertices[flat[had_area]].astype(float)
    found = angles_of(reference, result.vertices[flat[has_area]].astype(float), volume.tolerance)
    assert (found > 90 + ROUNDING).sum() <= result.report["normals"]["exceeded_after"]
    assert np.isfinite(unit_normals(result.vertices[flat[has_area]].astype(float))).all()


def test_a_deformation_compares_its_result_by_the_sides_that_it_began_with():
    # In the reference three triangles share an edge, so that they are parts of their own. Of the mesh one is outside, so
    # that the other two, which run along the edge in one direction, are one part, half of which looks to either side.
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1.0]])
    volume = tolvol.ToleranceVolume(vertices, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]], np.int32), 0.01)
    apart = np.concatenate([vertices, vertices[[0, 1, 4]] + [0, 0, 0.05]])
    triangles = np.array([[0, 1, 2], [0, 1, 3], [5, 6, 7]], np.int32)
    domain = meshes.matrix(np.diag([1.2, 2.2, 1.4]), [-0.1, -1.1, -0.1])
    lattice = tolvol.Lattice(tolvol.lattice_points(2, domain) + [0.001, 0, 0], domain)
    result = tolvol.deform(apart, lattice, triangles, volume, two_sided=False, outside="keep", crossings="allow")
    assert result.report["moved"] > 0
    normals = result.report["normals"]
    assert normals["exceeded_before"] == normals["exceeded_after"] == 0
