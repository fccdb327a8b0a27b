# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol.hausdorff, directed_hausdorff, deviation and wedges against known answers."""

import numpy as np
import pytest
import tolvol

import meshes


def raised(mesh, height):
    return mesh[0] + [0, 0, height], mesh[1]


def test_parallel_plates():
    result = tolvol.directed_hausdorff(*raised(meshes.plate(9), 0.25), *meshes.plate(5))
    assert result.lower <= 0.25 <= result.upper
    assert result.upper - result.lower <= 0.001 * result.upper
    assert result.position[2] == pytest.approx(0.25)


def test_the_two_directions_differ():
    whole, half = meshes.plate(9), meshes.plate(9, side=0.5)
    there = tolvol.directed_hausdorff(*whole, *half)
    back = tolvol.directed_hausdorff(*half, *whole)
    assert there.lower <= np.sqrt(0.5) <= there.upper
    assert back.upper < 1e-12
    assert there.position == pytest.approx([1, 1, 0], abs=0.02)
    assert 1 in np.round(whole[0][whole[1][there.triangle]].max(0)[:2], 6)


def test_hausdorff_is_the_larger_one_of_the_two_directions():
    whole, half = meshes.plate(9), meshes.plate(9, side=0.5)
    for a, b in ((whole, half), (half, whole)):
        both = tolvol.hausdorff(*a, *b)
        ways = tolvol.directed_hausdorff(*a, *b), tolvol.directed_hausdorff(*b, *a)
        for found, alone in zip((both.forward, both.backward), ways):
            assert (found.lower, found.upper, found.position, found.triangle) == (
                (alone.lower, alone.upper, alone.position, alone.triangle)
            )
        assert both.lower == max(way.lower for way in ways) <= np.sqrt(0.5)
        assert both.upper == max(way.upper for way in ways) >= np.sqrt(0.5)
    assert tolvol.hausdorff(*half, *whole, bound=0.3).lower > 0.3


def test_concentric_spheres():
    outer, inner = meshes.sphere(5, 1.1), meshes.sphere(5, 1.0)
    result = tolvol.directed_hausdorff(*outer, *inner)
    # A sphere of edge length e sags by less than e ** 2 / 4 here.
    sag = (np.pi / 2 / 2**5) ** 2 / 4
    assert 0.1 - 1e-9 <= result.upper and result.lower <= 0.1 + 2 * sag


def test_against_brute_force():
    rng = np.random.default_rng(6)
    for _ in range(5):
        a, b = rng.standard_normal((2, 30, 3))
        ta, tb = rng.integers(0, 30, (2, 20, 3)).astype(np.int32)
        result = tolvol.directed_hausdorff(a, ta, b, tb)
        weights = rng.dirichlet([0.5, 0.5, 0.5], 300)
        samples = np.concatenate([weights @ a[t] for t in ta])
        # No sample of b is nearer than b itself, so the distance to dense samples is an upper bound of the true distance.
        dense = np.concatenate([rng.dirichlet([0.7, 0.7, 0.7], 2000) @ b[t] for t in tb])
        reach = max(np.sqrt(((dense - p) ** 2).sum(1).min()) for p in samples[::20])
        assert result.upper <= max(reach, result.lower) * 1.15
        exact = tolvol.ToleranceVolume(b, tb, 0.1 * tolvol.diagonal(b, tb)).distance(samples)
        assert exact.max() <= result.upper
        assert exact.max() >= 0.8 * result.lower


def test_bound_decides():
    a, b = raised(meshes.plate(9), 0.25), meshes.plate(9)
    assert tolvol.directed_hausdorff(*a, *b, bound=0.2500001).upper <= 0.2500001
    assert tolvol.directed_hausdorff(*a, *b, bound=0.2499999).lower > 0.2499999


def test_identical_and_subdivided_surfaces_are_at_zero():
    vertices, triangles = meshes.torus()
    assert tolvol.directed_hausdorff(vertices, triangles, vertices, triangles).upper < 1e-12
    fine = meshes.subdivide(vertices, triangles)
    assert tolvol.directed_hausdorff(*fine, vertices, triangles).upper < 1e-12


