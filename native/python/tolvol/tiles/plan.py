# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the cells of each round, so that the work in each cell fits the memory of a worker."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..shared.errors import Refused
from .cells import Box, Cells, centroids, lowest_and_highest

# What the work in a cell takes at its peak, in bytes (docs/benchmark.md), besides the grid of distances. FIXED: by itself.
# OF_FIRST: for each triangle in the first round, where the mesh is the reference. OF_FIRST_IF_SHORT: in place of OF_FIRST where
# the tolerance is short, because more triangles of the reference are cut into pieces then. OF_REFERENCE, OF_MESH: for each
# triangle of these in later rounds.
FIXED, OF_FIRST, OF_FIRST_IF_SHORT, OF_REFERENCE, OF_MESH = 160 << 20, 750, 1500, 345, 1840
_SHORT = 1 / 4  # A tolerance below this share of the median edge is short.
OF_GRID = 1 / 4  # The grid of distances may take this share of the memory beside FIXED.
_OF_NODE = 10  # bytes of a node of the grid: 8, and more where rows are filled up

_SAMPLES = 1 << 19  # triangles that stand for all
_RUN = 1 << 10  # neighbouring triangles that are sampled together
_FINEST = 64  # times as many cells as would do if each had the same number of triangles, and none around it
_SMALL = 1000  # triangles of the reference in a small cell
_PLACES = 16  # where the triangles within the tolerance are counted before any cell is made


class Plan:
    """The Cells of the rounds for a MappedMesh: `first`, and those that later() finds.

    memory: bytes for a worker; tolerance: a length. Raises Refused, which says how much memory is needed, where not even the
    smallest part of the mesh fits.
    """

    def __init__(self, mesh, tolerance, memory):
        self._tolerance, self._memory = tolerance, memory
        corners = _samples(mesh)
        self._finest_grid = _grid_bytes(np.ptp(corners.reshape(-1, 3).astype(np.float64), axis=0), tolerance)
        self._points = centroids(corners)
        of_each = OF_FIRST_IF_SHORT if tolerance < _SHORT * _median_edge(corners) else OF_FIRST
        self._reference = _Load.of(corners, mesh.count, of_each)
        cells, needed = self._fewest([self._reference])
        if not cells:
            raise Refused(
                f"--memory: {memory / 1e6:g} MB is too little: the triangles within the tolerance of one place need at "
                f"least {math.ceil((FIXED + self._with_grid(needed)) / 1e6):,} MB"
            )
        self.first = cells

    def later(self, chunks):
        """Returns the Cells of a later round for the mesh that these chunks hold.

        Their sides meet few of its faces, and so keep away from the sides of earlier cells, beside which most faces are. There is
        a single cell where all of the mesh and the reference fits the memory; None if no cells fit it.
        """
        count = sum(chunk.count for chunk in chunks)
        step = math.ceil(max(1, count) / _SAMPLES)
        corners = np.concatenate(
            [vertices[triangles[::step]] for vertices, triangles in (chunk.mesh() for chunk in chunks)]
        )
        mesh = _Load.of(corners, count, OF_MESH)
        return self._fewest([replace(self._reference, of_each=OF_REFERENCE), mesh], (mesh.lowest, mesh.highest))[0]

    def needed(self, chunks):
        """Returns the bytes with which the round after the one that has left these chunks would have a single cell."""
        of_triangles = self._reference.count * OF_REFERENCE + sum(chunk.count for chunk in chunks) * OF_MESH
        return FIXED + math.ceil(self._with_grid(of_triangles))

    def parts(self, count):
        """Returns `count` Cells for the chunks of the reference."""
        return Cells(self._points, count)

    def grid_memory(self):
        """Returns the most bytes that the grid of a cell's volume may take."""
        return int(min(max(0, self._memory - FIXED) * OF_GRID, self._finest_grid))

    def _with_grid(self, needed):
        """Returns the bytes beside FIXED with which so many are left beside the grid."""
        return needed + min(needed * OF_GRID / (1 - OF_GRID), self._finest_grid)

    def _fewest(self, loads, boxes=None):
        """Returns (few Cells, each of which fits, or None; the least bytes that were found to be needed).

        boxes: as Cells takes them.
        """
        room = max(0, self._memory - FIXED - self.grid_memory())
        # Where not even FIXED is there, no cells will do, and the need of small ones is told.
        wanted, finest = (room, _FINEST) if room else (_SMALL * self._reference.of_each, 1)
        points = self._points
        places = points[:: max(1, len(points) // _PLACES)]
        # No cell that holds one of these places needs less.
        needed = max(sum(load.around(place, self._tolerance) for load in loads) for place in places)
        if needed > wanted:
            return None, needed
        count = min(math.ceil(sum(load.bytes for load in loads) / wanted), len(points))
        limit, least = min(finest * count, len(points)), math.inf
        while True:
            cells = Cells(points, count, boxes)
            needed = sum(load.near(cells, self._tolerance) for load in loads).max()
            least = min(least, needed)
            if needed <= wanted:
                return (cells if room else None), least
            if count == limit:
                return None, least
            count = min(limit, count + max(1, count // 4))


@dataclass(frozen=True)
class _Load:
    """Triangles that need memory: the boxes of some of them, (k, 3) twice, how many there are, and the bytes for each."""

    lowest: np.ndarray
    highest: np.ndarray
    count: int
    of_each: int

    @classmethod
    def of(cls, corners, count, of_each):
        """corners: (k, 3, 3), of the triangles that stand for all."""
        return cls(*lowest_and_highest(corners), count, of_each)

    @property
    def bytes(self):
        return self.count * self.of_each

    def near(self, cells, length):
        """Returns the bytes that each of the cells needs with what is within the length of it."""
        return self._bytes_of(cells.count_near(self.lowest, self.highest, length))

    def around(self, place, length):
        """Returns the bytes for what is within the length of a point."""
        box = Box(tuple(place), tuple(place)).grown(length)
        return self._bytes_of(np.count_nonzero(box.meets_boxes(self.lowest, self.highest)))

    def _bytes_of(self, counts):
        return counts * (self.bytes / max(1, len(self.lowest)))


def _grid_bytes(extent, tolerance):
    """Returns the bytes of the finest grid that a volume takes by itself, with a node per tolerance, around a box of this extent.

    The grid of a cell has fewer nodes.
    """
    return _OF_NODE * float(np.prod(extent / tolerance + 8))  # The band around the box is less than 3 tolerances wide.


def _median_edge(corners):
    """Returns the median length of the edges of triangles, (k, 3, 3)."""
    edges = corners.astype(np.float64) - np.roll(corners, 1, axis=1)
    return float(np.median(np.linalg.norm(edges, axis=2)))


def _samples(mesh):
    """Returns the corners of triangles all over a MappedMesh, (k, 3, 3)."""
    run = min(_RUN, mesh.count)
    firsts = np.linspace(0, mesh.count - run, max(1, min(_SAMPLES, mesh.count) // run)).astype(np.int64)
    return np.concatenate([mesh.corners(first, first + run) for first in np.unique(firsts)])
