# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol.constrain and tolvol.Guard, judged by tolvol.hausdorff on what they return."""

import gc

import numpy as np
import pytest
import tolvol

import meshes

TOLERANCE = 0.04
VERTICES, TRIANGLES = meshes.torus(48, 24)
SINGLE = VERTICES.astype(np.float32)
VOLUME = tolvol.ToleranceVolume(SINGLE, TRIANGLES, TOLERANCE)


def noisy(vertices=SINGLE, deviation=0.6, seed=1):
    noise = np.random.default_rng(seed).normal(0, deviation * TOLERANCE, vertices.shape)
    return (vertices + noise).astype(vertices.dtype)


def deviation(vertices, to_world=None):
    m = np.eye(4) if to_world is None else to_world
    now, then = meshes.transform(m, vertices), meshes.transform(m, SINGLE)
    return tolvol.hausdorff(now, TRIANGLES, then, TRIANGLES, bound=TOLERANCE).upper


@pytest.mark.parametrize("mode", ["pull_back", "reset"])
def test_positions_are_those_of_the_factors_and_inside(mode):
    wish = noisy()
    result = tolvol.constrain(SINGLE, wish, TRIANGLES, VOLUME, mode=mode)
    assert deviation(wish) > TOLERANCE
    assert deviation(result.vertices) <= TOLERANCE
    assert result.vertices.dtype == np.float32 and result.factors.dtype == np.float64
    f = result.factors[:, None]
    before = SINGLE.astype(np.float64)
    between = (before + f * (wish - before)).astype(np.float32)
    assert np.array_equal(result.vertices, np.where(f == 1, wish, between))
    assert result.report["held_back"] == (result.factors < 1).sum() > 10
    assert result.report["method"] == "certificate" and result.report["renderer"] == "CPU"
    assert result.report["warnings"] == []
    assert set(np.unique(result.factors)) == {0, 1} if mode == "reset" else len(np.unique(result.factors)) > 10


def test_pull_back_goes_at_least_as_far_as_reset():
    pulled, reset = (tolvol.constrain(SINGLE, noisy(), TRIANGLES, VOLUME, mode=m) for m in ("pull_back", "reset"))
    assert (pulled.factors >= reset.factors).all()
    assert pulled.factors.sum() > reset.factors.sum()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_to_world_and_types(dtype):
    to_world = meshes.matrix(3 * meshes.random_rotation(), (5, 6, 7))
    before = SINGLE.astype(dtype)
    volume = tolvol.ToleranceVolume(before, TRIANGLES, TOLERANCE, to_world=to_world)
    result = tolvol.constrain(before, noisy(before), TRIANGLES, volume, to_world=to_world)
    assert result.vertices.dtype == dtype
    assert 0.5 * TOLERANCE < deviation(result.vertices, to_world) <= TOLERANCE


def test_a_plane_pushed_far_reaches_the_tolerance_with_any_kind_of_face():
    vertices, triangles = meshes.plate(5)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.1)
    quads = np.array([[j * 5 + i, j * 5 + i + 1, j * 5 + i + 6, j * 5 + i + 5] for j in range(4) for i in range(4)])
    for faces in (triangles, quads, triangles[:, :2], np.arange(25)[:, None]):
        two_sided = faces.shape[1] > 2
        result = tolvol.constrain(vertices, vertices + [0, 0, 9], faces, volume, two_sided=two_sided)
        touched = np.unique(faces)
        assert (result.vertices[touched, 2] >= 0.095).all() and (result.vertices[touched, 2] <= 0.1).all()
        others = np.setdiff1d(np.arange(25), touched)
        assert (result.vertices[others, 2] == 9).all(), "no face, no bound"


def test_outside():
    before = SINGLE.copy()
    before[100] *= 2
    with pytest.raises(tolvol.InvalidInput, match="^6 faces are not within .* the first is face"):
        tolvol.constrain(before, before, TRIANGLES, VOLUME)
    result = tolvol.constrain(before, noisy(before), TRIANGLES, VOLUME, outside="keep")
    kept = TRIANGLES[(TRIANGLES == 100).any(1)]
    first = np.flatnonzero((TRIANGLES == 100).any(1))[0]
    assert result.report["outside"] == {"faces": 6, "first": first, "reference_faces": 6}
    assert np.array_equal(result.vertices[kept], before[kept])
    assert not np.array_equal(result.vertices, before)


