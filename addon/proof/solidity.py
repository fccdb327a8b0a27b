# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the pairs of faces of a mesh that cross each other."""

from .. import native

# Where a mesh has so many pairs or more, they are not counted further: 100,000 faces on one place have five thousand million.
MOST_PAIRS = 1_000_000


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
