# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol.smooth: each option has a test that fails when it is ignored; distances are judged by tolvol.hausdorff."""

import numpy as np
import pytest
import tolvol

import meshes

TOLERANCE = 0.02
NOISY = meshes.torus(48, 24, noise=0.02)
VERTICES, TRIANGLES = NOISY[0].astype(np.float32), NOISY[1]
VOLUME = tolvol.ToleranceVolume(VERTICES, TRIANGLES, TOLERANCE)


def smooth(vertices=VERTICES, volume=None, **options):
    return tolvol.smooth(vertices, TRIANGLES, volume, **options).vertices


def deviation(vertices, to_world=None):
    m = np.eye(4) if to_world is None else to_world
    now, then = meshes.transform(m, vertices), meshes.transform(m, VERTICES)
    return tolvol.hausdorff(now, TRIANGLES, then, TRIANGLES, bound=TOLERANCE).upper


def motion(vertices):
    return np.linalg.norm(vertices - VERTICES, axis=1).sum()


@pytest.mark.parametrize("mode", ["pull_back", "reset"])
@pytest.mark.parametrize("operator", ["laplacian", "bilaplacian"])
@pytest.mark.parametrize("weights", ["uniform", "cotangent"])
def test_the_result_is_inside(mode, operator, weights):
    result = tolvol.smooth(VERTICES, TRIANGLES, VOLUME, operator=operator, weights=weights, mode=mode)
    assert deviation(smooth(operator=operator, weights=weights)) > TOLERANCE
    assert deviation(result.vertices) <= TOLERANCE
    assert (VOLUME.check(result.vertices, TRIANGLES).verdicts == tolvol.Verdict.INSIDE).all()
    report = result.report
    assert len(report["held_back"]) == 10 and report["held_back"][-1] > 0
    assert report["largest_motion"] == pytest.approx(np.linalg.norm(result.vertices - VERTICES, axis=1).max(), rel=1e-5)
    assert report["method"] == "certificate" and report["renderer"] == "CPU"
    assert report["seconds"] > 0 and report["warnings"] == []


def test_each_choice_changes_the_result():
    choices = [{}, {"operator": "laplacian"}, {"weights": "uniform"}, {"iterations": 3}]
    results = [smooth(**choice) for choice in choices]
    for i, result in enumerate(results):
        assert not any(np.array_equal(result, other) for other in results[:i])
    assert motion(smooth(volume=VOLUME)) > motion(smooth(volume=VOLUME, mode="reset"))
    assert np.array_equal(smooth(iterations=0), VERTICES)


def test_a_tolerance_that_holds_nothing_back_changes_no_bit():
    large = tolvol.ToleranceVolume(VERTICES, TRIANGLES, 1.0)
    bounded = tolvol.smooth(VERTICES, TRIANGLES, large, iterations=20)
    free = tolvol.smooth(VERTICES, TRIANGLES, iterations=20)
    assert bounded.vertices.tobytes() == free.vertices.tobytes()
    assert free.report["method"] == "" and free.report["held_back"] == [0] * 20


def test_boundary():
    vertices, triangles = meshes.plate(17)
    vertices[1:16:2, 1] -= 0.03
    on_boundary = np.unique(meshes.boundary_segments(vertices, triangles))
    fixed, along = (tolvol.smooth(vertices, triangles, boundary=choice) for choice in ("fixed", "along"))
    assert np.array_equal(fixed.vertices[on_boundary], vertices[on_boundary])
    assert fixed.report["fixed"] == {"boundary": len(on_boundary), "non-manifold": 0, "T-junction": 0}
    assert np.ptp(along.vertices[4:13, 1]) < 0.01, "the zigzag was 0.03"
    assert along.report["fixed"]["boundary"] == 0


