# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol.ToleranceVolume: its attributes, exact distances and verdicts."""

import numpy as np
import pytest
import tolvol

import meshes

OUTSIDE, UNPROVED, INSIDE = tolvol.Verdict
PLATE = meshes.plate(9)


def test_size_is_the_longest_diagonal_after_to_world():
    vertices, triangles = meshes.box((0, 0, 0), (1, 2, 3))
    assert tolvol.diagonal(vertices, triangles) == pytest.approx(np.sqrt(14))
    # Sheared along x by y: of the four diagonals (1 + s, 2, 3) with s = 2 is the longest.
    shear = meshes.matrix([[1, 1, 0], [0, 1, 0], [0, 0, 1]])
    assert tolvol.diagonal(vertices, triangles, to_world=shear) == pytest.approx(np.sqrt(9 + 4 + 9))
    turned = meshes.matrix(meshes.random_rotation(), (100, 0, 0))
    assert tolvol.diagonal(vertices, triangles, to_world=turned) == pytest.approx(np.sqrt(14))
    lonely = np.concatenate([vertices, [[50, 50, 50]]])
    assert tolvol.diagonal(lonely, triangles) == pytest.approx(np.sqrt(14))


def test_attributes():
    vertices, triangles = meshes.degenerate()
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.05)
    assert volume.tolerance == 0.05
    assert volume.diagonal == tolvol.diagonal(vertices, triangles)
    assert volume.triangle_count == len(triangles)
    assert volume.vertex_count == len(vertices)
    assert volume.spacing == pytest.approx(0.05 / volume.precision)
    assert volume.memory > volume.grid()[0].size * 4
    assert volume.seconds > 0


@pytest.mark.parametrize("precision", [0.5, 1, 4])
def test_precision_sets_the_spacing(precision):
    volume = tolvol.ToleranceVolume(*PLATE, 0.1, precision=precision)
    assert volume.precision == pytest.approx(precision)
    assert volume.spacing == pytest.approx(0.1 / precision)


def test_precision_falls_by_itself_so_that_a_small_tolerance_fits():
    vertices, triangles = meshes.torus()
    usual = tolvol.ToleranceVolume(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles)).precision
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.0005 * tolvol.diagonal(vertices, triangles))
    assert volume.precision < usual
    assert volume.memory < 300e6
    with pytest.raises(tolvol.ResourceLimit, match=r"precision \S+ fits"):
        tolvol.ToleranceVolume(vertices, triangles, volume.tolerance, precision=usual)


@pytest.mark.parametrize("to_world", [None, meshes.matrix(100 * np.eye(3), (5, 6, 7))], ids=["local", "placed"])
def test_grid_holds_exact_distances(to_world):
    vertices, triangles = meshes.torus(48, 24)
    tolerance = 0.02 * tolvol.diagonal(vertices, triangles, to_world=to_world)
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, to_world=to_world)
    values, origin, spacing, unit = volume.grid()
    assert values.dtype == np.float32 and values.ndim == 3
    assert not values.flags.owndata and not values.flags.writeable
    assert spacing == volume.spacing
    z, y, x = np.unravel_index(np.random.default_rng(1).integers(0, values.size, 3000), values.shape)
    exact = volume.distance(origin + spacing * np.stack([x, y, z], 1))
    band = tolerance + np.sqrt(3) * spacing
    near = exact < 0.999 * band
    assert 100 < near.sum() < 2900
    assert np.allclose(unit * values[z, y, x][near], exact[near], atol=1e-5 * tolerance + 1e-5 * volume.diagonal)
    assert (unit * values[z, y, x][exact > 1.001 * band] >= 0.999 * band).all()


def test_distance_is_exact():
    volume = tolvol.ToleranceVolume(*PLATE, 0.1)
    points = np.array([[0.5, 0.5, 0.3], [0.5, 0.5, -7], [2, 0.5, 0], [-3, -4, 0], [0.25, 0.75, 0]])
    assert volume.distance(points) == pytest.approx([0.3, 7, 1, 5, 0], abs=1e-12)
    assert volume.distance(points.astype(np.float32)).dtype == np.float64
    shifted = meshes.matrix(np.eye(3), (0, 0, 1))
    assert volume.distance(points, to_world=shifted)[0] == pytest.approx(1.3)
    assert np.array_equal(volume.distance(points, threads=1), volume.distance(points, threads=3))
    assert volume.distance(np.empty((0, 3))).shape == (0,)


