# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol.close_holes: each option has a test that fails when it is ignored; results are judged by hausdorff,
crossing_pairs and solidity."""

import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import tolvol

import judge
import meshes

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmark"))
from scan import scan  # noqa: E402

TOLERANCE = 0.06


def holed(share, seed=1, mesh=None, drop=None):
    """Returns a mesh without a share of its faces, float32."""
    vertices, triangles = mesh or meshes.torus(48, 24)
    keep = np.random.default_rng(seed).random(len(triangles)) >= share
    if drop is not None:
        keep[drop] = False
    return vertices.astype(np.float32), triangles[keep]


VERTICES, TRIANGLES = holed(0.1)
VOLUME = tolvol.ToleranceVolume(VERTICES, TRIANGLES, TOLERANCE)


def close(vertices=VERTICES, triangles=TRIANGLES, volume=VOLUME, **options):
    return tolvol.close_holes(vertices, triangles, volume, **options)


def assert_promise(vertices, triangles, result, tolerance, to_world=None):
    """What was added is near the reference and crosses nothing, and closes what is said to be closed."""
    m = len(triangles)
    assert np.array_equal(result.triangles[:m], triangles)
    added = result.triangles[m:]
    assert len(added) == len(result.triangle_loop) == result.report["triangles_added"]
    place = vertices if to_world is None else meshes.transform(to_world, vertices)
    if len(added):
        assert tolvol.directed_hausdorff(place, added, place, triangles, bound=tolerance).upper <= tolerance
    assert (tolvol.crossing_pairs(vertices, result.triangles) < m).all()
    before, after = (tolvol.solidity(vertices, faces) for faces in (triangles, result.triangles))
    for count in ("non_manifold_edges", "misoriented_edges", "degenerate_triangles"):
        assert after[count] == before[count]
    closed = [loop["corners"] for loop in result.loops if loop["outcome"] == "closed"]
    assert after["open_edges"] == before["open_edges"] - sum(closed)
    assert len(closed) == result.report["closed"]
    assert sum(result.report["refused"].values()) == len(result.loops) - len(closed)


def test_holes_close_and_all_else_stays():
    result = close()
    assert_promise(VERTICES, TRIANGLES, result, TOLERANCE)
    assert result.report["closed"] > 100
    assert result.triangles.dtype == np.int32 and result.report["warnings"] == []


@pytest.mark.parametrize("share", [0, 0.7])
def test_shares_of_the_tolerance_are_kept_around_their_vertices(share):
    inside = VERTICES[:, 0] > 0
    shares = np.where(inside, share, 1.0)
    result = close(shares=shares)
    assert_promise(VERTICES, TRIANGLES, result, TOLERANCE)
    added = result.triangles[len(TRIANGLES) :]
    kept = added[inside[added].any(1)]
    assert (len(kept) > 0) == (share > 0)
    if share:
        assert tolvol.directed_hausdorff(VERTICES, kept, VERTICES, TRIANGLES).upper <= share * TOLERANCE
    whole = close().triangles[len(TRIANGLES) :]
    assert len(kept) < inside[whole].any(1).sum()
    assert len(added) - len(kept) == (~inside[whole].any(1)).sum()


def test_the_arrays_tell_where_attributes_come_from():
    result = close()
    m = len(TRIANGLES)
    added = result.triangles[m:]
    assert np.array_equal(TRIANGLES.ravel()[result.corner_source], added)
    for face, borders in zip(added, result.borders):
        for k, other in enumerate(borders):
            shared = {int(face[k]), int(face[(k + 1) % 3])}
            if other >= 0:
                assert shared <= set(TRIANGLES[other].tolist())
    outcomes = [result.loops[i]["outcome"] for i in result.triangle_loop]
    assert set(outcomes) == {"closed"} and (np.diff(result.triangle_loop) >= 0).all()


def test_decimation_goes_on_from_the_closed_mesh():
    closed = close()
    result = tolvol.decimate(VERTICES, closed.triangles, VOLUME)
    judge.assert_promise(VERTICES, TRIANGLES, result, TOLERANCE)
    assert len(result.triangles) < 0.4 * len(tolvol.decimate(VERTICES, TRIANGLES, VOLUME).triangles)
    assert result.report["normals"]["exceeded_before"] == 0


def test_a_triangle_that_is_not_certified_is_found_among_those_that_were_added():
    far = VERTICES.copy()
    far[0] = (0, 0, 3)  # no face uses it yet
    triangles = TRIANGLES[(TRIANGLES != 0).all(1)]
    volume = tolvol.ToleranceVolume(far, triangles, TOLERANCE)
    with pytest.raises(tolvol.InvalidInput) as error:
        tolvol.decimate(far, np.concatenate([triangles, [[0, 1, 2]]]), volume)
    assert error.value.first == len(triangles) and error.value.count == 1


@pytest.mark.parametrize("two_sided", [True, False])
def test_decimation_takes_the_attributes_of_what_was_added(two_sided):
    """Each filling is an island of its own in the UV map."""
    closed = close()
    labels = np.zeros((len(closed.triangles), 3, 2), np.float32)
    labels[len(TRIANGLES) :, :, 0] = closed.triangle_loop[:, None] + 1
    wedges = tolvol.wedges(closed.triangles, labels)
    result = tolvol.decimate(VERTICES, closed.triangles, VOLUME, wedges=wedges, two_sided=two_sided)
    label = labels[:, 0, 0]
    assert np.array_equal(label[result.source_triangle], np.repeat(label[result.triangle_source][:, None], 3, axis=1))
    judge.assert_promise(VERTICES, TRIANGLES, result, TOLERANCE, two_sided=two_sided)


def test_one_way_closed_borders_are_no_borders():
    vertices, triangles = meshes.plate(33)
    vertices, triangles = holed(0.02, mesh=(vertices, triangles))
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.05)
    closed = tolvol.close_holes(vertices, triangles, volume)
    assert closed.report["closed"] >= 10 and sum(closed.report["refused"].values()) <= 3
    result = tolvol.decimate(vertices, closed.triangles, volume, two_sided=False)
    assert len(result.triangles) < len(tolvol.decimate(vertices, triangles, volume, two_sided=False).triangles) / 3
    rim = meshes.boundary_segments(vertices, closed.triangles)
    now = meshes.boundary_segments(result.vertices, result.triangles)
    assert tolvol.hausdorff(result.vertices, now, vertices, rim, bound=0.05).upper <= 0.05


def test_the_largest_perimeter():
    perimeters = sorted(loop["perimeter"] for loop in close().loops)
    limit = perimeters[len(perimeters) // 2]
    result = close(largest_perimeter=limit)
    assert_promise(VERTICES, TRIANGLES, result, TOLERANCE)
    for loop in result.loops:
        assert (loop["outcome"] == "perimeter") == (loop["perimeter"] > limit)
    assert result.report["closed"] < close().report["closed"]


def test_the_largest_angle():
    # A cone without its base: the base looks away from most of the sides, which are turned by 135 degrees to it.
    angle = np.arange(24) * np.pi / 12
    vertices = np.array([[0, 0, 0.1], *np.stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), 0 * angle], 1)], np.float32)
    i = np.arange(24)
    triangles = np.stack([0 * i, 1 + i, 1 + (i + 1) % 24], 1).astype(np.int32)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.15)
    assert tolvol.close_holes(vertices, triangles, volume).report["refused"] == {"turned": 1}
    wide = tolvol.close_holes(vertices, triangles, volume, max_normal_angle=140)
    assert wide.report["closed"] == 1
    assert tolvol.close_holes(vertices, triangles, volume, max_normal_angle=130).report["closed"] == 0
    # Decimation counts the faces that are turned farther than it would turn any.
    normals = tolvol.decimate(vertices, wide.triangles, volume).report["normals"]
    assert normals["exceeded_before"] == wide.report["triangles_added"]


def test_matrices():
    for linear in (np.diag([1.0, 2.0, -3.0]), meshes.random_rotation(), 1e-6 * np.eye(3)):
        to_world = meshes.matrix(linear, 5 * np.abs(linear).max() * np.ones(3))
        tolerance = TOLERANCE * abs(np.linalg.det(linear)) ** (1 / 3)
        volume = tolvol.ToleranceVolume(VERTICES, TRIANGLES, tolerance, to_world=to_world)
        result = tolvol.close_holes(VERTICES, TRIANGLES, volume, to_world=to_world)
        assert_promise(VERTICES, TRIANGLES, result, tolerance, to_world)
        assert result.report["closed"] > 50
        place = meshes.transform(to_world, VERTICES)
        loop = result.loops[0]
        size = np.linalg.norm(linear, 2)
        assert loop["perimeter"] <= 2 * loop["corners"] * size
        assert np.linalg.norm(place[loop["vertex"]] - loop["centre"]) <= loop["perimeter"]


def test_threads_change_no_bit():
    one, four = close(threads=1), close(threads=4)
    for name in ("triangles", "triangle_loop", "borders", "corner_source"):
        assert np.array_equal(getattr(one, name), getattr(four, name))
    assert one.loops == four.loops and one.report == four.report


def test_float64_and_other_integers():
    result = tolvol.close_holes(VERTICES.astype(np.float64), TRIANGLES.astype(np.uint64), VOLUME)
    assert np.array_equal(result.triangles, close().triangles)


def test_bad_input():
    nan = VERTICES.copy()
    nan[7, 1] = np.nan
    for call, words in (
        (lambda: close(vertices=nan), "7"),
        (lambda: close(triangles=TRIANGLES[:0]), "no faces"),
        (lambda: close(vertices=VERTICES[:10]), "vert"),
        (lambda: close(triangles=TRIANGLES[:, :2]), "triangles"),
        (lambda: close(largest_perimeter=0.0), "largest_perimeter"),
        (lambda: close(largest_perimeter=float("nan")), "largest_perimeter"),
        (lambda: close(max_normal_angle=0.0), "max_normal_angle"),
        (lambda: close(max_normal_angle=181.0), "max_normal_angle"),
        (lambda: close(shares=np.ones(3)), "shares"),
        (lambda: close(shares=np.ones(0)), "shares"),
        (lambda: close(shares=np.full(len(VERTICES), 1.5)), "vertex 0"),
        (lambda: close(threads=0), "threads"),
        (lambda: close(to_world=np.zeros((4, 4))), "to_world"),
    ):
        with pytest.raises(tolvol.InvalidInput, match=words):
            call()
    with pytest.raises(TypeError):
        tolvol.close_holes(VERTICES, TRIANGLES, None)


def test_a_scan_full_of_pinholes():
    """VTK and meshoptimizer come down to 345 and 361 triangles on this mesh (docs/benchmark.md)."""
    vertices, triangles = scan()
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles))
    closed = tolvol.close_holes(vertices, triangles, volume)
    assert closed.report["closed"] == 119 and closed.report["refused"] == {"turned": 1}
    assert closed.loops[0]["outcome"] == "turned"  # the border of the whole scan
    result = tolvol.decimate(vertices, closed.triangles, volume)
    judge.assert_promise(vertices, triangles, result, volume.tolerance)
    assert len(result.triangles) < 60
    assert len(tolvol.crossing_pairs(result.vertices, result.triangles)) == 0


@pytest.mark.parametrize("missing, left", [(0.2, 0.2), (0.5, 0.7)])
def test_a_bumpy_sphere_with_a_share_of_its_faces_missing(missing, left):
    """Without closing holes, more than half of the triangles stay: each hole needs three vertices."""
    vertices, triangles = meshes.sphere(5)
    bumps = 1 + 0.05 * np.sin(5 * vertices[:, :1]) * np.cos(4 * vertices[:, 1:2] + vertices[:, 2:])
    vertices, triangles = holed(missing, mesh=(vertices * bumps, triangles))
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles))
    closed = tolvol.close_holes(vertices, triangles, volume)
    result = tolvol.decimate(vertices, closed.triangles, volume)
    judge.assert_promise(vertices, triangles, result, volume.tolerance)
    assert len(result.triangles) < left * len(tolvol.decimate(vertices, triangles, volume).triangles)


def test_decimation_seeks_no_witnesses_for_triangles_that_stayed():
    """Triangle i of the closed mesh is triangle i of the reference, and so its own witness: nothing is compared."""
    vertices, triangles = holed(0, mesh=meshes.torus(400, 200, noise=0.001), drop=slice(None, None, 997))
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.05)
    closed = tolvol.close_holes(vertices, triangles, volume)
    assert closed.report["closed"] == len(closed.loops) > 150
    for faces, compared in ((closed.triangles, False), (np.roll(closed.triangles, 1, axis=0), True)):
        progress, stages, results = tolvol.Progress(), set(), []
        thread = threading.Thread(
            target=lambda: results.append(tolvol.decimate(vertices, faces, volume, progress=progress))  # noqa: B023
        )
        thread.start()
        while thread.is_alive():
            stages.add(progress.stage)
            time.sleep(0.0002)
        assert ("comparing" in stages) == compared
        judge.assert_promise(vertices, triangles, results[0], 0.05)
