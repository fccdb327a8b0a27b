# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells UV islands apart: UVs at one vertex that differ only by rounding belong to one island."""

import numpy as np

# UVs at one vertex that differ by less than this are equal but for rounding, as in Blender's own grid. The number is for UVs up
# to 1, and is multiplied by larger ones.
_SAME_UV = 2.0**-20


def without_rounding(uvs, vertices):
    """Returns the UVs with those at one vertex equal that differ only by rounding. They tell islands apart, and are not for
    writing.

    uvs: (n, width) float, at each corner; vertices: (n,) the vertex of each corner.
    """
    first = np.zeros(vertices.max(initial=-1) + 1, np.int64)
    first[vertices[::-1]] = np.arange(len(vertices))[::-1]
    several = np.zeros(len(first), bool)
    several[vertices[(uvs != uvs[first[vertices]]).any(1)]] = True
    corners = np.flatnonzero(several[vertices])
    if not len(corners):
        return uvs
    uvs = uvs.copy()
    for coordinate in range(uvs.shape[1]):
        uvs[corners, coordinate] = _joined(vertices[corners], uvs[corners, coordinate])
    return uvs


def _joined(groups, values):
    """Returns values. Those of a group that differ by less than _SAME_UV are made equal, and so are all of a chain of such.

    groups: (n,) the group of each value; values: (n,) float
    """
    order = np.lexsort((values, groups))
    groups, values = groups[order], values[order]
    begins = np.ones(len(order), bool)
    with np.errstate(invalid="ignore", over="ignore"):  # A damaged file may hold any number.
        near = np.diff(values) < _SAME_UV * np.maximum(1, np.abs(values[1:]))
    begins[1:] = (np.diff(groups) != 0) | ~near
    joined = np.empty_like(values)
    joined[order] = values[np.maximum.accumulate(np.where(begins, np.arange(len(order)), 0))]
    return joined
