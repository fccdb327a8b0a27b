# SPDX-License-Identifier: GPL-3.0-or-later
"""check, distance, hausdorff and deviation, each judged by another of these functions or by CGAL."""

import numpy as np
import tolvol

from . import judges
from .case import Finding
from .parts import faces_of, motion_of, proved_inside, some, within_as_pieces

SAMPLING = 0.02  # of the area: 65,536 random samples miss the share by less
MOST_PAIRS = 10_000


def draw_check(rng, case):
    case.options["corners"] = int(rng.integers(1, 5))
    case.arrays["motion"] = motion_of(rng, case, float(some(rng, 0, 1e-9, 0.3, 1, 3)))
    if rng.random() < 0.1:
        case.options["method"] = "gl_certificate"


def check(run):
    case = run.case
    volume = run.volume()
    points = (case.vertices + case.arrays.get("motion", 0)).astype(case.vertices.dtype)
    faces = faces_of(case)

    def call(pieces, **more):
        return lambda threads, progress: volume.check(
            points, pieces, to_world=case.to_world, threads=threads, progress=progress, **more
        )

    verdict = run.repeated("check", call(faces), ("verdicts",)).verdicts
    if verdict.shape != (len(faces),) or not np.isin(verdict, (0, 1, 2)).all():
        raise Finding("verdict", f"verdicts {verdict.shape} {verdict.dtype}")
    if "motion" not in case.arrays and case.options["corners"] < 4 and (verdict != 2).any():
        raise Finding(
            "unproved", f"face {np.flatnonzero(verdict != 2)[0]} of the reference itself is not proved inside"
        )
    reference = case.world(case.vertices), case.triangles
    placed = case.world(points)
    within_as_pieces(run, placed, faces[verdict == tolvol.Verdict.INSIDE], reference)
    for face in faces[verdict == tolvol.Verdict.OUTSIDE][:5]:
        # If a quad is outside, one of its four triangles must be.
        corners = face[[[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]]] if len(face) == 4 else [np.resize(face, 3)]
        far = run.call(
            "hausdorff",
            lambda c=corners: tolvol.directed_hausdorff(
                placed, np.array(c), *reference, bound=case.tolerance, threads=1
            ),
        )
        if far.upper < case.tolerance * (1 - 1e-9):
            raise Finding(
                "outside", f"face {face} is said to be outside and at {far.upper / case.tolerance} tolerances"
            )
    labels = np.arange(len(faces)) // 3
    least = np.minimum.reduceat(verdict, np.arange(0, len(faces), 3))[labels]
    grouped = run.call("check", lambda: call(faces, groups=labels)(1, None)).verdicts
    if not np.array_equal(grouped, least):
        raise Finding("groups", "a group has not the worst verdict of its faces")
    inside = faces[verdict == tolvol.Verdict.INSIDE]
    for k in range(1, faces.shape[1]):
        parts = proved_inside(run, points, np.ascontiguousarray(inside[:, :k]), volume)
        if not parts.all():
            raise Finding(
                "parts", f"the face {inside[~parts][0]} is inside, its first {k} corners are not proved to be"
            )
    if "method" in case.options:
        try:
            other = volume.check(points, faces, to_world=case.to_world, method=case.options["method"]).verdicts
        except tolvol.GlUnavailable:
            return
        if (other == tolvol.Verdict.OUTSIDE).any():
            raise Finding("method", f"{case.options['method']} says outside, which it cannot prove")
        within_as_pieces(run, placed, faces[other == tolvol.Verdict.INSIDE], reference)


def draw_distance(rng, case):
    case.arrays["motion"] = motion_of(rng, case, float(some(rng, 0, 1e-6, 1, 30)))


def distance(run):
    case = run.case
    volume = run.volume()
    points = (case.vertices + case.arrays.get("motion", 0)).astype(case.vertices.dtype)
    found = run.call("distance", lambda: volume.distance(points, to_world=case.to_world))
    again = run.call("distance", lambda: volume.distance(points, to_world=case.to_world, threads=run.threads[1]))
    if not np.array_equal(found, again):
        raise Finding("threads: distance", "distances differ")
    if found.shape != (len(points),) or not np.isfinite(found).all() or (found < 0).any():
        raise Finding("distance", f"a distance is {found.min()} or not finite")
    reference, placed = (case.world(case.vertices), case.triangles), case.world(points)
    slack = 1e-12 * (np.abs(placed).max() + np.abs(reference[0]).max())
    for v in np.linspace(0, len(points) - 1, 10).astype(int):
        far = run.call(
            "hausdorff", lambda v=v: tolvol.directed_hausdorff(placed, np.array([[v, v, v]]), *reference, threads=1)
        )
        if not far.lower - slack <= found[v] <= far.upper + slack:
            raise Finding("distance", f"point {v} is at {found[v]} and, by hausdorff, {far.lower} to {far.upper}")
    _shares(run, volume, points)
    _facts(run, points)