def test_locked_and_strength():
    locked = np.arange(len(VERTICES)) % 5 == 0
    assert np.array_equal(smooth(locked=locked)[locked], VERTICES[locked])
    assert (smooth(locked=locked)[~locked] != VERTICES[~locked]).any(1).all()
    whole = smooth(iterations=1).astype(np.float64) - VERTICES
    half = smooth(iterations=1, strength=np.full(len(VERTICES), 0.5)).astype(np.float64) - VERTICES
    assert np.allclose(half, whole / 2, atol=1e-6)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_to_world_and_types(dtype):
    to_world = meshes.matrix(np.diag([3, 0.5, -1]) @ meshes.random_rotation(), (5, 6, 7))
    vertices = VERTICES.astype(dtype)
    volume = tolvol.ToleranceVolume(vertices, TRIANGLES, TOLERANCE, to_world=to_world)
    result = tolvol.smooth(vertices, TRIANGLES, volume, to_world=to_world)
    assert result.vertices.dtype == dtype
    assert deviation(result.vertices, to_world) <= TOLERANCE
    # Cotangents are measured in the world.
    free = [tolvol.smooth(vertices, TRIANGLES, to_world=m).vertices for m in (to_world, None)]
    assert np.abs(free[0] - free[1]).max() > 1e-3


def test_outside():
    vertices = VERTICES.copy()
    vertices[100] *= 2
    with pytest.raises(tolvol.InvalidInput, match="^6 faces are not within .* the first is face"):
        tolvol.smooth(vertices, TRIANGLES, VOLUME)
    result = tolvol.smooth(vertices, TRIANGLES, VOLUME, outside="keep")
    kept = (TRIANGLES == 100).any(1)
    assert result.report["outside"] == {"faces": 6, "first": np.flatnonzero(kept)[0], "reference_faces": 6}
    assert np.array_equal(result.vertices[TRIANGLES[kept]], vertices[TRIANGLES[kept]])
    assert np.isin(VOLUME.check(result.vertices, TRIANGLES[~kept]).verdicts, 2).all()


@pytest.mark.parametrize("mode", ["pull_back", "reset"])
def test_the_reference_stays_within_the_tolerance_unless_one_direction_is_asked_for(mode):
    vertices, triangles = meshes.spike()
    tolerance = 0.005 * tolvol.diagonal(vertices, triangles)
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    options = {"operator": "laplacian", "iterations": 30, "mode": mode}
    one, both = (tolvol.smooth(vertices, triangles, volume, two_sided=two, **options) for two in (False, True))
    reference = vertices, triangles
    assert tolvol.directed_hausdorff(one.vertices, triangles, *reference, bound=tolerance).upper <= tolerance
    assert tolvol.hausdorff(one.vertices, triangles, *reference).backward.lower > 1.1 * tolerance
    assert tolvol.hausdorff(both.vertices, triangles, *reference, bound=tolerance).upper <= tolerance
    assert 0.5 * tolerance < both.report["largest_motion"]
    two = tolvol.smooth(vertices, triangles, volume, threads=2, **options)
    assert np.array_equal(two.vertices, both.vertices)
    with pytest.raises(tolvol.InvalidInput, match=r"faces of the reference are not within .* \(two_sided=False\)"):
        tolvol.smooth(one.vertices, triangles, volume)
    kept = tolvol.smooth(one.vertices, triangles, volume, outside="keep").report
    assert kept["outside"]["reference_faces"] > 0 and "what is nearest to them was kept" in kept["warnings"][0]


@pytest.mark.parametrize("mesh", [meshes.non_manifold(), meshes.degenerate(), meshes.needles(), meshes.misoriented()])
def test_hostile_meshes(mesh):
    vertices, triangles = mesh[0].astype(np.float32), mesh[1]
    tolerance = 0.002 * tolvol.diagonal(vertices, triangles)
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    for options in ({}, {"weights": "uniform", "operator": "laplacian", "boundary": "along"}):
        result = tolvol.smooth(vertices, triangles, volume, **options).vertices
        then, now = vertices.astype(np.float64), result.astype(np.float64)
        assert np.isfinite(now).all()
        assert tolvol.hausdorff(now, triangles, then, triangles, bound=tolerance).upper <= tolerance


