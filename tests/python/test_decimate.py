# SPDX-License-Identifier: GPL-3.0-or-later
"""The promise of tolvol.decimate on every kind of mesh."""

import numpy as np
import pytest
import tolvol

import meshes
from judge import assert_promise, assert_sources, decimate, distances

SHEAR = np.array([[1, 0.7, 0.2], [0, 0.6, 0.3], [0, 0, 1.4]])
SOLIDS = {
    "sphere": meshes.sphere(4),
    "torus, noisy": meshes.torus(noise=0.002),
    "plate, open": meshes.plate(33, bump=0.2),
    "box with needles 1e-2": meshes.needles(height=1e-2),
    "box with needles 1e-5": meshes.needles(height=1e-5),
    "box with needles 1e-7": meshes.needles(height=1e-7),
    "soup": meshes.soup(*meshes.torus(64, 32)),
    "non-manifold": meshes.non_manifold(),
    "misoriented": meshes.misoriented(),
    "degenerate": meshes.degenerate(),
    "rod thinner than the tolerance": meshes.rod(levels=4),
}
PLACES = {
    "sheared": meshes.matrix(SHEAR),
    "mirrored": meshes.matrix(meshes.random_rotation() @ np.diag([-1, 1, 1])),
    "stretched": meshes.matrix(np.diag([5, 1, 0.2])),
    "far": meshes.matrix(meshes.random_rotation(), (3e4, -2e4, 1e4)),
    "tiny": meshes.matrix(1e-6 * np.eye(3)),
    "huge": meshes.matrix(1e6 * np.eye(3)),
}


@pytest.mark.parametrize(
    ("placement", "dtype"), [("optimal", np.float32), ("optimal", np.float64), ("subset", np.float64)]
)
@pytest.mark.parametrize("name", SOLIDS)
def test_promise_both_ways(name, placement, dtype):
    vertices, triangles = SOLIDS[name]
    vertices = vertices.astype(dtype)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    result = decimate(vertices, triangles, tolerance, placement=placement)

    assert result.vertices.dtype == dtype
    assert result.triangles.dtype == np.int32
    assert_promise(vertices, triangles, result, tolerance)
    assert_sources(vertices, triangles, result, tolerance)
    distinct = len(np.unique(np.sort(triangles, 1), axis=0))
    assert len(result.triangles) < distinct / 2 or result.report["locked"]
    assert meshes.component_count(result.vertices, result.triangles) == meshes.component_count(vertices, triangles)
    assert result.report["triangles_in"] == len(triangles)
    assert result.report["triangles_out"] == len(result.triangles)


@pytest.mark.parametrize("name", PLACES)
def test_promise_holds_in_the_world(name):
    to_world = PLACES[name]
    vertices, triangles = meshes.torus(64, 32, noise=0.002)
    vertices = vertices.astype(np.float32)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles, to_world=to_world)
    result = decimate(vertices, triangles, tolerance, to_world)
    assert len(result.triangles) < len(triangles) / 4
    assert_promise(vertices, triangles, result, tolerance, to_world)
    assert_sources(vertices, triangles, result, tolerance, to_world)


@pytest.mark.parametrize("scale", [1e-6, 1, 1e6])
def test_stored_coordinates_of_any_scale(scale):
    vertices, triangles = meshes.torus(64, 32, noise=0.002)
    vertices = (scale * vertices).astype(np.float32)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    result = decimate(vertices, triangles, tolerance)
    assert len(result.triangles) < len(triangles) / 4
    assert_promise(vertices, triangles, result, tolerance)


def test_stored_coordinates_far_from_the_origin():
    # Rounding to float32 moves a coordinate by up to 0.001 here, which is 3 % of the tolerance. This causes only a warning.
    vertices, triangles = meshes.torus(64, 32)
    vertices = (vertices + [20000, 0, 0]).astype(np.float32)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    result = decimate(vertices, triangles, tolerance)
    assert_promise(vertices, triangles, result, tolerance)
    assert result.report["warnings"]
    near = vertices - np.float32([20000, 0, 0])
    assert not decimate(near, triangles, tolerance).report["warnings"]


def test_a_degenerate_face_does_not_stand_for_the_face_beside_it():
    vertices, triangles = meshes.plate(19)
    spikes = triangles[::13]
    tips = vertices[spikes].mean(1) + [0, 0, 0.15]
    tip = len(vertices) + np.arange(len(spikes))
    sides = [np.stack([tip, spikes[:, k], spikes[:, (k + 1) % 3]], 1) for k in range(3)]
    flat = [spikes[:, [k, (k + 1) % 3, (k + 1) % 3]] for k in range(3)]
    triangles = np.concatenate([*sides, np.delete(triangles, np.s_[::13], 0), *flat]).astype(np.int32)
    vertices = np.concatenate([vertices, tips])
    for share in (0.01, 0.03):
        tolerance = share * tolvol.diagonal(vertices, triangles)
        assert_promise(vertices, triangles, decimate(vertices, triangles, tolerance), tolerance)


def test_fewer_triangles_at_a_larger_tolerance():
    vertices, triangles = meshes.torus(noise=0.001)
    size = tolvol.diagonal(vertices, triangles)
    counts = [len(decimate(vertices, triangles, share * size).triangles) for share in (0.001, 0.003, 0.01, 0.03)]
    assert counts == sorted(counts, reverse=True) and len(set(counts)) == 4


