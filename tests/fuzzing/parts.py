# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts that several operations share: wished positions, moved meshes, faces of any kind, a lattice, a judge of faces."""

import numpy as np
import tolvol

import meshes

from . import judges


def some(rng, *values):
    return values[rng.integers(len(values))]


def motion_of(rng, case, tolerances):
    """Returns a wished move of each vertex: noise, one direction, or a move of few vertices; world units, local axes."""
    n, kind = len(case.vertices), rng.integers(3)
    motion = rng.standard_normal((n, 3))
    if kind == 1:
        motion[:] = motion[:1]
    if kind == 2:
        motion[rng.random(n) < 0.8] = 0
    scale = 1 if case.to_world is None else np.linalg.norm(case.to_world[:3, :3], 2)
    return motion * tolerances * case.tolerance / scale


def moved(run):
    """Returns the case's vertices, moved a little if the case has the option `moved`."""
    case = run.case
    if not case.options.get("moved"):
        return case.vertices
    return (case.vertices + case.arrays["motion"]).astype(case.vertices.dtype)


def volume_of(run):
    """Returns the volume, or None for a case that goes without one."""
    return None if run.case.options.get("free") else run.volume()


def proved_inside(run, vertices, triangles, volume):
    """Returns for each face whether the check proves it to be inside."""
    verdicts = run.call(
        "check", lambda: volume.check(vertices, triangles, to_world=run.case.to_world, threads=1)
    ).verdicts
    return verdicts == tolvol.Verdict.INSIDE


# For faces of 1 to 4 corners, how each is cut into triangles: a quad in either of its two ways.
_CUTS = {1: [[[0, 0, 0]]], 2: [[[0, 1, 1]]], 3: [[[0, 1, 2]]], 4: [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]]}


def within_as_pieces(run, vertices, faces, reference):
    """Requires that faces of 1 to 4 corners are within the tolerance of the reference.

    Points and segments are judged as degenerate triangles, and a quad in both its triangulations.
    """
    triangles = np.concatenate([faces[:, cut] for way in _CUTS[faces.shape[1]] for cut in way])
    judges.within(run, (vertices, triangles), reference, run.case.tolerance, "result to reference")


def covers(run, vertices, faces, reference):
    """Requires that the reference is within the tolerance of faces of 3 or 4 corners, of quads in both triangulations."""
    for way in _CUTS[faces.shape[1]]:
        triangles = np.concatenate([faces[:, cut] for cut in way])
        judges.within(run, reference, (vertices, triangles), run.case.tolerance, "reference to result")


def uncrossed_as_pieces(run, before, after, faces):
    """Requires that no faces of 3 or 4 corners cross anew, of quads in both triangulations. Others never cross.

    A piece that repeats a corner is an edge of the other piece of its quad, and is not judged beside it.
    """
    if faces.shape[1] > 2:
        for way in _CUTS[faces.shape[1]]:
            pieces = np.concatenate([faces[:, cut] for cut in way])
            proper = pieces[(pieces != np.roll(pieces, 1, axis=1)).all(1)]
            if len(proper):
                judges.uncrossed(run, before, after, proper)


def faces_of(case):
    """Returns the triangles as faces of 1 to 4 corners. With 4, pairs of neighbours are quads, and triangles repeat a corner."""
    corners, triangles = case.options["corners"], case.triangles
    if corners < 4:
        return np.ascontiguousarray(triangles[:, :corners])
    pairs, quads = quads_of(triangles)
    rest = np.delete(triangles, pairs.ravel(), axis=0)[:, [0, 1, 2, 0]]
    return np.concatenate([quads, rest])


def quads_of(triangles):
    """Returns pairs of neighbours, (k, 2), no triangle in two of them, and the quad that each pair is, (k, 4)."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    order = np.lexsort(edges.T)
    same = (edges[order[1:]] == edges[order[:-1]]).all(1)
    pairs, quads, taken = [], [], np.zeros(len(triangles), bool)
    for first, second in zip(order[:-1][same], order[1:][same]):
        a, b = first // 3, second // 3
        if a != b and not taken[a] and not taken[b]:
            taken[a] = taken[b] = True
            x, y, z = np.roll(triangles[a], -(first % 3))
            pairs.append([a, b])
            quads.append([x, np.roll(triangles[b], -(second % 3))[2], y, z])
    return np.array(pairs, np.int64).reshape(-1, 2), np.array(quads, np.int32).reshape(-1, 4)


def flipped(triangles, share, rng):
    """Returns the triangles with some pairs of neighbours cut along the other diagonal."""
    pairs, quads = quads_of(triangles)
    chosen = rng.random(len(pairs)) < share
    chosen &= (np.diff(np.sort(quads, 1), axis=1) > 0).all(1)  # With a repeated corner there is no other diagonal.
    result = triangles.copy()
    result[pairs[chosen]] = quads[chosen][:, [[0, 1, 3], [1, 2, 3]]]
    return result


def draw_spline(rng, case):
    """Gives the lattice of some cases a degree, weights and knots of its own."""
    if rng.random() < 0.4:
        points = case.options["points"]
        case.options["degree"] = [int(rng.integers(1, n)) for n in points]
        case.options["weighted"] = bool(rng.random() < 0.5)
        case.options["knotted"] = bool(rng.random() < 0.5)


def lattice_of(run, vertices):
    options = run.case.options
    placed = run.case.world(vertices) if len(vertices) else np.zeros((1, 3))
    lower, upper = placed.min(0), placed.max(0)
    edges = (upper - lower) * options["reach"] + 1e-6 * np.ptp(placed)
    domain = meshes.matrix(np.diag(edges), lower - edges * 0.01)
    points = tolvol.lattice_points(options["points"], domain)
    rng = np.random.default_rng(options["seed"])
    points = points + rng.standard_normal(points.shape) * options["amplitude"] * run.case.tolerance
    spline = {}
    if "degree" in options:
        degree = spline["degree"] = options["degree"]
        if options.get("weighted"):
            spline["weights"] = rng.uniform(0.5, 2, points.shape[:3])
        if options.get("knotted"):
            inner = (np.sort(rng.random(n - d - 1)) for n, d in zip(options["points"], degree))
            spline["knots"] = [np.concatenate([np.zeros(d + 1), k, np.ones(d + 1)]) for d, k in zip(degree, inner)]
    return tolvol.Lattice(points, domain, **spline)
