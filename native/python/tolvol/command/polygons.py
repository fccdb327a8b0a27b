# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts polygons into triangles."""

import numpy as np


def triangulated(vertices, corners, sizes):
    """Returns (m, 3), the places in `corners` of the corners of triangles that cut up all polygons, and (m,), their polygons.

    corners: the vertex at each corner of the polygons, one polygon after another; sizes: the number of corners of each, or
    one number for all. A polygon with fewer than three corners has no triangles. A quad is cut from its first corner to its
    third, unless one of these is a dent; other polygons are cut by mapbox_earcut in the plane that fits them best.
    """
    if isinstance(sizes, int):
        if sizes == 3:
            triangles = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
            return triangles, np.arange(len(triangles), dtype=np.int32)
        sizes = np.full(len(corners) // max(sizes, 1), sizes)
    starts = np.cumsum(sizes) - sizes
    parts, places = [], []
    threes = np.flatnonzero(sizes == 3)
    parts.append(starts[threes][:, None] + np.arange(3))
    places.append(threes)
    fours = np.flatnonzero(sizes == 4)
    parts.append(_quads(vertices, corners, starts[fours]).reshape(-1, 3))
    places.append(np.repeat(fours, 2))
    for polygon in np.flatnonzero(sizes > 4).tolist():
        at = starts[polygon] + np.arange(sizes[polygon])
        parts.append(at[_polygon(vertices[corners[at]].astype(np.float64))])
        places.append(np.full(len(parts[-1]), polygon))
    # The triangles stand in the order of the polygons.
    of = np.concatenate(places).astype(np.int32)
    order = np.argsort(of, kind="stable")
    return np.concatenate(parts)[order].astype(np.int32), of[order]


def _quads(vertices, corners, starts):
    """Returns (quads, 2, 3)."""
    a, b, c, d = (vertices[corners[starts + k]].astype(np.float64) for k in range(4))
    dent = (np.cross(b - a, c - a) * np.cross(c - a, d - a)).sum(1) < 0
    first, second = np.array([[0, 1, 2], [0, 2, 3]]), np.array([[0, 1, 3], [1, 2, 3]])
    return starts[:, None, None] + np.where(dent[:, None, None], second, first)


def _polygon(points):
    """Returns (k, 3) indices of points that cut up one polygon."""
    import mapbox_earcut

    count = len(points)
    fan = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], 1)
    following = np.roll(points, -1, 0)
    normal = np.cross(points - points[0], following - points[0]).sum(0)
    length = np.linalg.norm(normal)
    if not length:
        return fan  # It has no area: any triangles do.
    across = np.linalg.svd(normal[None] / length)[2][1:]
    if np.dot(np.cross(*across), normal) < 0:
        across = across[::-1]
    flat = np.ascontiguousarray((points - points[0]) @ across.T)
    found = mapbox_earcut.triangulate_float64(flat, np.array([count], np.uint32)).reshape(-1, 3).astype(int)
    if (
        len(found) != count - 2
    ):  # Points on one line are left out there; as they are part of the surface, they are kept.
        return fan
    corner = flat[found]
    one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    turned = (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum() < 0
    return found[:, ::-1] if turned else found