@pytest.mark.parametrize("precision", [1 / 4, 1 / 8])
def test_a_coarse_grid_leaves_as_few_triangles(precision):
    vertices, triangles = meshes.torus(160, 80, noise=0.002)
    tolerances = tolvol.diagonal(vertices, triangles) * np.linspace(0.0096, 0.0104, 5)

    def left(precision):
        volumes = [tolvol.ToleranceVolume(vertices, triangles, t, precision=precision) for t in tolerances]
        return sum(len(tolvol.decimate(vertices, triangles, volume).triangles) for volume in volumes)

    assert left(precision) <= 1.03 * left(1)


def test_thorough_holds_the_copies_of_a_vertex_that_is_held():
    # Two fans touch at vertex 10. A collapse of one of them into a locked vertex holds the other there, too.
    vertices = np.array(
        [
            (0.171646, 13.116886, 4e-06), (0.085539, 13.733623, 1e-06), (0.25786, 13.730727, 0), (0.430663, 13.741346, -2e-06),
            (-0.000823, 13.732646, -2e-06), (0.087057, 14.362001, -4e-06), (0.171632, 14.35459, 4e-06),
            (0.34503, 14.360299, 1e-06), (0.516348, 14.674249, -1.9e-05), (0.085859, 14.980633, 4e-06),
            (0.171765, 14.982955, -5e-06), (0.429601, 14.985366, 2e-06), (0.171821, 15.606445, -4e-06),
        ]
    )  # fmt: skip
    triangles = np.array(
        [(0, 2, 1), (4, 1, 5), (1, 2, 6), (2, 3, 7), (2, 7, 6), (3, 8, 7), (4, 5, 9), (5, 6, 10), (10, 11, 12), (5, 10, 9)]
    )  # fmt: skip
    tolerance = 0.04893939530858255
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    locked = np.isin(np.arange(13), [0, 1, 2, 10, 11, 12])
    result = tolvol.decimate(vertices, triangles, volume, effort="thorough", locked=locked)
    assert tolvol.hausdorff(result.vertices, result.triangles, vertices, triangles).upper <= tolerance


def test_no_crack_opens_between_the_triangles_of_a_soup():
    vertices, triangles = meshes.soup(*meshes.torus(64, 32))
    result = decimate(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles))
    _, weld = np.unique(result.vertices, axis=0, return_inverse=True)
    edges = np.sort(weld.reshape(-1)[result.triangles][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert (count == 2).all()


@pytest.mark.parametrize("mesh, kind", [("soup", "weld"), ("non-manifold", "duplicate"), ("degenerate", "degenerate")])
def test_repairs_are_counted(mesh, kind):
    vertices, triangles = SOLIDS[mesh]
    report = decimate(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles)).report
    repair = [r for r in report["repairs"] if kind in r["kind"]]
    assert repair and repair[0]["count"] > 0 and repair[0]["message"]
    clean = decimate(*SOLIDS["sphere"], 0.02).report
    assert clean["repairs"] == []


def test_the_input_is_left_alone():
    vertices, triangles = meshes.torus(48, 24)
    before = vertices.copy(), triangles.copy()
    vertices.flags.writeable = triangles.flags.writeable = False
    decimate(vertices, triangles, 0.05)
    assert np.array_equal(vertices, before[0]) and np.array_equal(triangles, before[1])


def test_decimating_twice_against_one_reference_stays_within_it():
    vertices, triangles = meshes.torus(noise=0.001)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    once = tolvol.decimate(vertices, triangles, volume, target_triangles=2000)
    twice = tolvol.decimate(once.vertices, once.triangles, volume)
    assert len(twice.triangles) < len(once.triangles) / 2
    assert_promise(vertices, triangles, twice, tolerance)


def test_another_mesh_than_the_reference():
    """A coarse sphere is within the tolerance of a fine one, but their vertices are numbered differently."""
    fine, coarse = meshes.sphere(5), meshes.sphere(4)
    rotation = meshes.random_rotation()
    vertices, triangles = coarse[0] @ rotation.T, coarse[1]
    result = decimate(vertices, triangles, 0.03, reference=fine)
    assert len(result.triangles) < len(triangles) / 2
    assert_promise(*fine, result, 0.03)


def test_sources_point_where_the_corner_is():
    vertices, triangles = meshes.torus(noise=0.002)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    result = decimate(vertices, triangles, tolerance, placement="optimal")
    assert assert_sources(vertices, triangles, result, tolerance) <= 1.5 * tolerance


def test_distances_are_as_the_report_says():
    vertices, triangles = meshes.torus(noise=0.002)
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    result = decimate(vertices, triangles, tolerance)
    forward, backward = distances(vertices, triangles, result)
    assert 0.5 * tolerance < max(forward.upper, backward.upper) <= tolerance
    assert result.report["stopped_by"] == "tolerance"
    assert result.report["seconds"] > 0


@pytest.mark.parametrize("seed", [1, 3])
@pytest.mark.parametrize("share", [0.3, 0.5])
def test_thorough_keeps_both_ways_where_holes_touch(share, seed):
    """Where sheets touch in a vertex, its copies go along with a collapse. The vertex must not move on without them."""
    vertices, triangles = meshes.torus(48, 24)
    vertices = vertices.astype(np.float32)
    triangles = triangles[np.random.default_rng(seed).random(len(triangles)) >= share]
    tolerance = 0.01 * tolvol.diagonal(vertices, triangles)
    result = decimate(vertices, triangles, tolerance, effort="thorough")
    assert_promise(vertices, triangles, result, tolerance)
