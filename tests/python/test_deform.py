# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol.deform, Lattice and lattice_points: compared with the formula, and judged by tolvol.hausdorff on the result."""

from math import comb

import numpy as np
import pytest
import tolvol

import meshes

TORUS = meshes.torus(64, 32)
AROUND = meshes.matrix(np.diag([3.2, 3.2, 1.2]), (-1.6, -1.6, -0.6))


def bent(amount=0.05, shape=(4, 4, 4), domain=AROUND, seed=1, **options):
    rest = tolvol.lattice_points(shape, domain)
    points = rest + np.random.default_rng(seed).uniform(-amount, amount, rest.shape)
    return tolvol.Lattice(points, domain, **options)


def lifted(height, domain=AROUND):
    return tolvol.Lattice(tolvol.lattice_points(4, domain) + [0, 0, height], domain)


@pytest.fixture(scope="module")
def volume():
    return tolvol.ToleranceVolume(*TORUS, 0.05)


def judged(before, after, triangles, to_world=None, bound=None):
    m = np.eye(4) if to_world is None else to_world
    return tolvol.hausdorff(
        meshes.transform(m, after), triangles, meshes.transform(m, before), triangles, bound=bound
    ).upper


def test_lattice_points_are_the_grid_of_the_domain():
    points = tolvol.lattice_points((2, 3, 5), AROUND)
    assert points.shape == (2, 3, 5, 3) and points.dtype == np.float64
    i, j, k = np.indices((2, 3, 5))
    expected = np.stack([i / 1, j / 2, k / 4], -1) * [3.2, 3.2, 1.2] + [-1.6, -1.6, -0.6]
    assert np.allclose(points, expected, rtol=0, atol=1e-15)
    assert np.array_equal(tolvol.lattice_points(3), tolvol.lattice_points((3, 3, 3), np.eye(4)))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_at_rest_every_vertex_stays_bit_for_bit(dtype):
    vertices = TORUS[0].astype(dtype)
    knots = [None, [0, 0, 0, 0.1, 0.7, 1, 1, 1], None]
    lattice = tolvol.Lattice(
        tolvol.lattice_points((4, 5, 6), AROUND),
        AROUND,
        degree=(3, 2, 2),
        knots=[k if k is None else np.array(k) for k in knots],
    )
    assert lattice.shape == (4, 5, 6) and lattice.degree == (3, 2, 2)
    result = tolvol.deform(vertices, lattice)
    assert result.vertices.dtype == dtype and np.array_equal(result.vertices, vertices)
    assert result.report["moved"] == 0 and result.report["largest_motion"] == 0


def test_bernstein_with_weights_is_the_direct_formula():
    shape = (4, 3, 5)
    rng = np.random.default_rng(2)
    points = tolvol.lattice_points(shape, AROUND) + rng.normal(0, 0.2, (*shape, 3))
    weights = rng.uniform(0.2, 3, shape)
    lattice = tolvol.Lattice(points, AROUND, degree=tuple(n - 1 for n in shape), weights=weights)
    vertices = TORUS[0]
    x = (vertices + [1.6, 1.6, 0.6]) / [3.2, 3.2, 1.2]
    basis = [
        np.stack([comb(n - 1, i) * x[:, a] ** i * (1 - x[:, a]) ** (n - 1 - i) for i in range(n)], 1)
        for a, n in enumerate(shape)
    ]
    share = np.einsum("ni,nj,nk,ijk->nijk", *basis, weights)
    expected = np.einsum("nijk,ijkd->nd", share, points) / share.sum((1, 2, 3))[:, None]
    assert np.abs(tolvol.deform(vertices, lattice).vertices - expected).max() < 1e-14 * 5


