# SPDX-License-Identifier: GPL-3.0-or-later
"""decimate with any of its options, judged by the promises of its docstring."""

import numpy as np
import tolvol

import judge

from . import judges
from .case import Finding
from .parts import motion_of, moved, proved_inside, some, volume_of

RESULT = (
    "vertices",
    "triangles",
    "vertex_map",
    "vertex_source",
    "triangle_source",
    "source_triangle",
    "source_weights",
)


def draw_decimate(rng, case):
    options, n = case.options, len(case.vertices)
    options["placement"] = some(rng, "optimal", "optimal", "subset")
    options["two_sided"] = bool(rng.random() < 0.7)
    if rng.random() < (0.3 if len(case.triangles) < 5000 else 0.05):
        options["effort"] = "thorough"
        if rng.random() < 0.3:
            options["max_seconds"] = float(some(rng, 0.001, 0.05, 0.5))
    if rng.random() < 0.3:
        options["max_normal_angle"] = float(some(rng, 5, 45, 90, 180))
    if rng.random() < 0.2:
        options["target_triangles"] = int(rng.integers(1, len(case.triangles) + 2))
    if rng.random() < 0.2:
        case.arrays["locked"] = rng.random(n) < rng.random()
    if rng.random() < 0.2:
        case.arrays["shares"] = np.full(n, some(rng, 0.1, 0.5, 0.9)) if rng.random() < 0.5 else rng.random(n)
    if rng.random() < 0.1:
        case.arrays["side"] = rng.random(n) < 0.5
    if rng.random() < 0.15:
        options["moved"], options["outside"] = float(some(rng, 0.1, 0.5, 2)), some(rng, "error", "keep", "keep")
        case.arrays["motion"] = motion_of(rng, case, options["moved"])
    options["crossings"] = "allow" if rng.random() < 0.2 else "keep_out"
    if rng.random() < 0.05 and not options.get("moved"):
        options["free"] = True
        options.setdefault("target_triangles", int(rng.integers(1, len(case.triangles) + 2)))
    # This comes last, so that it changes nothing else of a case.
    if options["two_sided"] and not options.get("moved") and not options.get("free") and n and rng.random() < 0.1:
        lower, upper = case.vertices.min(0).astype(float), case.vertices.max(0).astype(float)
        margin = 0.1 * ((upper - lower).max() or 1.0)
        options["cell"] = np.sort(rng.uniform(lower - margin, upper + margin, (2, 3)), axis=0).tolist()


def decimate(run):
    case, options, arrays = run.case, run.case.options, run.case.arrays
    vertices, triangles = moved(run), case.triangles
    volume = volume_of(run)
    given = {
        name: options[name]
        for name in (
            "placement",
            "two_sided",
            "effort",
            "max_seconds",
            "max_normal_angle",
            "target_triangles",
            "outside",
            "crossings",
            "cell",
        )
        if name in options
    }
    given |= {name: arrays[name] for name in ("locked", "shares") if name in arrays}
    side = None
    if "side" in arrays:
        side = arrays["side"][triangles[:, 0]]
        values = np.repeat(side[:, None, None], 3, axis=1).astype(np.float32)
        given["wedges"] = run.call("wedges", lambda: tolvol.wedges(triangles, values))

    def call(threads, progress):
        return tolvol.decimate(
            vertices, triangles, volume, to_world=case.to_world, threads=threads, progress=progress, **given
        )

    result = run.repeated("decimate", call, RESULT, same=not options.get("max_seconds"))
    _judge_decimation(run, result, vertices, triangles, volume, given, side)


