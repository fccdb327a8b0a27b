# SPDX-License-Identifier: GPL-3.0-or-later
"""check, distance, hausdorff and deviation, each judged by another of these functions or by CGAL."""

import numpy as np
import tolvol

from . import judges
from .case import Finding
from .parts import faces_of, motion_of, proved_inside, some, within_as_pieces


def draw_check(rng, case):
    case.options["corners"] = int(rng.integers(1, 5))
    case.arrays["motion"] = motion_of(rng, case, float(some(rng, 0, 1e-9, 0.3, 1, 3)))


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
    together = np.concatenate([a[0], b[0]]).astype(np.float64)
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
