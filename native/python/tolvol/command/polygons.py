# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts polygons into triangles."""

import numpy as np

_BLOCK = 1 << 13  # quads at once, whose numbers stay in the cache


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
    sizes = sizes.astype(np.int32)
    starts = np.cumsum(sizes, dtype=np.int32) - sizes
    counts = np.maximum(sizes - 2, 0)
    firsts = np.cumsum(counts, dtype=np.int32) - counts  # the first triangle of each polygon
    triangles = np.empty((counts.sum(), 3), np.int32)
    threes = np.flatnonzero(sizes == 3)
    for k in range(3):
        triangles[firsts[threes], k] = starts[threes] + k
    fours = np.flatnonzero(sizes == 4)
    for place, quad_corners in enumerate(_quads(vertices, corners, starts[fours])):
        for k in range(3):
            triangles[firsts[fours] + place, k] = quad_corners[k]
    for polygon in np.flatnonzero(sizes > 4).tolist():
        at = starts[polygon] + np.arange(sizes[polygon])
        cut = at[_polygon(vertices[corners[at]].astype(np.float64))]
        triangles[firsts[polygon] : firsts[polygon] + len(cut)] = cut
    return triangles, np.repeat(np.arange(len(sizes), dtype=np.int32), counts)


def _quads(vertices, corners, starts):
    """Returns (2, 3, quads): the places of the corners of both triangles of each quad."""
    blocks = np.split(starts, range(_BLOCK, len(starts), _BLOCK))
    dent = np.concatenate([_have_dents(*(vertices[corners[block + k]] for k in range(4))) for block in blocks])
    return np.stack([[starts, starts + 1, starts + 2 + dent], [starts + dent, starts + 2, starts + 3]])


def _have_dents(*corners):
    """Tells which quads, by their four corners, the cut from the first to the third corner does not divide."""
    a, b, c, d = (corner.T.astype(np.float64, "C") for corner in corners)
    across = c - a
    (x, y, z), (u, v, w) = _cross(b - a, across), _cross(across, d - a)
    return x * u + y * v + z * w < 0


def _cross(one, other):
    """Returns the cross products of vectors whose coordinates are rows."""
    (x, y, z), (u, v, w) = one, other
    return y * w - z * v, z * u - x * w, x * v - y * u


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
    corner = flat[found]
    one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    if (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum() < 0:
        found = found[:, ::-1]
    # Points on a line between others, and all but one of those at one position, are left out there. As they are part of
    # the surface, they get triangles without an area.
    found = np.concatenate([found, _flat_triangles(np.unique(found), count)])
    return found if len(found) == count - 2 else fan


def _flat_triangles(used, count):
    """Returns (k, 3): a fan from each used corner over the unused ones that follow, up to the next used one.

    used: indices of corners of a polygon with `count` corners, ascending.
    """
    flat = []
    for corner, following in zip(used, np.roll(used, -1)):
        ways = (following - corner) % count
        flat += [(corner, (corner + k) % count, (corner + k + 1) % count) for k in range(1, ways)]
    return np.array(flat, int).reshape(-1, 3)
