# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds from below how few triangles collapses can leave of a closed mesh of which faces are missing, whatever the tolerance.

The faces that are there form parts, and those that are missing form holes; both hang together by edges. An edge with one face
is between a part and a hole. No collapse closes a hole, parts sheets that meet, or lets a part vanish, and so each part and
each hole keeps a rim of three edges or more. A collapse of an edge between a part and a hole takes one edge from both rims:
there can be no more of them than a flow from the parts to the holes through these edges, of which each part can give, and
each hole can take, the edges of its rim but three. With B of these edges left and no vertex inside, a mesh of Euler
characteristic c has B - 2 c triangles, and collapses do not change c.
"""

from collections import deque

import numpy as np


def least_open(triangles, is_there):
    """Returns the bound for the faces `is_there`, bool (m,), of a closed and oriented mesh's triangles, int (m, 3)."""
    corners = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    order = np.lexsort(corners.T)
    pairs = order.reshape(-1, 2) // 3  # the two faces at each edge
    ends = corners[order[::2]]
    faces_there = is_there[pairs].sum(1)
    rim = pairs[faces_there == 1]
    inner_vertices = np.setdiff1d(triangles[is_there], ends[faces_there == 1]).size
    # Where sheets meet in a vertex alone, it counts once for each: once for each edge with one face that begins there.
    vertices, edges = len(rim) + inner_vertices, len(rim) + (faces_there == 2).sum()
    characteristic = vertices - edges + is_there.sum()
    label = _parts(len(triangles), pairs[faces_there != 1])
    of_part = np.where(is_there[rim[:, 0]], label[rim[:, 0]], label[rim[:, 1]])
    of_hole = np.where(is_there[rim[:, 0]], label[rim[:, 1]], label[rim[:, 0]])
    return int(len(rim) - _flow(of_part, of_hole) - 2 * characteristic)


def _parts(count, pairs):
    """Returns for each of `count` faces the lowest of those that hang together with it by the pairs."""
    label = np.arange(count)
    while True:
        least = label.copy()
        for a, b in (pairs.T, pairs.T[::-1]):
            np.minimum.at(least, a, label[b])
        if (least == label).all():
            return label
        label = least


def _flow(of_part, of_hole):
    """Returns the largest number of rim edges that parts and holes can lose, by paths that raise it one by one."""
    ends = np.stack([of_part, of_hole], 1).tolist()
    spare, at = {}, {}
    for edge, pair in enumerate(ends):
        for node in pair:
            spare[node] = spare.get(node, -3) + 1
            at.setdefault(node, []).append(edge)
    parts = set(of_part.tolist())
    lost = [False] * len(ends)
    while True:
        came_by = {part: None for part in parts if spare[part] > 0}
        queue, end = deque(came_by), None
        while queue and end is None:
            node = queue.popleft()
            for edge in at[node]:
                other = ends[edge][node in parts]
                if lost[edge] == (node in parts) or other in came_by:
                    continue
                came_by[other] = node, edge
                if other not in parts and spare[other] > 0:
                    end = other
                    break
                queue.append(other)
        if end is None:
            return sum(lost)
        spare[end] -= 1
        while came_by[end]:
            end, edge = came_by[end]
            lost[edge] = not lost[edge]
        spare[end] -= 1