def test_degree_weights_and_knots_matter():
    vertices = TORUS[0]
    plain = tolvol.deform(vertices, bent(shape=(5, 5, 5))).vertices
    knots = np.array([0, 0, 0, 0, 0.2, 1, 1, 1, 1])
    weights = np.ones((5, 5, 5))
    weights[2, 3, 2] = 5
    for options in ({"degree": 2}, {"degree": (3, 3, 1)}, {"knots": (None, None, knots)}, {"weights": weights}):
        other = tolvol.deform(vertices, bent(shape=(5, 5, 5), **options)).vertices
        assert 1e-4 < np.abs(other - plain).max() < 0.3, options
    uniform = np.array([0, 0, 0, 0, 0.5, 1, 1, 1, 1])
    same = bent(shape=(5, 5, 5), degree=3, knots=(uniform, None, 7 * uniform - 3), weights=np.full((5, 5, 5), 8))
    assert np.abs(tolvol.deform(vertices, same).vertices - plain).max() < 1e-14


def test_the_lattice_is_in_the_world():
    turn = meshes.matrix(meshes.random_rotation() @ np.diag([1, 2, -0.5]), (30, 20, 10))
    vertices = meshes.transform(np.linalg.inv(turn), TORUS[0])
    placed = tolvol.deform(vertices, bent(), to_world=turn)
    plain = tolvol.deform(TORUS[0], bent())
    assert np.abs(meshes.transform(turn, placed.vertices) - plain.vertices).max() < 1e-13
    assert placed.report["largest_motion"] == pytest.approx(plain.report["largest_motion"])


def test_outside_of_the_lattice_nothing_moves():
    half = meshes.matrix(np.diag([1.6, 3.2, 1.2]), (-1.6, -1.6, -0.6))
    result = tolvol.deform(TORUS[0], lifted(0.2, half))
    moved = (result.vertices != TORUS[0]).any(1)
    assert np.array_equal(moved, TORUS[0][:, 0] < 1e-5)
    assert result.report["moved"] == moved.sum()
    assert result.report["outside_lattice"] == (~moved).sum()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("mode", ["blocked", "farthest", "pull_back"])
def test_inside_it_is_carried_out_whole(volume, mode, dtype):
    vertices, triangles = TORUS[0].astype(dtype), TORUS[1]
    result = tolvol.deform(vertices, bent(), triangles, volume, mode=mode)
    assert np.array_equal(result.vertices, tolvol.deform(vertices, bent()).vertices)
    assert result.report["permitted_fraction"] == 1 and result.report["moved"] == len(vertices)
    assert (result.report["method"], result.report["renderer"]) == ("certificate", "CPU")
    assert judged(*[TORUS[0], result.vertices], triangles, bound=0.05) <= 0.05


def test_blocked_and_as_far_as_permitted(volume):
    vertices, triangles = TORUS
    # No fraction that is tried leads to the tolerance itself, which takes seconds to be found neither inside nor outside.
    height = 0.19
    lift = lifted(height)
    blocked = tolvol.deform(vertices, lift, triangles, volume)
    assert np.array_equal(blocked.vertices, vertices)
    assert 0.05 / height - 0.001 <= blocked.report["permitted_fraction"] <= 0.05 / height
    verdict = volume.check(tolvol.deform(vertices, lift).vertices, triangles).verdicts
    assert blocked.report["leaving"] == {
        "faces": (verdict < tolvol.Verdict.INSIDE).sum(),
        "first": np.argmax(verdict < tolvol.Verdict.INSIDE),
    }
    assert blocked.report["held_back"] == len(vertices)
    farthest = tolvol.deform(vertices, lift, triangles, volume, mode="farthest")
    assert farthest.report["permitted_fraction"] == blocked.report["permitted_fraction"]
    raised = height * blocked.report["permitted_fraction"]
    assert np.allclose(farthest.vertices - vertices, [0, 0, raised], rtol=0, atol=1e-15)
    assert 0.95 * 0.05 < judged(vertices, farthest.vertices, triangles, bound=0.05) <= 0.05