def test_a_soup_stays_closed():
    vertices, triangles = meshes.soup(VERTICES, TRIANGLES)
    volume = tolvol.ToleranceVolume(vertices, triangles, TOLERANCE)
    result = tolvol.smooth(vertices, triangles, volume)
    assert result.report["welded"] == len(vertices) - len(VERTICES)
    pairs = np.concatenate([vertices, result.vertices], 1)
    assert len(np.unique(pairs, axis=0)) == len(VERTICES), "what was one place is one place"
    assert result.report["largest_motion"] > 0


@pytest.mark.parametrize("volume", [None, VOLUME], ids=["free", "bounded"])
def test_threads_change_nothing(volume):
    assert np.array_equal(smooth(volume=volume, threads=1), smooth(volume=volume, threads=2))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"iterations": -1}, "iterations must"),
        ({"operator": "gaussian"}, "operator must be"),
        ({"weights": "mean"}, "weights must be"),
        ({"boundary": "free"}, "boundary must be"),
        ({"mode": "stop"}, "mode must be"),
        ({"outside": "ignore"}, "outside must be"),
        ({"locked": np.zeros(3, bool)}, "locked must have one value"),
        ({"locked": np.zeros(0, bool)}, "locked must have one value"),
        ({"locked": np.zeros(len(VERTICES))}, "locked must be a bool array"),
        ({"strength": np.ones(3)}, "strength must have one value"),
        ({"strength": np.ones(len(VERTICES), np.float32)}, "strength must be a float64 array"),
        ({"strength": np.full(len(VERTICES), 1.5)}, "the strength of vertex 0"),
        ({"vertices": np.full_like(VERTICES, np.nan)}, "vertex 0 is not finite"),
        ({"vertices": VERTICES[:9]}, "triangle"),
        ({"triangles": TRIANGLES[:0]}, "no faces"),
        ({"threads": -2}, "threads"),
    ],
)
def test_bad_input(change, message):
    with pytest.raises(tolvol.InvalidInput, match=message):
        tolvol.smooth(**{"vertices": VERTICES, "triangles": TRIANGLES, "volume": VOLUME, **change})


def test_within_a_tiny_tolerance_each_face_can_be_proved_again():
    """Two were not: a face is 100,000 times as long as the tolerance, so that its parts were more than a proof looks at."""
    vertices, triangles = meshes.misoriented()
    vertices = vertices.astype(np.float32)
    to_world = meshes.matrix([[-2.268, -0.55, -1.885], [0.198, -0.446, -0.108], [0.521, 0.413, -0.747]])
    tolerance = 1.2e-7 * np.linalg.norm(np.ptp(meshes.transform(to_world, vertices), axis=0))
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, to_world=to_world)
    smoothed = tolvol.smooth(
        vertices, triangles, volume, to_world=to_world, iterations=4, threads=1, two_sided=False
    ).vertices
    assert not np.array_equal(smoothed, vertices)
    assert (volume.check(smoothed, triangles, to_world=to_world).verdicts == tolvol.Verdict.INSIDE).all()


def test_within_a_tiny_tolerance_the_reference_can_be_covered_again():
    """Smoothing was refused after constrain(): parts of the reference had to be cut more than 32 times."""
    vertices, triangles = meshes.torus(24, 12, noise=0.02, seed=5)
    tolerance = 4e-7 * np.linalg.norm(np.ptp(vertices, axis=0))
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    for seed in range(2):
        wish = vertices + np.random.default_rng(seed).standard_normal(vertices.shape) * tolerance
        constrained = tolvol.constrain(vertices, wish, triangles, volume).vertices
        smoothed = tolvol.smooth(constrained, triangles, volume, iterations=1).vertices
        assert not np.array_equal(smoothed, constrained)