def _judge_decimation(run, result, vertices, triangles, volume, given, side):
    case, report = run.case, result.report
    run.tell("judging")
    judges.valid(run, result.vertices, result.triangles, vertices.dtype)
    if report["triangles_out"] != len(result.triangles) or len(result.triangles) > len(triangles):
        raise Finding(
            "count", f"{len(result.triangles)} triangles of {len(triangles)}, {report['triangles_out']} reported"
        )
    if report["stopped_by"] == "target" and len(result.triangles) > given["target_triangles"]:
        raise Finding("target", f"stopped at the target with {len(result.triangles)} triangles")
    if given.get("placement") == "subset":
        # Where sheets meet, a vertex may be carried to the place of another original one.
        moved = result.vertices[(result.vertices != vertices[result.vertex_source]).any(1)]
        if not set(map(tuple, moved)) <= set(map(tuple, vertices)):
            raise Finding("subset", "a vertex is at the place of no original one")
    if given.get("effort") != "thorough" and volume is not None:
        try:
            judge.assert_sources(vertices, triangles, result, case.tolerance, case.to_world)
        except AssertionError as error:
            raise Finding("sources", f"the maps from and to the input disagree: {error}") from None
    if side is not None:
        crossing = side[result.source_triangle] != side[result.triangle_source][:, None]
        if crossing.any():
            raise Finding("wedges", f"{crossing.sum()} corners take their attributes from across a seam")
    if "locked" in given:
        _judge_locked(result, vertices, triangles, given["locked"])
    if "cell" in given:
        _judge_cell(result, vertices, triangles, np.array(given["cell"]))

    if volume is None:
        return
    kept = np.zeros(len(result.triangles), bool)
    if report["outside"]["faces"]:
        outside = ~proved_inside(run, vertices, triangles, volume)
        if report["outside"]["faces"] > outside.sum():
            raise Finding("outside", f"{report['outside']['faces']} faces said to be outside, check: {outside.sum()}")
        kept = outside[result.triangle_source]
    reference = case.world(case.vertices), triangles
    placed = case.world(result.vertices)
    judges.within(run, (placed, result.triangles[~kept]), reference, case.tolerance, "result to reference")
    shares = given.get("shares")
    if shares is not None and len(np.unique(shares)) == 1 and vertices is case.vertices and not len(report["repairs"]):
        narrow = max(shares[0] * case.tolerance, 1e-3 * case.tolerance)
        judges.within(run, (placed, result.triangles), reference, narrow, "result to reference, by its share")
    if given["two_sided"] and not report["outside"]["reference_faces"]:
        judges.within(run, reference, (placed, result.triangles), case.tolerance, "reference to result")
    before, after = (vertices, triangles), (result.vertices, result.triangles)
    now = judges.crossing_count(run, *after)
    if now and given.get("crossings") != "allow" and judges.crossing_count(run, *before) < now:
        judges.no_more_crossings(run, before, after, result.triangle_source)
    if vertices is case.vertices:
        angle = given.get("max_normal_angle", 90)
        judges.angles_kept(run, after, before, report, angle)
    joins = judge.joins_t_junctions(result)
    judges.connected_alike(run, before, after, joins)
    if not given["two_sided"] and vertices is case.vertices and not joins:
        judges.rims_alike(run, before, after, case.tolerance)


def _judge_cell(result, vertices, triangles, cell):
    """Faces that are not strictly inside the cell are as they were, and what becomes of the others is inside."""
    corners, before = result.vertices[result.triangles], vertices[triangles[result.triangle_source]]
    inside = ((before > cell[0]) & (before < cell[1])).all((1, 2))
    # -0.0 may have become 0.0, which is the same place. A face may begin at another corner.
    turned = (np.roll(before[~inside], k, axis=1) for k in range(3))
    if not np.any([(corners[~inside] == one).all((1, 2)) for one in turned], axis=0).all():
        raise Finding("cell", "a face that reaches out of the cell is not as it was")
    if not ((corners[inside] > cell[0]) & (corners[inside] < cell[1])).all():
        raise Finding("cell", "a face has left the cell")


def _consists_of(edge, vertices, place, edges):
    """Whether a segment between two vertices consists of edges, given by the places of their ends.

    Where T-junctions were joined, a locked edge is divided by the vertices that lay on it.
    """
    a, b = vertices[edge].astype(np.float64)
    way, from_a = b - a, vertices - a
    along = from_a @ way / (way @ way)
    rounding = 8 * np.finfo(vertices.dtype).eps * np.abs(vertices).max()
    on_edge = np.linalg.norm(from_a - along[:, None] * way, axis=1) <= rounding
    between = np.flatnonzero(on_edge & (along > 0) & (along < 1))
    chain = place[[edge[0], *between[np.argsort(along[between])], edge[1]]].tolist()
    return all(p == q or tuple(sorted((p, q))) in edges for p, q in zip(chain, chain[1:]))


def _judge_locked(result, vertices, triangles, locked):
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    now = result.vertex_map[locked & used]
    if (now < 0).any() or not np.array_equal(result.vertices[now], vertices[locked & used]):
        raise Finding("locked", "a locked vertex is not where it was")
    # Edges are identified by their vertices, because sheets that touch without sharing vertices are different sheets. But
    # if a face exists twice with separate vertices, one of the two is dropped, and the edge then belongs to the other.
    edges = judges.edge_counts(triangles[(triangles != np.roll(triangles, 1, axis=1)).all(1)])[0]
    wanted = np.sort(result.vertex_map[edges[locked[edges].all(1)]], 1)
    there = judges.edge_counts(result.triangles)[0]
    by_vertex = {tuple(edge) for edge in there.tolist()}
    lost = [edge for edge in wanted.tolist() if edge[0] != edge[1] and tuple(edge) not in by_vertex]
    if lost:
        place = np.unique(result.vertices + 0.0, axis=0, return_inverse=True)[1]
        by_place = {tuple(sorted(edge)) for edge in place[there].tolist()}
        lost = [edge for edge in lost if tuple(sorted(place[edge].tolist())) not in by_place]
        lost = [edge for edge in lost if place[edge[0]] != place[edge[1]]]  # A face that is a segment is dropped.
    if lost and judge.joins_t_junctions(result):
        lost = [edge for edge in lost if not _consists_of(edge, result.vertices, place, by_place)]
    if lost:
        a, b = result.vertices[lost[0]]
        raise Finding("locked edge", f"{len(lost)} edges between locked vertices are gone, {a} to {b}")