@pytest.mark.parametrize("seed", range(6))
def test_hostile_meshes_stay_within_as_stored(seed):
    spike, rod = meshes.spike(levels=4), meshes.rod(levels=4)
    mesh = [meshes.needles(), meshes.non_manifold(), meshes.degenerate(), spike, rod, meshes.misoriented()][seed]
    to_world = meshes.matrix(meshes.random_rotation(seed) @ np.diag([1, 30, 0.2]), (100, 0, 0))
    vertices, triangles = mesh[0].astype(np.float32), mesh[1]
    world = meshes.transform(to_world, vertices[np.unique(triangles)])
    low, size = world.min(0), np.ptp(world, axis=0)
    domain = meshes.matrix(np.diag(size * 1.1), low - 0.05 * size)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles, to_world=to_world)
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, to_world=to_world)
    lattice = bent(tolerance * 12, domain=domain, seed=seed)
    result = tolvol.deform(vertices, lattice, triangles, volume, to_world=to_world, mode="farthest")
    assert result.vertices.dtype == np.float32
    pulled = tolvol.deform(vertices, lattice, triangles, volume, to_world=to_world, mode="pull_back")
    assert 0 < result.report["permitted_fraction"] < 1 and 0 < pulled.report["held_back"]
    assert judged(vertices, pulled.vertices, triangles, to_world, tolerance) <= tolerance
    assert judged(vertices, result.vertices, triangles, to_world, tolerance) <= tolerance


def test_pulled_back_each_vertex_goes_as_far_as_it_may(volume):
    vertices, triangles = TORUS
    wish = tolvol.deform(vertices, lifted(0.2)).vertices
    pulled = tolvol.deform(vertices, lifted(0.2), triangles, volume, mode="pull_back")
    assert np.array_equal(pulled.vertices, tolvol.constrain(vertices, wish, triangles, volume).vertices)
    assert pulled.report["permitted_fraction"] is None and pulled.report["leaving"]["faces"] > 0
    assert pulled.report["held_back"] == (pulled.vertices != wish).any(1).sum()
    assert judged(vertices, pulled.vertices, triangles, bound=0.05) <= 0.05


def test_what_is_outside_to_begin_with_can_be_kept(volume):
    vertices, triangles = TORUS[0].copy(), TORUS[1]
    vertices[40] *= 1.3
    outside = volume.check(vertices, triangles).verdicts < tolvol.Verdict.INSIDE
    kept = tolvol.deform(vertices, lifted(0.02), triangles, volume, outside="keep")
    assert kept.report["outside"] == {"faces": outside.sum(), "first": outside.argmax(), "reference_faces": 6}
    frozen = np.unique(triangles[outside])
    assert np.array_equal(kept.vertices[frozen], vertices[frozen]) and kept.report["held_back"] == len(frozen)
    assert kept.report["moved"] == len(vertices) - len(frozen)


def test_quads_are_kept_in_every_triangulation():
    # A roof: its ridge is one diagonal of the square, the other diagonal would be a valley.
    vertices = np.array([[0, 0, 0.3], [1, 0, 0], [1, 1, 0.3], [0, 1, 0]])
    volume = tolvol.ToleranceVolume(vertices, np.array([[0, 1, 2], [0, 2, 3]]), 0.1)
    lattice = lifted(0.05)
    inside = tolvol.deform(vertices, lattice, np.array([[0, 1, 2], [0, 2, 3]]), volume)
    assert inside.report["permitted_fraction"] == 1
    with pytest.raises(tolvol.InvalidInput, match="1 faces are not within the tolerance"):
        tolvol.deform(vertices, lattice, np.array([[0, 1, 2, 3]]), volume)


def test_threads_do_not_change_the_result(volume):
    one, three = (
        tolvol.deform(TORUS[0], bent(0.5), TORUS[1], volume, mode="farthest", threads=threads) for threads in (1, 3)
    )
    assert np.array_equal(one.vertices, three.vertices) and one.report["permitted_fraction"] < 1


# Refused ------------------------------------------------------------------------------------------------------------

