# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains of operations stay within the tolerance if each operation is checked against the same reference.

If each operation is checked against its own input instead, like an operation with its own error bound, the chain drifts out."""

import numpy as np
import pytest
import tolvol

import meshes


def smooth(vertices, triangles, volume):
    return tolvol.smooth(vertices, triangles, volume, operator="laplacian", iterations=5).vertices, triangles


def decimate(vertices, triangles, volume):
    result = tolvol.decimate(vertices, triangles, volume)
    return result.vertices, result.triangles


def lattice_around(vertices, motion):
    """Returns a lattice around the vertices. motion: moves its (4, 4, 4, 3) control points in place."""
    lower, size = vertices.min(0) - 0.2, np.ptp(vertices, axis=0) + 0.4
    domain = meshes.matrix(np.diag(size), lower)
    points = tolvol.lattice_points(4, domain)
    motion(points)
    return tolvol.Lattice(points, domain)


def deform(vertices, triangles, volume):
    """Moves vertices upwards by far more than the tolerance."""

    def lift(points):
        points[:, 1:3, 2:] += [0, 0, 10 * volume.tolerance]

    lattice = lattice_around(vertices, lift)
    return tolvol.deform(vertices, lattice, triangles, volume, mode="pull_back").vertices, triangles


CHAIN = (decimate, smooth, deform, decimate, smooth)


@pytest.mark.parametrize(("shape", "percent"), [("torus", 0.5), ("spike", 2.0)])
def test_one_reference_for_the_whole_chain_keeps_it_inside_and_one_a_step_does_not(shape, percent):
    vertices, triangles = meshes.torus(noise=0.002) if shape == "torus" else meshes.spike()
    reference = vertices.astype(np.float32), triangles
    tolerance = percent / 100 * tolvol.diagonal(*reference)
    volume = tolvol.ToleranceVolume(*reference, tolerance)
    one, each = reference, reference
    drift = []
    for step in CHAIN:
        one = step(*one, volume)
        each = step(*each, tolvol.ToleranceVolume(*each, tolerance))
        assert one[0].dtype == np.float32
        bounded = tolvol.hausdorff(*one, *reference, bound=tolerance).upper
        assert bounded <= tolerance, step.__name__
        drift.append((step.__name__, bounded, tolvol.directed_hausdorff(*each, *reference).lower))
    print(f"\n{shape}, {percent} %: distance from the reference in tolerances")
    for name, bounded, drifted in drift:
        print(
            f"  {name:9} one reference at most {bounded / tolerance:.3f}, one a step at least {drifted / tolerance:.3f}"
        )
    assert len(one[1]) < len(triangles) / 2
    assert drift[-1][2] > 1.5 * tolerance


def test_what_one_step_left_inside_the_next_takes_in_any_form():
    """Faces that one step keeps inside are taken by the next step as triangles, as quads with a repeated corner, as edges."""
    vertices, triangles = meshes.sphere(4)
    rng = np.random.default_rng(3)
    vertices = vertices * (1 + 0.1 * rng.standard_normal((len(vertices), 1)))
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.04 * tolvol.diagonal(vertices, triangles))
    forms = ([0, 1, 2], [0, 1, 2, 0], [1, 2, 2, 0], [2, 1, 0], [0, 1], [2, 0, 2], [1, 2], [0, 0, 1, 2], [1, 2, 0])
    for form in forms:
        wish = vertices + 3 * volume.tolerance * rng.standard_normal(vertices.shape)
        vertices = tolvol.constrain(vertices, wish, triangles, volume).vertices
        faces = np.ascontiguousarray(triangles[:, form])
        assert (volume.check(vertices, faces).verdicts == tolvol.Verdict.INSIDE).all(), form
        tolvol.constrain(vertices, vertices, faces, volume, two_sided=len(set(form)) > 2, outside="error")


def random_step(rng, vertices, triangles, volume):
    """Returns (name, result) of a random operation with its default settings, apart from those that say how far to go."""
    name = rng.choice(["decimate", "thorough", "smooth", "deform", "constrain", "guard"], p=[0.2, 0.05, *[0.1875] * 4])
    if name in ("decimate", "thorough"):
        effort = "fast" if name == "decimate" else "thorough"
        result = tolvol.decimate(vertices, triangles, volume, effort=effort)
        return name, (result.vertices, result.triangles)
    if name == "smooth":
        operator = rng.choice(["laplacian", "bilaplacian"])
        return name, (tolvol.smooth(vertices, triangles, volume, operator=operator, iterations=5).vertices, triangles)
    if name == "deform":

        def shake(points):
            points += volume.tolerance * rng.normal(0, rng.choice([0.5, 5]), points.shape)

        lattice, mode = lattice_around(vertices, shake), rng.choice(["blocked", "farthest", "pull_back"])
        return name, (tolvol.deform(vertices, lattice, triangles, volume, mode=mode).vertices, triangles)
    places, place_of = np.unique(vertices, axis=0, return_inverse=True)
    wish = places + rng.choice([0.3, 2]) * volume.tolerance * rng.standard_normal(places.shape)
    wish = wish[place_of].astype(np.float32)  # Vertices at one place go to one place.
    if name == "constrain":
        return name, (tolvol.constrain(vertices, wish, triangles, volume).vertices, triangles)
    guard = tolvol.Guard(vertices, triangles, volume, crossings="keep_out")
    indices, back = guard.constrain(wish)
    wish[indices] = back
    return name, (wish, triangles)


CHAINS = {
    "torus": lambda: meshes.torus(24, 12, noise=0.002),
    "spike": lambda: meshes.spike(levels=3),
    "plate": lambda: meshes.plate(15, bump=0.1),
    "parts": lambda: meshes.join(meshes.sphere(2), meshes.rod(levels=2), meshes.plate(9)),
    "t-junctions": lambda: meshes.sheets_with_t_junctions(6)[:2],
    "double sheets": meshes.double_sheets,
    "degenerate faces on others": meshes.degenerate_on_faces,
    "touching boxes": meshes.touching_boxes,
}
UNCROSSED = ("torus", "spike", "plate", "degenerate faces on others", "touching boxes")


@pytest.mark.parametrize("shape", CHAINS)
def test_no_step_is_refused_for_what_another_one_left(shape):
    """Every chain of operations with default settings goes on, both directions hold, and no faces begin to cross."""
    vertices, triangles = CHAINS[shape]()
    reference = vertices.astype(np.float32), triangles
    parts = meshes.component_count(*reference)
    rng = np.random.default_rng(7)
    for chain in range(25):
        tolerance = rng.choice([0.025, 0.05]) * tolvol.diagonal(*reference)
        volume = tolvol.ToleranceVolume(*reference, tolerance)
        mesh, names, crossed = reference, [], len(tolvol.crossing_pairs(*reference))
        assert (crossed == 0) == (shape in UNCROSSED)
        for _ in range(4):
            name, mesh = random_step(rng, *mesh, volume)
            names.append(str(name))
            judged = tolvol.hausdorff(*mesh, *reference, bound=tolerance)
            assert judged.upper <= tolerance, f"chain {chain}: {names}"
            before, crossed = crossed, len(tolvol.crossing_pairs(*mesh))
            assert crossed <= before, f"chain {chain}: {names}"
            assert meshes.component_count(*mesh) <= parts, f"chain {chain}: {names}"