def test_segments_and_points_count():
    plate = meshes.plate(5)
    segment = np.array([[0.5, 0.5, 0], [0.5, 0.5, 2]]), np.array([[0, 1, 1]], np.int32)
    point = np.array([[0.5, 0.5, -3.0]]), np.array([[0, 0, 0]], np.int32)
    assert tolvol.directed_hausdorff(*segment, *plate).upper == pytest.approx(2, rel=0.01)
    assert tolvol.directed_hausdorff(*point, *plate).lower == pytest.approx(3, rel=0.01)
    assert tolvol.directed_hausdorff(*plate, *point).upper == pytest.approx(np.sqrt(9.5), rel=0.011)


def test_directed_hausdorff_gives_the_same_on_any_number_of_threads():
    a, b = meshes.torus(noise=0.003), meshes.torus()
    results = [tolvol.directed_hausdorff(*a, *b, threads=n) for n in (1, 2, 3)]
    assert len({(r.lower, r.upper, tuple(r.position), r.triangle) for r in results}) == 1


def test_deviation_of_parallel_plates():
    result = tolvol.deviation(*raised(meshes.plate(9), 0.25), *meshes.plate(5), bounds=(0.1, 0.2499, 0.2501))
    assert result.mean == pytest.approx(0.25) and result.rms == pytest.approx(0.25)
    assert list(result.share_beyond) == pytest.approx([1, 1, 0])
    assert result.spacing > 0


def test_deviation_weighs_by_area():
    # A plate of area 1 at distance 0 in 2048 triangles, and one of area 4 at distance 1 in two.
    large = meshes.plate(2, side=2)
    vertices, triangles = meshes.join(meshes.plate(33), (large[0] + [0, 0, 1], large[1]))
    result = tolvol.deviation(vertices, triangles, *meshes.plate(2, side=2), bounds=(0.5,))
    assert result.mean == pytest.approx(0.8, rel=0.01)
    assert result.rms == pytest.approx(np.sqrt(0.8), rel=0.01)
    assert result.share_beyond[0] == pytest.approx(0.8, rel=0.01)


def test_deviation_of_a_tilted_plate():
    # The heights are spread evenly from 0 to 1: their mean is 1/2, the root mean square 1/sqrt(3), and a quarter is beyond
    # 3/4. The plate below is so wide that every closest point is straight below.
    vertices, triangles = meshes.plate(2)
    vertices[:, 2] = vertices[:, 0]
    floor = meshes.plate(2, side=9)
    result = tolvol.deviation(vertices, triangles, floor[0] - [4, 4, 0], floor[1], bounds=(0.75,))
    assert result.mean == pytest.approx(1 / 2, rel=0.01)
    assert result.rms == pytest.approx(1 / np.sqrt(3), rel=0.01)
    assert result.share_beyond[0] == pytest.approx(0.25, abs=0.01)


def test_deviation_ranges_hold_the_truth():
    vertices, triangles = meshes.plate(9)
    vertices[:, 2] = vertices[:, 0]
    floor = meshes.plate(2, side=9)
    result = tolvol.deviation(
        vertices, triangles, floor[0] - [4, 4, 0], floor[1], bounds=(0.25, 0.75), percentiles=(50, 90, 99.9)
    )
    for value, (lower, upper), truth in (
        (result.mean, result.mean_range, 1 / 2),
        (result.rms, result.rms_range, 1 / np.sqrt(3)),
        *zip(result.share_beyond, result.share_beyond_range, (0.75, 0.25)),
        *zip(result.percentiles, result.percentiles_range, (0.5, 0.9, 0.999)),
    ):
        assert lower - 1e-12 <= truth <= upper + 1e-12 and lower <= value <= upper
        assert value == pytest.approx(truth, abs=0.001) and upper - lower < 0.02
    assert abs(result.mean - 1 / 2) <= 3 * result.mean_error < 1e-4
    assert result.sides is None and result.distances.min() >= 0
    assert result.weights.sum() == pytest.approx(1) and len(result.weights) == len(result.distances)
    assert (result.weights * result.distances).sum() == pytest.approx(result.mean, abs=1e-4)


