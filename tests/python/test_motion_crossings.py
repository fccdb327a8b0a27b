# SPDX-License-Identifier: GPL-3.0-or-later
"""The option crossings of smooth, deform, constrain and Guard, judged by tolvol.crossing_pairs and tolvol.hausdorff."""

import numpy as np
import pytest
import tolvol

import meshes


def hollow(wall=0.04, levels=3):
    """Returns a sphere within a sphere (vertices float32, triangles)."""
    outer, triangles = meshes.sphere(levels)
    inner = (1 - wall) * outer
    return np.concatenate([outer, inner]).astype(np.float32), np.concatenate(
        [triangles, triangles[:, ::-1] + len(outer)]
    ).astype(np.int32)


class Motions:
    """Motions that bring the two spheres together."""

    def __init__(self):
        self.vertices, self.triangles = hollow()
        self.volume = tolvol.ToleranceVolume(self.vertices, self.triangles, 0.2)
        rng = np.random.default_rng(1)
        noise = 0.03 * rng.standard_normal(self.vertices.shape)
        self.wish = (self.vertices + noise).astype(np.float32)

    def constrain(self, **options):
        return tolvol.constrain(self.vertices, self.wish, self.triangles, self.volume, **options)

    def smooth(self, **options):
        """The outer sphere shrinks into the inner one. After five iterations it would be within it."""
        locked = np.arange(len(self.vertices)) >= len(self.vertices) // 2
        options = {"operator": "laplacian", "iterations": 3, "locked": locked, **options}
        return tolvol.smooth(self.vertices, self.triangles, self.volume, **options)

    def deform(self, **options):
        """One half of the spheres is turned inside out, as far as the lattice goes."""
        domain = meshes.matrix(np.diag([2.4, 2.4, 2.4]), [-1.2, -1.2, -1.2])
        points = tolvol.lattice_points(4, domain)
        points[1:3, 1:3, 3] -= [0, 0, 0.9]
        points[1:3, 1:3, 2] += [0, 0, 0.6]
        lattice = tolvol.Lattice(points, domain)
        return tolvol.deform(self.vertices, lattice, self.triangles, self.volume, mode="pull_back", **options)

    def guard(self, **options):
        guard = tolvol.Guard(self.vertices, self.triangles, self.volume, **options)
        positions = self.wish.copy()
        indices, back = guard.constrain(positions)
        positions[indices] = back
        return positions


@pytest.fixture(scope="module")
def motions():
    made = Motions()
    assert not len(tolvol.crossing_pairs(made.vertices, made.triangles))
    return made


@pytest.mark.parametrize("operation", ["constrain", "smooth"])
@pytest.mark.parametrize("two_sided", [True, False])
def test_no_faces_begin_to_cross_unless_they_are_allowed_to(motions, operation, two_sided):
    call = getattr(motions, operation)
    allowed, kept = call(crossings="allow", two_sided=two_sided), call(two_sided=two_sided)
    assert len(tolvol.crossing_pairs(allowed.vertices, motions.triangles))
    assert not np.any(allowed.report["kept_from_crossing"])
    assert not len(tolvol.crossing_pairs(kept.vertices, motions.triangles))
    assert np.all(np.array(kept.report["kept_from_crossing"]) <= kept.report["held_back"])
    assert np.sum(kept.report["kept_from_crossing"]) > 10
    reference = motions.vertices, motions.triangles
    judged = tolvol.hausdorff(kept.vertices, motions.triangles, *reference, bound=0.2)
    assert (judged.upper if two_sided else judged.forward.upper) <= 0.2


def test_a_deformation_makes_no_crossings_unless_they_are_allowed(motions):
    kept = motions.deform()
    assert not len(tolvol.crossing_pairs(kept.vertices, motions.triangles))
    assert set(kept.report["crossing"]) == {"faces", "first"} and kept.report["moved"] > 0


def test_a_guard_keeps_crossings_out_only_if_it_is_asked_to(motions):
    assert len(tolvol.crossing_pairs(motions.guard(), motions.triangles))
    assert not len(tolvol.crossing_pairs(motions.guard(crossings="keep_out"), motions.triangles))


@pytest.mark.parametrize("operation", ["constrain", "smooth", "deform", "guard"])
def test_any_other_choice_is_refused(motions, operation):
    with pytest.raises(tolvol.InvalidInput, match='crossings must be "keep_out" or "allow", not "some"'):
        getattr(motions, operation)(crossings="some")


@pytest.mark.parametrize("operation", ["constrain", "smooth"])
def test_threads_do_not_change_a_bit(motions, operation):
    one, two, four = (getattr(motions, operation)(threads=threads).vertices for threads in (1, 2, 4))
    assert np.array_equal(one, two) and np.array_equal(one, four)