REST = tolvol.lattice_points(4)


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((REST.tolist(),), {}, "points must be a NumPy array"),
        ((REST[0],), {}, r"points must have shape \(nu, nv, nw, 3\)"),
        ((REST.astype(complex),), {}, "points must be numbers"),
        ((REST[:1, :1, :1],), {}, "at least 2 control points along each axis; along u it has 1"),
        ((REST[:, :, :0],), {}, "along w it has 0"),
        ((np.where(REST == 1, np.nan, REST),), {}, r"control point \(0, 0, 3\) is not finite"),
        ((REST,), {"degree": 4}, "degree along u must be from 1 to 3 for 4 control points, not 4"),
        ((REST,), {"degree": (3, 3, 0)}, "degree along w"),
        ((REST,), {"degree": -1}, "degree is out of range: -1"),
        ((REST,), {"degree": (3, 3)}, "degree must be an integer, or three"),
        ((REST,), {"degree": 2.5}, "degree must be an integer, or three"),
        ((REST,), {"weights": np.zeros((4, 4, 4))}, r"weight of control point \(0, 0, 0\) is 0"),
        ((REST,), {"weights": np.full((4, 4, 4), -1)}, "weights must be positive and finite"),
        ((REST,), {"weights": np.ones((4, 4))}, "weights must have one value for each control point"),
        ((REST,), {"knots": (None, None)}, "knots must be three"),
        ((REST,), {"knots": (None, np.arange(5.0), None)}, "knots along v must be 8"),
        ((REST,), {"knots": (np.arange(8), None, None)}, "knots along u must be clamped"),
        ((REST, np.eye(3)), {}, r"domain must have shape \(4, 4\), not \(3, 3\)"),
        ((REST, np.diag([1.0, 0, 1, 1])), {}, "three independent edges"),
        ((REST, np.full((4, 4), np.nan)), {}, "three independent edges"),
    ],
)
def test_bad_lattices_are_refused(arguments, options, message):
    with pytest.raises(tolvol.InvalidInput, match=message):
        tolvol.Lattice(*arguments, **options)


def test_bad_arguments_are_refused(volume):
    vertices, triangles = TORUS
    lattice = bent()

    def refused(match, *arguments, **options):
        with pytest.raises(tolvol.InvalidInput, match=match):
            tolvol.deform(*arguments, **options)

    refused(r"vertices must have shape \(n, 3\)", vertices[:, :2], lattice)
    broken = vertices.copy()
    broken[7, 1] = np.inf
    refused("vertex 7 is not finite", broken, lattice)
    refused("with a volume faces are needed", vertices, lattice, volume=volume)
    refused("no faces", vertices, lattice, triangles[:0], volume)
    refused("face 2014 uses vertex 2047, but there are only 2047", vertices[:-1], lattice, triangles, volume)
    refused('mode must be "blocked"', vertices, lattice, triangles, volume, mode="push")
    refused('outside must be "error" or "keep"', vertices, lattice, triangles, volume, outside="ignore")
    refused("threads must be at least 1", vertices, lattice, threads=0)
    refused("too far to be stored", vertices.astype(np.float32), lifted(1e39))
    with pytest.raises(tolvol.InvalidInput, match="needs at least 2"):
        tolvol.lattice_points((4, 1, 4))


def test_a_mesh_that_is_outside_already_is_refused(volume):
    vertices, triangles = TORUS[0].copy(), TORUS[1]
    vertices[40] *= 1.3
    outside = volume.check(vertices, triangles).verdicts < tolvol.Verdict.INSIDE
    message = (
        f"^{outside.sum()} faces are not within the tolerance of the reference, the first is face {outside.argmax()};"
    )
    for mode in ("blocked", "farthest", "pull_back"):
        with pytest.raises(tolvol.InvalidInput, match=message):
            tolvol.deform(vertices, bent(), triangles, volume, mode=mode)
    # A deformation whose result is inside is not refused.
    back = lifted(-0.2, meshes.matrix(AROUND[:3, :3], AROUND[:3, 3] + [0, 0, 0.2]))
    returned = tolvol.deform(TORUS[0] + [0, 0, 0.2], back, triangles, volume)
    assert np.allclose(returned.vertices, TORUS[0], rtol=0, atol=1e-15) and returned.report["permitted_fraction"] == 1


def test_cancelled(volume):
    progress = tolvol.Progress()
    progress.cancel()
    with pytest.raises(tolvol.Cancelled):
        tolvol.deform(TORUS[0], bent(), TORUS[1], volume, progress=progress)
