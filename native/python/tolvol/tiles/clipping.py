# SPDX-License-Identifier: GPL-3.0-or-later
"""Cuts triangles along the sides of a box.

A cut rounds, and the next cut is of the rounded parts. Where a triangle lies in a side of two cells but for rounding, the parts
in both cells may miss the same points of it. So what is to miss nothing is clipped by boxes that are larger by rounding().
"""

import numpy as np

from .cells import lowest_and_highest

# A triangle is shallow against a side if it reaches less than this share of its longest extent across it.
_SHALLOW = 1 / 16
# So many times rounding() is the distance by which a triangle that is not shallow may miss points beside the sides of the box.
STEEP_LOSS = 64


def clipped(corners, box):
    """Returns triangles, (j, 3, 3) float64, that together are about what some triangles, (k, 3, 3), have in common with a box.

    Every point of the triangles that is in the box and at least rounding() away from its sides is within rounding() of the
    result, and every point of the result is within rounding() of the triangles. A triangle inside comes back as it is. After
    I. Sutherland, G. Hodgman, "Reentrant Polygon Clipping", 1974, with a triangle or two in place of each polygon.
    """
    corners = corners.astype(np.float64)
    for axis in range(3):
        for side, at in ((1, box.lower[axis]), (-1, box.upper[axis])):
            if np.isfinite(at) and len(corners):
                corners = _halved(corners, axis, side, at)
    return corners


def rounding(points):
    """Returns an upper bound, a length, of how far clipped() carries a point of triangles with these corners by its rounding.

    Each of six cuts rounds a coordinate by a few units in the last place of the largest coordinate.
    """
    return 128 * float(np.finfo(np.float64).eps) * float(np.abs(points).max(initial=0))


def are_shallow(corners, box, margin):
    """Tells which triangles, (k, 3, 3), are shallow against a side of the box that is within `margin`, a length, of them."""
    lower, upper = (side.astype(np.float64) for side in lowest_and_highest(corners))
    extent = upper - lower
    flat = extent < _SHALLOW * extent.max(1, keepdims=True)
    sides = np.array([box.lower, box.upper])[:, None]
    return (flat & ((lower - margin <= sides) & (sides <= upper + margin)).any(0)).any(1)


def _halved(corners, axis, side, at):
    """Returns the parts of triangles on one side of a plane: side 1 above, -1 below."""
    inside = side * (corners[:, :, axis] - at) >= 0
    number = inside.sum(1)
    one, two = _turned(corners, inside, number == 1), _turned(corners, ~inside, number == 2)
    # The first corner is the only one inside, or outside.
    p, q = _crossing(one[:, 0], one[:, 1], axis, at), _crossing(one[:, 0], one[:, 2], axis, at)
    r, s = _crossing(two[:, 0], two[:, 1], axis, at), _crossing(two[:, 0], two[:, 2], axis, at)
    return np.concatenate(
        [
            corners[number == 3],
            np.stack([one[:, 0], p, q], 1),
            np.stack([r, two[:, 1], two[:, 2]], 1),
            np.stack([r, two[:, 2], s], 1),
        ]
    )


def _turned(corners, chosen, rows):
    """Returns these rows with the corners turned so that the chosen one, of which each row has one, is the first."""
    order = (np.argmax(chosen[rows], 1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(corners[rows], order[:, :, None], 1)


def _crossing(a, b, axis, at):
    share = ((at - a[:, axis]) / (b[:, axis] - a[:, axis]))[:, None]
    found = a + share * (b - a)
    found[:, axis] = at
    return found