def test_verdicts_on_both_sides_of_the_tolerance():
    volume = tolvol.ToleranceVolume(*PLATE, 0.1)
    corners = np.array([[0.2, 0.2, 0], [0.8, 0.3, 0], [0.4, 0.9, 0]])
    heights = np.array([0, 0.05, 0.0999, 0.1001, 0.3])
    points = (corners[None] + heights[:, None, None] * [0, 0, 1]).reshape(-1, 3)
    result = volume.check(points, np.arange(len(points), dtype=np.int32).reshape(-1, 3))
    assert result.verdicts.dtype == np.uint8
    assert result.verdicts.tolist() == [INSIDE, INSIDE, INSIDE, OUTSIDE, OUTSIDE]
    assert result.method == "certificate" and result.renderer


@pytest.mark.parametrize("corners", [1, 2, 3, 4])
def test_pieces_of_one_to_four_corners(corners):
    volume = tolvol.ToleranceVolume(*PLATE, 0.1)
    angle = 2 * np.pi * np.arange(corners) / corners
    ring = np.stack([0.5 + 0.3 * np.cos(angle), 0.5 + 0.3 * np.sin(angle), 0.05 * (-1.0) ** np.arange(corners)], 1)
    lifted = ring.copy()
    lifted[-1, 2] = 0.2
    points = np.concatenate([ring, lifted])
    verdict = volume.check(points, np.arange(2 * corners, dtype=np.int32).reshape(2, corners)).verdicts
    assert verdict.tolist() == [INSIDE, OUTSIDE]


def test_a_piece_over_a_hole_is_outside_though_its_corners_are_inside():
    left, right = meshes.plate(9), meshes.plate(9)
    vertices, triangles = meshes.join(left, (right[0] + [2, 0, 0], right[1]))
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.1)
    bridge = np.array([[0.9, 0.5, 0], [2.1, 0.5, 0], [2.1, 0.6, 0]])
    face = np.array([[0, 1, 2]], np.int32)
    assert (volume.distance(bridge) == 0).all()
    assert volume.check(bridge, face).verdicts.tolist() == [OUTSIDE]


def test_groups_take_the_least_verdict_of_their_pieces():
    volume = tolvol.ToleranceVolume(*PLATE, 0.1)
    points = np.array([[0.5, 0.5, 0], [0.5, 0.5, 0.5], [0.2, 0.2, 0.01]])
    faces = np.array([[0], [1], [2]], np.int32)
    assert volume.check(points, faces).verdicts.tolist() == [INSIDE, OUTSIDE, INSIDE]
    groups = np.array([7, 7, -1], np.int32)
    assert volume.check(points, faces, groups=groups).verdicts.tolist() == [OUTSIDE, OUTSIDE, INSIDE]


def test_to_world_of_a_check_is_used():
    volume = tolvol.ToleranceVolume(*PLATE, 0.1)
    face = np.array([[0, 1, 8]], np.int32)
    lift = meshes.matrix(np.eye(3), (0, 0, 0.2))
    assert volume.check(PLATE[0], face).verdicts.tolist() == [INSIDE]
    assert volume.check(PLATE[0], face, to_world=lift).verdicts.tolist() == [OUTSIDE]


@pytest.mark.parametrize("name", ["torus", "needles", "far"])
def test_no_wrong_verdict_on_candidates_about_the_tolerance(name):
    vertices, triangles = {
        "torus": meshes.torus(48, 24),
        "needles": meshes.needles(levels=3, height=1e-4),
        "far": (meshes.torus(48, 24)[0] + [1e3, -2e3, 3e3], meshes.torus(48, 24)[1]),
    }[name]
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    rng = np.random.default_rng(2)
    count = 600
    corner = vertices[triangles[rng.integers(0, len(triangles), count)]].mean(1)
    length = tolerance * 10 ** rng.uniform(-1, 1, (count, 1, 1))
    points = corner[:, None] + length * rng.standard_normal((count, 3, 3)) * [1, 1, 0.2]
    faces = np.arange(3, dtype=np.int32)[None]
    verdict = volume.check(points.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)).verdicts
    assert {INSIDE, OUTSIDE} <= set(verdict.tolist())
    for piece, said in zip(points, verdict):
        truth = tolvol.directed_hausdorff(piece, faces, vertices, triangles, bound=tolerance)
        if said == INSIDE:
            assert truth.lower <= tolerance
        if said == OUTSIDE:
            assert truth.upper > tolerance