def test_threads_change_nothing():
    one, two = (tolvol.constrain(SINGLE, noisy(), TRIANGLES, VOLUME, threads=n) for n in (1, 2))
    assert np.array_equal(one.vertices, two.vertices)


def nan_at(vertex):
    wish = SINGLE.copy()
    wish[vertex, 1] = np.nan
    return wish


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"after": nan_at(7)}, "the wish for vertex 7 is not finite"),
        ({"before": nan_at(9)}, "vertex 9 is not finite"),
        ({"after": SINGLE[:-1]}, "both must be the same"),
        ({"after": VERTICES}, "same type"),
        ({"faces": TRIANGLES + 5}, "uses vertex"),
        ({"faces": TRIANGLES[:, :0]}, "faces must have shape"),
        ({"faces": TRIANGLES.astype(float)}, "integer"),
        ({"mode": "pullback"}, "mode must be"),
        ({"outside": "ignore"}, "outside must be"),
        ({"threads": -1}, "threads"),
        ({"faces": TRIANGLES[:, :2]}, "points and segments cannot cover a reference; .*two_sided=False"),
        ({"to_world": np.zeros((4, 4))}, "to_world"),
    ],
)
def test_bad_input(change, message):
    arguments = {"before": SINGLE, "after": SINGLE, "faces": TRIANGLES, "volume": VOLUME, **change}
    with pytest.raises(tolvol.InvalidInput, match=message):
        tolvol.constrain(**arguments)


def dab(positions, vertex, amount, radius=0.4):
    """Pushes the vertices around one away from the origin, in place."""
    share = np.linalg.norm(positions - positions[vertex], axis=1) / radius
    positions += amount * np.clip(1 - share, 0, None)[:, None] * positions[vertex] / np.linalg.norm(positions[vertex])


def test_guard_keeps_every_dab_inside():
    guard = tolvol.Guard(SINGLE, TRIANGLES, VOLUME)
    assert guard.vertex_count == len(SINGLE) and guard.warnings == [] and len(guard.outside) == 0
    positions = SINGLE.copy()
    corrected = 0
    for i in range(20):
        dab(positions, 50 * i, 0.05 if i % 3 else -0.05)
        wish = positions.copy()
        indices, back = guard.constrain(positions)
        assert np.array_equal(positions, wish), "the caller writes"
        assert indices.dtype == np.int32 and back.dtype == np.float32 and back.shape == (len(indices), 3)
        positions[indices] = back
        corrected += len(indices)
        assert deviation(positions) <= TOLERANCE
    assert corrected > 20
    assert deviation(positions) > 0.95 * TOLERANCE


def test_guard_takes_strided_positions_and_outlives_its_arguments():
    volume = tolvol.ToleranceVolume(SINGLE, TRIANGLES, TOLERANCE)
    guard = tolvol.Guard(SINGLE.copy(), TRIANGLES.copy(), volume)
    del volume
    gc.collect()
    wide = np.zeros((len(SINGLE), 4), np.float32)
    wide[:, :3] = SINGLE
    assert len(guard.constrain(wide[:, :3])[0]) == 0
    wide[5, 0] += 9
    assert guard.constrain(wide[:, :3])[0].tolist() == [5]


def test_guard_reset_and_outside():
    guard = tolvol.Guard(SINGLE, TRIANGLES, VOLUME)
    broken = SINGLE.copy()
    broken[100] *= 2
    with pytest.raises(tolvol.InvalidInput, match="6 faces"):
        guard.reset(broken)
    with pytest.raises(tolvol.InvalidInput, match="6 faces"):
        tolvol.Guard(broken, TRIANGLES, VOLUME)
    keeping = tolvol.Guard(broken, TRIANGLES, VOLUME, outside="keep")
    assert np.array_equal(keeping.outside, np.flatnonzero((TRIANGLES == 100).any(1)))
    moved = broken.copy()
    moved[100] *= 1.1
    indices, back = keeping.constrain(moved)
    assert indices.tolist() == [100] and np.array_equal(back[0], broken[100])