def _shares(run, volume, points):
    """Judges DisplayTree.shares by the ranges of deviation. Both are shares of the area of the moved mesh."""
    case = run.case
    tree = run.call("DisplayTree", lambda: tolvol.DisplayTree(volume))
    bound = case.tolerance

    class Shares:
        def __init__(self, threads, progress):
            self.values = tree.shares(
                points, case.triangles, (-bound, bound), to_world=case.to_world, threads=threads, progress=progress
            )

    below, within, beyond = run.repeated("shares", Shares, ("values",)).values
    total = below + within + beyond
    if not (min(below, within, beyond) >= 0 and (abs(total - 1) < 1e-6 or total == 0)):
        raise Finding("shares", f"{below}, {within} and {beyond} are no shares")
    if total == 0:
        return
    placed, reference = (case.world(vertices) for vertices in (points, case.vertices))
    # A distance in the tree errs by about a millionth of the size, of which either bound may fall short.
    slack = 1e-5 * (np.abs(placed).max() + np.abs(reference).max())
    if slack > 0.1 * bound:
        return
    bounds = bound - slack, bound + slack
    spread = run.call(
        "deviation",
        lambda: tolvol.deviation(placed, case.triangles, reference, case.triangles, bounds=bounds, threads=1),
    )
    most, least = spread.share_beyond_range[0][1], spread.share_beyond_range[1][0]
    if not least - SAMPLING <= below + beyond <= most + SAMPLING:
        raise Finding("shares", f"{below + beyond} are beyond the tolerance, by deviation {least} to {most}")


