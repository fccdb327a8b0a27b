# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts space into cells: boxes without a common inner point that together are all of space."""

import math
from dataclasses import dataclass

import numpy as np

# How far a cut may be from where all cells would hold as many points, as a share of the points of a cell.
_SHIFTS = (0, 1 / 8, -1 / 8, 1 / 4, -1 / 4)


@dataclass(frozen=True)
class Box:
    """An axis-aligned box: two corners of three numbers each, which may be infinite."""

    lower: tuple
    upper: tuple

    def grown(self, length):
        return Box(tuple(x - length for x in self.lower), tuple(x + length for x in self.upper))

    def joined(self, other):
        """Returns the smallest box around two boxes."""
        return Box(tuple(map(min, self.lower, other.lower)), tuple(map(max, self.upper, other.upper)))

    def meets(self, other):
        return all(a <= d and c <= b for a, b, c, d in zip(self.lower, self.upper, other.lower, other.upper))

    def contains(self, other):
        return all(a <= c and d <= b for a, b, c, d in zip(self.lower, self.upper, other.lower, other.upper))

    def holds(self, points):
        """Tells which points, (k, 3), are in the box or on one of its lower sides: each point is so in one cell alone."""
        return _all_three((points >= np.array(self.lower)) & (points < np.array(self.upper)))

    def meets_boxes(self, lowest, highest):
        """Tells which boxes meet this one. lowest, highest: the corners of the boxes, (k, 3) each."""
        return _all_three((highest >= np.array(self.lower)) & (lowest <= np.array(self.upper)))

    def meets_triangles(self, corners):
        """Tells which triangles, (k, 3, 3), have a bounding box that meets this one."""
        return self.meets_boxes(*lowest_and_highest(corners))

    def strictly_holds_triangles(self, corners):
        """Tells which triangles, (k, 3, 3), lie inside the box and meet none of its sides."""
        lowest, highest = lowest_and_highest(corners)
        return _all_three((lowest > np.array(self.lower)) & (highest < np.array(self.upper)))


def lowest_and_highest(corners):
    """Returns the lowest and the highest coordinates of triangles, (k, 3, 3): two arrays of (k, 3)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)  # min(1) takes three times as long.


def _all_three(conditions):
    """Returns for each row of (k, 3) bool whether all are true."""
    return conditions[:, 0] & conditions[:, 1] & conditions[:, 2]


def centroids(corners):
    """Returns the centroids of triangles, (k, 3, 3), as float64. Each is in the bounding box of its triangle.

    Rounding alone would put some beside it: (x + x + x) / 3 may differ from x.
    """
    return np.clip((corners[:, 0].astype(np.float64) + corners[:, 1] + corners[:, 2]) / 3, *lowest_and_highest(corners))


EVERYWHERE = Box((-math.inf,) * 3, (math.inf,) * 3)


class Cells:
    """About `count` cells that hold about as many of some points, (k, 3), each; fewer where many points lie on each other.

    Each cut is across a long axis of the points. With `boxes`, two arrays of (j, 3), their lowest and their highest corners, it
    is where it meets few of them, for which one part may get up to a quarter of a cell more than its share: a cell then holds up
    to 1.6 times as many points as it would. O((k log k + j log j) log count).
    """

    def __init__(self, points, count, boxes=None):
        self.boxes = []
        self._root = self._cut(points.astype(np.float64), count, EVERYWHERE, boxes)

    def _cut(self, points, count, space, boxes):
        """Returns (axis, at, the node below, the node above), or the number of a cell."""
        place = _place(points, count, boxes) if count > 1 and len(points) > 1 else None
        if place is None:
            self.boxes.append(space)
            return len(self.boxes) - 1
        axis, at, below = place
        boxes_below = boxes_above = None
        if boxes is not None:
            lowest, highest = boxes
            boxes_below, boxes_above = (
                (lowest[rows], highest[rows]) for rows in (lowest[:, axis] <= at, highest[:, axis] >= at)
            )
        is_below = points[:, axis] < at
        lower = Box(space.lower, _with(space.upper, axis, at))
        upper = Box(_with(space.lower, axis, at), space.upper)
        return (
            axis,
            at,
            self._cut(points[is_below], below, lower, boxes_below),
            self._cut(points[~is_below], count - below, upper, boxes_above),
        )

    def of(self, points):
        """Returns the number of the cell that holds each point, (k,)."""
        found = np.empty(len(points), np.int32)

        def descend(node, rows):
            if isinstance(node, int):
                found[rows] = node
                return
            axis, at, below, above = node
            is_below = points[rows, axis] < at
            descend(below, rows[is_below])
            descend(above, rows[~is_below])

        descend(self._root, np.arange(len(points)))
        return found

    def count_near(self, lowest, highest, length):
        """Returns how many boxes are within a length of each cell along each axis, (count,): those that the grown cell meets.

        lowest, highest: the corners of the boxes, (k, 3) each.
        """
        counts = np.zeros(len(self.boxes), np.int64)

        def descend(node, rows):
            if isinstance(node, int):
                counts[node] = len(rows)
                return
            axis, at, below, above = node
            descend(below, rows[lowest[rows, axis] <= at + length])
            descend(above, rows[highest[rows, axis] >= at - length])

        descend(self._root, np.arange(len(lowest)))
        return counts


def _place(points, count, boxes):
    """Returns where some points are cut: (axis, at, the number of cells below), or None if they all lie on each other.

    An axis is long if the extent along it is at least half of the longest.
    """
    extent = points.max(0) - points.min(0)
    axes = [int(axis) for axis in np.argsort(-extent, kind="stable") if extent[axis] >= extent.max() / 2 > 0]
    belows = sorted(range(math.ceil(count / 3), 2 * count // 3 + 1), key=lambda below: abs(2 * below - count))
    if boxes is None:
        return next((_cuts(points[:, axis], count, belows[:1], _SHIFTS[:1], axis)[0] for axis in axes), None)
    cuts = [cut for axis in axes for cut in _cuts(points[:, axis], count, belows, _SHIFTS, axis)]
    lowest, highest = (np.sort(corners, 0) for corners in boxes)

    def met(cut):
        axis, at, _ = cut
        begun, ended = np.searchsorted(lowest[:, axis], at, "right"), np.searchsorted(highest[:, axis], at, "left")
        return begun - ended

    return min(cuts, key=met, default=None)


def _cuts(values, count, belows, shifts, axis):
    """Returns (axis, at, the number of cells below) for each of these numbers and shifts.

    Points at the cut are above it. Where the lowest point is there, the cut goes to the next coordinate.
    """
    ranks = [(below, int(len(values) * (below + shift) / count)) for below in belows for shift in shifts]
    ordered, least = np.partition(values, [rank for _, rank in ranks]), values[values > values.min()].min()
    return [(axis, float(max(ordered[rank], least)), below) for below, rank in ranks]


def _with(corner, axis, value):
    return (*corner[:axis], value, *corner[axis + 1 :])
