# SPDX-License-Identifier: GPL-3.0-or-later
"""Divides what is not proved to be within the tolerance into connected regions.

A decimated mesh has large faces, of which small parts may be beyond. Where few triangles are not proved to be within, each is
therefore divided into pieces, and a region holds those pieces that have a corner beyond the tolerance.
"""

import math
from dataclasses import dataclass

import numpy as np

# All triangles together are divided into about so many pieces, and an edge into at most so many parts.
_PIECES, _MOST_PARTS = 1 << 16, 64


@dataclass(frozen=True)
class Region:
    """Connected pieces of triangles of a surface, in the world."""

    vertices: np.ndarray  # (n, 3) float64
    pieces: np.ndarray  # (k, 3) int32
    triangles: np.ndarray  # (k,) the triangle of the surface that each piece is part of


def find(vertices, triangles, chosen, largest, tolerance, distances, most):
    """Returns (at most so many Regions of the triangles with the indices `chosen`, the number of all of them).

    The first Region has the point of the largest distance, and the others follow by the largest distance at a corner. Each
    chosen triangle has a piece at least in some Region.

    vertices: (n, 3) float64, in the world; largest: the Interval of the largest distance; distances: a function that returns
    the distances of points.
    """
    parts = min(max(math.isqrt(_PIECES // len(chosen)), 1), _MOST_PARTS)
    weights, template = _lattice(parts)
    nodes = _nodes(vertices[triangles[chosen]], weights, parts)
    first = np.unique(nodes, return_index=True)[1]
    points = weights[first % len(weights)][:, None] @ vertices[triangles[chosen[first // len(weights)]]]
    points = points[:, 0] / parts
    distance = distances(points)
    pieces = nodes[:, template]  # (m, parts^2, 3)
    high = distance[pieces].max(2)
    # Between the corners a triangle may be beyond, too: the piece that is nearest to it stands for it.
    wanted = (high > tolerance) | (parts == 1)
    wanted[np.arange(len(chosen)), high.argmax(1)] = True
    at = int(np.flatnonzero(chosen == largest.triangle)[0])
    peak = _piece_of(vertices[triangles[largest.triangle]], largest.position, weights, template, parts)
    wanted[at, peak] = True
    owner, number = np.nonzero(wanted)
    kept = pieces[owner, number]
    labels = _components(kept, len(points))[kept[:, 0]]
    farthest = np.zeros(len(points))
    np.maximum.at(farthest, labels, high[owner, number])
    farthest[labels[np.flatnonzero((owner == at) & (number == peak))[0]]] = np.inf
    present = np.unique(labels)
    found = []
    for label in present[np.argsort(-farthest[present], kind="stable")][:most]:
        group = np.flatnonzero(labels == label)
        used, corners = np.unique(kept[group], return_inverse=True)
        found.append(Region(points[used], corners.reshape(-1, 3).astype(np.int32), chosen[owner[group]]))
    return found, len(present)


def _lattice(parts):
    """Returns (nodes, 3) int: the weights of the corners, `parts` in sum, at each point of a triangle whose edges are divided
    into so many parts; and (parts^2, 3): the points at the corners of each piece, which run as those of the triangle."""
    weights = [(parts - i - j, i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]
    at = {(i, j): number for number, (_, i, j) in enumerate(weights)}
    pieces = []
    for i in range(parts):
        for j in range(parts - i):
            pieces.append((at[i, j], at[i + 1, j], at[i, j + 1]))
            if i + j + 2 <= parts:
                pieces.append((at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]))
    return np.array(weights), np.array(pieces)


def _nodes(corners, weights, parts):
    """Returns (m, nodes) int: a number for each point of each triangle. Points of a common edge have one number.

    Corners at the same position are the same: the triangles of some files have vertices of their own.
    """
    _, ends = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    ends = ends.reshape(-1, 3)
    if parts == 1:
        return ends[:, weights.argmax(1)]
    count, next_number = len(ends), ends.max() + 1
    edges = np.stack([ends, np.roll(ends, -1, 1)], 2)  # (m, 3, 2)
    _, edge = np.unique(np.sort(edges, 2).reshape(-1, 2), axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    nodes = np.empty((count, len(weights)), np.int64)
    inside = np.flatnonzero((weights > 0).all(1))
    for i in range(3):
        nodes[:, weights[:, i] == parts] = ends[:, [i]]
        between = np.flatnonzero((weights[:, i] > 0) & (weights[:, (i + 1) % 3] > 0) & (weights[:, (i + 2) % 3] == 0))
        steps = weights[between, (i + 1) % 3]  # from the first end of the edge
        turned = (edges[:, i, 0] > edges[:, i, 1])[:, None]
        nodes[:, between] = next_number + edge[:, [i]] * (parts - 1) + np.where(turned, parts - steps, steps) - 1
    next_number += (edge.max() + 1) * (parts - 1)
    nodes[:, inside] = next_number + np.arange(count * len(inside)).reshape(count, -1)
    return np.unique(nodes, return_inverse=True)[1].reshape(nodes.shape)


def _piece_of(corners, position, weights, template, parts):
    """Returns which piece of a triangle contains a point of it."""
    edges = (corners[1:] - corners[0]).T
    second, third = np.linalg.lstsq(edges, np.asarray(position) - corners[0], rcond=None)[0]
    middles = weights[template].mean(1)
    # With such weights as coordinates the pieces are equilateral, so that the one with the nearest middle contains the point.
    return int(np.linalg.norm(middles - parts * np.array([1 - second - third, second, third]), axis=1).argmin())


def _components(pieces, count):
    """Returns (count,) labels that are equal for nodes that pieces connect."""
    labels = np.arange(count)
    while True:
        lowest = labels[pieces].min(1)
        following = labels.copy()
        np.minimum.at(following, pieces.ravel(), np.repeat(lowest, 3))
        following = following[following]
        if np.array_equal(following, labels):
            return labels
        labels = following
