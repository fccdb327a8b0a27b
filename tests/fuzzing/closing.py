# SPDX-License-Identifier: GPL-3.0-or-later
"""close_holes and the decimation of what it closed, judged by the promises of its docstring."""

import numpy as np
import tolvol

import judge

from . import judges
from .case import Finding
from .decimating import RESULT
from .parts import some

CLOSED = ("triangles", "triangle_loop", "borders", "corner_source")
REASONS = {
    "not_a_loop",
    "too_long",
    "perimeter",
    "outside",
    "turned",
    "crossing",
    "non_manifold",
    "degenerate",
    "given_up",
}


def draw_close_holes(rng, case):
    """Takes faces out of the mesh, one by one or around places, and turns some over."""
    count = len(case.triangles)
    if count:
        gone = rng.random(count) < some(rng, 0, 0.01, 0.1, 0.3, 0.6) * rng.random()
        centres = case.vertices[case.triangles].mean(1)
        for _ in range(rng.integers(0, 4)):
            away = np.linalg.norm(centres - centres[rng.integers(count)], axis=1)
            gone |= away < np.quantile(away, rng.random() * 0.1)
        case.triangles = case.triangles[~gone] if not gone.all() else case.triangles
        if rng.random() < 0.1:
            turned = rng.random(len(case.triangles)) < 0.05
            case.triangles[turned] = case.triangles[turned][:, ::-1]
    if rng.random() < 0.3:
        case.options["largest_perimeter"] = float(case.size() * 10 ** rng.uniform(-2, 1)) or 1.0
    if rng.random() < 0.3:
        case.options["max_normal_angle"] = float(some(rng, 30, 90, 179, 180))
    if rng.random() < 0.2:
        n = len(case.vertices)
        case.arrays["shares"] = np.full(n, some(rng, 0.1, 0.5, 0.9)) if rng.random() < 0.5 else rng.random(n)
        case.arrays["shares"][rng.random(n) < 0.1] = 0


def close_holes(run):
    case = run.case
    volume = run.volume()
    given = {name: case.options[name] for name in ("largest_perimeter", "max_normal_angle") if name in case.options}
    given |= {name: case.arrays[name] for name in ("shares",) if name in case.arrays}

    def call(threads, progress):
        return tolvol.close_holes(
            case.vertices, case.triangles, volume, to_world=case.to_world, threads=threads, progress=progress, **given
        )

    closed = run.repeated("close_holes", call, CLOSED)
    run.tell("judging")
    _judge(run, closed, given)
    if not len(closed.triangle_loop):
        return

    def decimate(threads, progress):
        return tolvol.decimate(
            case.vertices, closed.triangles, volume, to_world=case.to_world, threads=threads, progress=progress
        )

    result = run.repeated("decimate", decimate, RESULT)
    if result.report["outside"]["faces"] or result.report["outside"]["reference_faces"]:
        raise Finding("outside", "faces that were certified are outside")
    reference = case.world(case.vertices), case.triangles
    placed = case.world(result.vertices), result.triangles
    judges.within(run, placed, reference, case.tolerance, "decimated to reference")
    judges.within(run, reference, placed, case.tolerance, "reference to decimated")
    joins = judge.joins_t_junctions(result)
    judges.connected_alike(run, (case.vertices, closed.triangles), (result.vertices, result.triangles), joins)


def _judge(run, closed, given):
    case, count = run.case, len(run.case.triangles)
    judges.valid(run, case.vertices, closed.triangles, case.vertices.dtype)
    added = closed.triangles[count:]
    if not np.array_equal(closed.triangles[:count], case.triangles):
        raise Finding("input", "a triangle of the input changed")
    judges.within(
        run,
        (case.world(case.vertices), added),
        (case.world(case.vertices), case.triangles),
        case.tolerance,
        "new faces to reference",
    )
    if "shares" in given and len(added):
        _judge_shares(run, added, given["shares"][added].min(1))
    pairs = run.call("crossing_pairs", lambda: tolvol.crossing_pairs(case.vertices, closed.triangles, most=10**6))
    if (pairs >= count).any():
        raise Finding("crossings", f"new faces cross others: {pairs[(pairs >= count).any(1)][:3].tolist()}")

    outcomes = [loop["outcome"] for loop in closed.loops]
    is_closed = np.array([outcome == "closed" for outcome in outcomes], bool)
    if set(outcomes) - REASONS - {"closed"}:
        raise Finding("outcome", f"{set(outcomes)}")
    if closed.report["closed"] != is_closed.sum() or sum(closed.report["refused"].values()) != (~is_closed).sum():
        raise Finding("count", f"{closed.report} for {outcomes}")
    corners = np.array([loop["corners"] for loop in closed.loops], int)
    if len(added) != (corners[is_closed] - 2).sum():
        raise Finding("count", f"{len(added)} new triangles for loops of {corners[is_closed]} corners")
    limit = given.get("largest_perimeter")
    for loop in closed.loops:
        if limit is not None and loop["outcome"] == "closed" and loop["perimeter"] > limit:
            raise Finding("perimeter", f"a loop of {loop['perimeter']} is closed, the limit is {limit}")

    # Edges by position, without triangles that repeat another in the same direction.
    before, after = (_edges(case.vertices, faces) for faces in (case.triangles, closed.triangles))
    open_before, open_after = (sum(sum(sides) == 1 for sides in edges.values()) for edges in (before, after))
    if open_after != open_before - corners[is_closed].sum():
        raise Finding("open edges", f"{open_before} became {open_after}, {corners[is_closed].sum()} were closed")
    for edge, sides in after.items():
        had = before.get(edge, [0, 0])
        if sides != had and sides != [1, 1]:
            raise Finding("edge", f"the edge {edge} had {had} sides in its two directions and has {sides}")
    if not np.array_equal(case.vertices[case.triangles.ravel()[closed.corner_source]], case.vertices[added]):
        raise Finding("corner_source", "a corner is not at the place of its source")
    at_rim = closed.borders >= 0
    if at_rim.sum() != corners[is_closed].sum():
        raise Finding("borders", f"{at_rim.sum()} sides at rims of {corners[is_closed].sum()} edges")


def _judge_shares(run, added, share):
    """Judges that each new triangle is within its share of the tolerance, in four groups of about equal shares."""
    case = run.case
    if not share.all():
        raise Finding("shares", f"{(share == 0).sum()} new triangles are at vertices of share 0")
    placed = case.world(case.vertices)
    for group in np.array_split(np.argsort(share), 4):
        if len(group):
            narrow = max(share[group].max(), 1e-3) * case.tolerance
            judges.within(run, (placed, added[group]), (placed, case.triangles), narrow, "new faces, by their shares")


def _edges(vertices, triangles):
    """Returns {edge: the number of triangles that run through it [upwards, downwards]}, by numbers of places."""
    places, label = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    faces = label.reshape(-1)[triangles]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(1)]
    first = np.argmin(faces, 1) if len(faces) else np.zeros(0, int)
    turned = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, 1)
    edges = {}
    for face in np.unique(turned, axis=0).tolist():
        for k in range(3):
            a, b = face[k], face[(k + 1) % 3]
            edges.setdefault((min(a, b), max(a, b)), [0, 0])[a > b] += 1
    return edges