def test_guard_replaces_faces():
    """A bent square may be cut along the other diagonal as long as that is within the tolerance."""
    square, faces = [(0, 0, 0), (1, 0, 0), (1, 1, 0)], np.array([(0, 1, 2), (0, 2, 3)])
    otherwise = np.array([(0, 1, 3), (1, 2, 3)])
    for bend, refused in ((0.01, []), (0.1, [0, 1])):
        vertices = np.array([*square, (0, 1, bend)], np.float32)
        guard = tolvol.Guard(vertices, faces, tolvol.ToleranceVolume(vertices, faces, 0.02))
        found = guard.replace_faces(otherwise)
        assert found.dtype == np.int32 and found.tolist() == refused
        assert guard.replace_faces(faces).tolist() == []
    for wrong, message in (
        (faces[:1], "2 faces, not 1"),
        (faces + 2, "uses vertex 4"),
        (faces[:, [0, 1, 2, 2]], "3 corners"),
    ):
        with pytest.raises(tolvol.InvalidInput, match=message):
            guard.replace_faces(wrong)


@pytest.mark.parametrize(
    ("positions", "message"),
    [
        (SINGLE[:-1], "make a new one"),
        (VERTICES, "float32"),
        (SINGLE.ravel(), "shape"),
        (nan_at(3), "vertex 3 is not finite"),
        (SINGLE.tolist(), "NumPy array"),
    ],
)
def test_guard_bad_input(positions, message):
    guard = tolvol.Guard(SINGLE, TRIANGLES, VOLUME)
    with pytest.raises(tolvol.InvalidInput, match=message):
        guard.constrain(positions)
    with pytest.raises(tolvol.InvalidInput, match=message):
        guard.reset(positions)
    assert len(guard.constrain(SINGLE)[0]) == 0


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])


def test_a_motion_that_leaves_the_surface_as_it_is_is_granted_at_any_size():
    vertices, triangles = meshes.plate(41)
    inner = (np.abs(vertices[:, :2] - 0.5) < 0.499).all(1)
    wish = vertices.copy()
    wish[inner, :2] += np.random.default_rng(1).uniform(-0.3 / 40, 0.3 / 40, (inner.sum(), 2))
    result = tolvol.constrain(vertices, wish, triangles, tolvol.ToleranceVolume(vertices, triangles, 0.02 / 40))
    assert result.report["held_back"] == 0


@pytest.mark.parametrize("count", [5, 31, 61])
def test_a_fine_mesh_covers_a_coarse_reference(count):
    vertices, triangles = meshes.plate(count)
    volume = tolvol.ToleranceVolume(*SQUARE, 3e-4)
    pushed = tolvol.constrain(vertices, vertices + [0, 0, 1e-3], triangles, volume).vertices
    assert pushed[:, 2].min() > 2.8e-4
    assert np.array_equal(tolvol.constrain(pushed, pushed, triangles, volume).vertices, pushed)


def test_a_guard_goes_on_after_an_edit_that_it_refused():
    vertices, triangles = meshes.plate(31)
    positions = vertices.astype(np.float32)
    guard = tolvol.Guard(positions, triangles, tolvol.ToleranceVolume(*SQUARE, 1e-3))
    wish = positions + np.float32([0, 0, 5e-3])
    indices, back = guard.constrain(wish)
    wish[indices] = back
    broken = wish.copy()
    broken[5] = np.nan
    with pytest.raises(tolvol.InvalidInput, match="vertex 5"):
        guard.constrain(broken)
    assert len(guard.constrain(wish)[0]) == 0
    wish[:, 2] = 5e-4
    assert len(guard.constrain(wish)[0]) == 0


def test_small_steps_do_not_wear_a_guard_out():
    """The reference is divided at the edges that move over it, in each step again."""
    vertices, triangles = meshes.plate(21)
    positions = vertices.astype(np.float32)
    guard = tolvol.Guard(positions, triangles, tolvol.ToleranceVolume(*SQUARE, 5e-4))
    vertex = np.abs(vertices[:, :2] - 0.5).sum(1).argmin()
    for _ in range(200):
        positions[vertex, 0] += 5e-4 / 3
        assert len(guard.constrain(positions)[0]) == 0
