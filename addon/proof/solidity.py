# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells whether a surface bounds a solid: facts about its connectivity and its crossings, by what is stored.

Vertices at the same position are one vertex. Facts are a dictionary:

    closed, boundary_loops, open_edges            an edge of one triangle is open; loops: groups of open edges that touch
    manifold, non_manifold_edges, non_manifold_vertices    an edge of more than two triangles; a vertex at which the
                                                  triangles do not all hang together by edges
    oriented, misoriented_edges                   an edge that its two triangles run through the same way
    uncrossed, crossing_pairs                     of triangles that meet anywhere but in the corners and edges that they
                                                  share; at most MOST_PAIRS are counted
    degenerate_triangles                          with two equal corners; left out of all the above but the crossings
    shells                                        groups of triangles that hang together by edges
    area, volume                                  in the units of the world; volume: None unless closed and oriented

All but the last two are exact.
"""

import numpy as np

from .. import native

# Where a mesh has so many pairs or more, they are not counted further: 100,000 faces on one place have five thousand million.
MOST_PAIRS = 1_000_000
# What can be required of a surface.
REQUIREMENTS = ("closed", "manifold", "oriented", "uncrossed")


def crossing_count(arrays, threads=None, progress=None):
    """Returns the number of pairs of triangles of a MeshArrays that cross each other, at most MOST_PAIRS.

    It is exact for the coordinates as they are stored. About 2 us for each triangle.
    """
    if not len(arrays.triangles):
        return 0
    return len(
        native.module.crossing_pairs(
            arrays.vertices, arrays.triangles, most=MOST_PAIRS, threads=threads or None, progress=progress
        )
    )


def facts(surface, threads=None, progress=None):
    """Returns the facts about a Surface. About 3 us for each triangle."""
    arrays = surface.arrays
    _, place = np.unique(arrays.vertices + 0.0, axis=0, return_inverse=True)  # 0.0 makes -0 the 0 that it equals
    triangles = place.reshape(-1)[arrays.triangles]
    proper = (triangles != np.roll(triangles, 1, axis=1)).all(1)
    triangles = triangles[proper]
    # Side k of a triangle goes from its corner k to the next.
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    keys = np.minimum(start, end).astype(np.int64) * (len(place) + 1) + np.maximum(start, end)
    order = np.argsort(keys, kind="stable")
    _, first, count = np.unique(keys[order], return_index=True, return_counts=True)
    pairs = np.stack([order[first[count == 2]], order[first[count == 2] + 1]], 1)
    open_sides = order[first[count == 1]]
    misoriented = int((start[pairs[:, 0]] == start[pairs[:, 1]]).sum())
    loops = np.unique(_components(len(place), np.stack([start, end], 1)[open_sides])[start[open_sides]])
    more = int((count > 2).sum())
    sides = _neighbours(order, first)
    split = _split_vertices(triangles, sides)
    pairs_crossing = crossing_count(arrays, threads, progress)
    world = surface.world()[arrays.triangles]
    cross = np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0])
    closed = len(open_sides) == 0 < len(triangles)
    volume = None
    if closed and not misoriented and not more:
        middle = world.reshape(-1, 3).mean(0)
        volume = float(np.einsum("ij,ij->i", world[:, 0] - middle, cross).sum() / 6)
    return {
        "closed": closed,
        "boundary_loops": len(loops),
        "open_edges": len(open_sides),
        "manifold": more == 0 and split == 0,
        "non_manifold_edges": more,
        "non_manifold_vertices": split,
        "oriented": misoriented == 0,
        "misoriented_edges": misoriented,
        "uncrossed": pairs_crossing == 0,
        "crossing_pairs": pairs_crossing,
        "degenerate_triangles": int((~proper).sum()),
        "shells": len(np.unique(_components(len(triangles), sides // 3))),
        "area": float(np.linalg.norm(cross, axis=1).sum() / 2),
        "volume": volume,
    }


def _neighbours(order, first):
    """Returns pairs of sides that lie on the same edge, so that all sides of an edge hang together."""
    inner = np.ones(len(order), bool)
    inner[first] = False
    at = np.flatnonzero(inner)
    return np.stack([order[at - 1], order[at]], 1)


def _split_vertices(triangles, sides):
    """Returns the number of vertices at which the triangles form more than one group that hangs together by edges."""
    following = sides - sides % 3 + (sides + 1) % 3  # the corners at the other ends of the sides
    corner = triangles.ravel()
    same = corner[sides[:, 0]] == corner[sides[:, 1]]  # both sides run the same way
    a = np.where(same, sides[:, 1], following[:, 1])
    b = np.where(same, following[:, 1], sides[:, 1])
    links = np.concatenate([np.stack([sides[:, 0], a], 1), np.stack([following[:, 0], b], 1)])
    group = _components(len(corner), links)
    at = np.unique(np.stack([corner, group], 1), axis=0)[:, 0]
    return int((np.bincount(at) > 1).sum())


def _components(count, links):
    """Returns a label for each of `count` things, the same for those that links, an array of pairs, hang together."""
    label = np.arange(count)
    links = np.asarray(links).reshape(-1, 2)
    while len(links):
        ends = label[links]
        links = links[ends[:, 0] != ends[:, 1]]
        ends = label[links]
        label[ends.max(1)] = ends.min(1)
        while not np.array_equal(label, label[label]):
            label = label[label]
    return label


def lacking(found):
    """Returns what keeps a surface of these facts from bounding a solid: texts by the names of REQUIREMENTS."""

    def counted(key, one, several):
        return f"{found[key]:,} {one if found[key] == 1 else several}"

    manifold = (
        counted("non_manifold_edges", "edge of more than two faces", "edges of more than two faces"),
        counted("non_manifold_vertices", "vertex where sheets touch", "vertices where sheets touch"),
    )
    texts = {
        "closed": counted("boundary_loops", "boundary loop", "boundary loops"),
        "manifold": " and ".join(text for text in manifold if not text.startswith("0 ")),
        "oriented": counted("misoriented_edges", "edge between turned faces", "edges between turned faces"),
        "uncrossed": counted("crossing_pairs", "crossing pair of faces", "crossing pairs of faces"),
    }
    return {name: texts[name] for name in REQUIREMENTS if not found[name]}


def line(found):
    """Returns one line of text: whether a surface of these facts can be printed, or what is in the way."""
    missing = lacking(found)
    if not missing:
        return "closed, manifold, no crossings: printable"
    return f"not printable: {', '.join(missing.values())}"


def change(of_a, of_b):
    """Returns by how much the area and the volume of A differ from those of B, as shares of B's. None: not known."""
    return {
        name: None if None in (of_a[name], of_b[name]) or not of_b[name] else of_a[name] / of_b[name] - 1
        for name in ("area", "volume")
    }