def test_deviation_of_a_closed_reference_has_sides():
    # A plate goes through a torus. Outside are a disc of the hole's radius and the part of the plate beyond the ring.
    torus = meshes.torus(48, 24)
    vertices, triangles = meshes.plate(33, side=3.0)
    result = tolvol.deviation(vertices - [1.5, 1.5, 0], triangles, *torus)
    ring = np.pi * (1.4**2 - 0.6**2) / 9
    lower, upper = result.sides.share_inside_range
    assert lower <= result.sides.share_inside <= upper
    assert result.sides.share_inside == pytest.approx(ring, abs=0.005)
    assert result.sides.inside[0] <= 0.4 and result.sides.inside[1] >= 0.39
    farthest = np.hypot(1.5, 1.5) - 1.4
    assert result.sides.outside[0] <= farthest + 0.01 and result.sides.outside[1] >= farthest
    assert result.distances.min() == pytest.approx(-0.4, abs=0.01)
    assert result.sides.mean_range[0] <= result.sides.mean <= result.sides.mean_range[1]
    # The samples alone are a less exact estimate.
    assert result.sides.mean == pytest.approx((result.weights * result.distances).sum(), rel=1e-3)
    turned = tolvol.deviation(vertices - [1.5, 1.5, 0], triangles, torus[0], torus[1][:, ::-1])
    assert turned.sides.share_inside == pytest.approx(result.sides.share_inside, abs=1e-3)


def test_a_far_corner_of_the_other_mesh_widens_no_range():
    vertices, triangles = meshes.sphere(3)
    for far in (1e19, 1e300):
        other = vertices.copy()
        other[7] = [far, 0, 0]
        largest = tolvol.directed_hausdorff(vertices, triangles, other, triangles)
        assert largest.upper - largest.lower <= 0.001 * largest.upper < 0.001
        found = tolvol.deviation(vertices, triangles, other, triangles)
        lower, upper = found.mean_range
        assert lower <= found.mean <= upper <= lower + 0.001 * largest.upper
        assert found.mean < largest.upper and np.abs(found.distances).max() <= largest.upper


def test_a_far_corner_of_the_mesh_itself_counts_for_its_size():
    vertices, triangles = meshes.sphere(2)
    far = vertices.copy()
    far[7] = [1e19, 0, 0]
    found = tolvol.directed_hausdorff(far, triangles, far, triangles)
    assert found.lower == 0 < found.upper <= 1e5
    both = tolvol.hausdorff(vertices, triangles, far, triangles)
    assert both.forward.upper < 1 and 1e19 * (1 - 1e-3) <= both.lower <= both.backward.upper <= 1e19 * (1 + 1e-3)


def test_deviation_refuses_percentiles_that_are_none():
    with pytest.raises(tolvol.InvalidInput, match="percentile 1 is not between 0 and 100"):
        tolvol.deviation(*meshes.plate(3), *meshes.plate(3), percentiles=(50, 101))


def test_deviation_gives_the_same_on_any_number_of_threads():
    a, b = meshes.torus(noise=0.003), meshes.torus()
    results = [tolvol.deviation(*a, *b, bounds=(0.002,), threads=n) for n in (1, 3)]
    assert len({(r.mean, r.rms, r.share_beyond[0]) for r in results}) == 1


def test_wedges_part_corners_whose_values_differ():
    vertices, triangles = meshes.plate(9)
    uv = vertices[:, :2].astype(np.float32)[triangles]
    whole = tolvol.wedges(triangles, uv)
    assert whole.dtype == np.int32 and whole.shape == triangles.shape
    assert len(np.unique(whole)) == len(vertices)
    right = vertices[triangles].mean(1)[:, 0] > 0.5
    cut = uv.copy()
    cut[right] += np.float32(2)
    parted = tolvol.wedges(triangles, cut)
    assert len(np.unique(parted)) == len(vertices) + 9
    pairs = {}
    for vertex, value, label in zip(triangles.ravel(), map(tuple, cut.reshape(-1, 2)), parted.ravel()):
        assert pairs.setdefault((vertex, value), label) == label


def test_wedges_of_several_layers_differ_when_one_does():
    triangles = np.array([[0, 1, 2], [2, 1, 3]], np.int32)
    corners = np.zeros((2, 3, 4), np.float32)
    assert len(np.unique(tolvol.wedges(triangles, corners))) == 4
    corners[1, 0, 3] = 1e-30
    assert len(np.unique(tolvol.wedges(triangles, corners))) == 5