def test_check_gives_the_same_on_any_number_of_threads():
    vertices, triangles = meshes.torus(48, 24)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.02)
    moved = vertices + 0.015 * np.random.default_rng(3).standard_normal(vertices.shape)
    verdicts = [volume.check(moved, triangles, threads=n).verdicts for n in (1, 2, 3)]
    assert len(np.unique(verdicts[0])) > 1
    assert np.array_equal(verdicts[0], verdicts[1]) and np.array_equal(verdicts[0], verdicts[2])
    grids = [tolvol.ToleranceVolume(vertices, triangles, 0.02, threads=n).grid()[0] for n in (1, 2, 3)]
    assert np.array_equal(grids[0], grids[1]) and np.array_equal(grids[0], grids[2])


CLASSES = [c for c in vars(tolvol).values() if isinstance(c, type) and not issubclass(c, (Exception, int))]


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_an_object_that_was_never_initialised_is_a_type_error(kind):
    empty = kind.__new__(kind)
    read_by_the_object = [n for n, value in vars(kind).items() if type(value) is property]
    for name in read_by_the_object:
        with pytest.raises(TypeError, match="never initialised"):
            getattr(empty, name)


def test_far_is_outside_and_only_not_finite_is_invalid():
    vertices, triangles = meshes.torus(24, 12)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.05)
    points = np.array([[1.4, 0, 0], [1e19, 0, 0], [1.7e308, 1.7e308, 0], [-1.7e308, -1.7e308, 0]])
    assert volume.check(points, np.arange(4)[:, None]).verdicts.tolist() == [2, 0, 0, 0]
    assert volume.check(points, np.array([[0, 0], [0, 1], [2, 3]])).verdicts.tolist() == [2, 0, 0]
    assert volume.distance(points)[1] == pytest.approx(1e19)
    assert np.isinf(volume.distance(points)[2:]).all()
    small = tolvol.ToleranceVolume(vertices * 1e-6, triangles, 0.05e-6)
    assert small.check(points[2:], np.arange(2)[:, None]).verdicts.tolist() == [0, 0]
    assert small.distance(np.array([[1.7e308, 0, 0]])) == pytest.approx(1.7e308)
    for bad in (np.nan, np.inf):
        broken = np.array([[0, bad, 0]])
        with pytest.raises(tolvol.InvalidInput, match="point 0 is not finite"):
            volume.check(broken, np.array([[0]]))
        with pytest.raises(tolvol.InvalidInput, match="point 0 is not finite"):
            volume.distance(broken)


def test_a_hundred_thousand_threads_are_as_good_as_those_there_are():
    vertices, triangles = meshes.torus(24, 12)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.05, threads=100_000)
    assert tolvol.directed_hausdorff(vertices, triangles, vertices, triangles, threads=100_000).upper < volume.tolerance


@pytest.mark.parametrize(("distance", "verdict"), [(0.999, INSIDE), (1.001, OUTSIDE)])
def test_a_piece_near_the_limit_where_the_nearest_triangle_changes_within_it(distance, verdict):
    """Two faces cross like an X, and a candidate lies above the crossing: no edge tells where to cut the candidate."""
    corners = [[-4, -9, -4], [4, -9, 4], [0, 20, 0], [4, -9, -4], [-4, -9, 4], [0, 20, 0]]
    volume = tolvol.ToleranceVolume(np.array(corners, float), np.array([[0, 1, 2], [3, 4, 5]], np.int32), 1.0)
    height = distance * np.sqrt(2)
    piece = np.array([[-0.4, -0.5, height], [0.4, -0.5, height], [0.1, 0.6, height]])
    assert volume.check(piece, np.array([[0, 1, 2]], np.int32)).verdicts[0] == verdict


def test_the_memory_of_a_grid_is_as_asked():
    """The rest of a volume, and what it proves, do not depend on it."""
    mesh = meshes.torus(60, 30)
    sizes = [tolvol.ToleranceVolume(*mesh, 0.004, grid_memory=memory).memory for memory in (0, 2**20, 2**28, 2**29)]
    assert sizes == sorted(sizes) and sizes[1] < sizes[0] + 2**20 and sizes[3] > sizes[0] + 2**28
    with pytest.raises(tolvol.InvalidInput, match="grid_memory"):
        tolvol.ToleranceVolume(*mesh, 0.004, grid_memory=-1)