def _facts(run, points):
    """Judges solidity by NumPy, and that crossing_pairs stops after as many pairs as it is to find."""
    triangles = run.case.triangles

    class Facts:
        def __init__(self, threads, progress):
            self.facts = tolvol.solidity(points, triangles, threads=threads, progress=progress)

    facts = run.repeated("solidity", Facts, ("facts",)).facts
    faces = np.unique(points + 0.0, axis=0, return_inverse=True)[1].reshape(-1)[triangles]
    proper = faces[(faces != np.roll(faces, 1, axis=1)).all(1)]
    sides = proper[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges, edge, count = np.unique(np.sort(sides, 1), axis=0, return_inverse=True, return_counts=True)
    upwards = np.bincount(edge.reshape(-1), sides[:, 0] < sides[:, 1], minlength=len(edges))
    wanted = {
        "degenerate_triangles": len(faces) - len(proper),
        "open_edges": (count == 1).sum(),
        "non_manifold_edges": (count > 2).sum(),
        "misoriented_edges": ((count == 2) & (upwards != 1)).sum(),
        "closed": len(proper) > 0 and not (count == 1).any(),
    }
    found = {name: facts[name] for name in wanted}
    if found != wanted:
        raise Finding("solidity", f"{found}, by NumPy {wanted}")
    all_pairs = run.call("crossing_pairs", lambda: tolvol.crossing_pairs(points, triangles, most=MOST_PAIRS))
    most = len(all_pairs) // 2 + 1
    some_pairs = run.call("crossing_pairs", lambda: tolvol.crossing_pairs(points, triangles, most=most))
    if len(some_pairs) != min(most, len(all_pairs)):
        raise Finding("crossing_pairs", f"{len(some_pairs)} pairs of {len(all_pairs)}, where {most} are asked for")


def draw_hausdorff(rng, case):
    case.arrays["motion"] = motion_of(rng, case, float(some(rng, 0, 1e-6, 1, 30)))
    case.options["every"] = int(some(rng, 1, 2, 10))
    case.options["swapped"] = bool(rng.random() < 0.5)


def _pair(run):
    """Returns the mesh and a copy that was moved and lost faces, in world coordinates: these functions take no matrix."""
    case = run.case
    moved = case.vertices + case.arrays.get("motion", 0).astype(case.vertices.dtype)
    pair = [(case.vertices, case.triangles), (moved, np.ascontiguousarray(case.triangles[:: case.options["every"]]))]
    return pair[::-1] if case.options["swapped"] else pair


class _Interval:
    def __init__(self, interval):
        self.lower, self.upper, self.position = interval.lower, interval.upper, interval.position
        self.triangle = interval.triangle


def hausdorff(run):
    a, b = _pair(run)

    def call(threads, progress):
        return _Interval(tolvol.directed_hausdorff(*a, *b, threads=threads, progress=progress))

    found = run.repeated("hausdorff", call, ("lower", "upper", "position", "triangle"))
    both = run.call("hausdorff", lambda: tolvol.hausdorff(*a, *b, threads=1))
    backward = run.call("hausdorff", lambda: tolvol.directed_hausdorff(*b, *a, threads=1))
    ways = (found, backward), (both.forward, both.backward)
    if any((x.lower, x.upper, x.triangle) != (y.lower, y.upper, y.triangle) for x, y in zip(*ways)):
        raise Finding("both ways", "hausdorff differs from directed_hausdorff")
    if (both.lower, both.upper) != tuple(max(getattr(way, end) for way in ways[0]) for end in ("lower", "upper")):
        raise Finding("both ways", f"{both.lower} to {both.upper} is not the larger one of the two ways")
    together = np.concatenate([a[0][a[1].ravel()], b[0][b[1].ravel()]]).astype(np.float64)
    size = np.abs(together).max()
    if not np.ptp(together, axis=0).any():
        size = max(size, 1.0)  # A single point has size 0, with which rounding cannot be compared.
    if not 0 <= found.lower <= found.upper or not np.isfinite(found.upper):
        raise Finding("interval", f"{found.lower} to {found.upper}")
    if found.upper - found.lower > 0.01 * found.upper + 1e-13 * size:
        raise Finding("wide", f"{found.lower} to {found.upper}, where 1 % is promised")
    bounds = [found.upper * (1 + 1e-6) + 1e-13 * size]
    if found.lower > 1e-6 * size:
        bounds.append(found.lower * (1 - 1e-6))
    for bound in bounds:
        judged = run.call("hausdorff", lambda bound=bound: tolvol.directed_hausdorff(*a, *b, bound=bound, threads=1))
        if judged.lower > found.upper * (1 + 1e-12) or judged.upper < found.lower * (1 - 1e-12):
            raise Finding(
                "bound", f"{found.lower} to {found.upper}, but {judged.lower} to {judged.upper} with {bound=}"
            )
        if judged.lower <= bound < judged.upper:
            raise Finding("bound", f"{judged.lower} to {judged.upper} is not decided against {bound}")
    if run.case.options.get("cgal") and found.upper > 1e-9 * size:
        error = 0.01 * found.upper
        by_cgal = judges.cgal_distance(a, b, error)
        if by_cgal is not None and not found.lower - error <= by_cgal <= found.upper + error:
            raise Finding("CGAL: hausdorff", f"{found.lower} to {found.upper}, by CGAL {by_cgal}")


draw_deviation = draw_hausdorff


def deviation(run):
    a, b = _pair(run)
    bounds, percentiles = (0.5 * run.case.tolerance, run.case.tolerance), (1, 50, 99)

    def call(threads, progress):
        return tolvol.deviation(*a, *b, bounds=bounds, percentiles=percentiles, threads=threads, progress=progress)

    found = run.repeated("deviation", call, ("mean", "rms", "percentiles", "share_beyond", "distances", "weights"))
    largest = run.call("hausdorff", lambda: tolvol.directed_hausdorff(*a, *b, threads=1))
    slack = 1e-9 * np.abs(np.concatenate([a[0], b[0]]).astype(np.float64)).max()
    if abs(found.weights.sum() - 1) > 1e-6 or len(found.weights) != len(found.distances):
        raise Finding("weights", f"{len(found.weights)} weights of together {found.weights.sum()}")
    if np.abs(found.distances).max() > largest.upper + slack:
        raise Finding("distances", f"a sample at {np.abs(found.distances).max()}, where {largest.upper} is the largest")
    for name in ("mean", "rms", "percentiles", "share_beyond"):
        value = np.atleast_1d(getattr(found, name))
        lower, upper = np.atleast_2d(getattr(found, name + "_range")).T
        if not (np.isfinite([value, lower, upper]).all() and (lower <= upper).all()):
            raise Finding("range", f"{name}: {value} in {lower} to {upper}")
        if ((value < lower - slack) | (value > upper + slack)).any():
            raise Finding("range", f"{name}: {value} is not in {lower} to {upper}")
        if name != "share_beyond" and (lower > largest.upper + slack).any():
            raise Finding("range", f"{name}: at least {lower}, where the largest distance is at most {largest.upper}")
