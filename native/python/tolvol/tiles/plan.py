# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the cells of each round, so that the work in each cell fits the memory of a worker."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..shared.errors import Refused
from .cells import Box, Cells, centroids

# What the work in a cell takes at its peak, in bytes (docs/benchmark.md): by itself; in the first round, where the mesh is the
# reference, for each of its triangles; and in later rounds, for each triangle of the reference and for each of the mesh.
FIXED, OF_FIRST, OF_REFERENCE, OF_MESH = 160 << 20, 1650, 700, 1600
# As much of this may be the grid of distances, for each triangle of the reference.
OF_GRID = 100

MOST_ROUNDS = 6
_SAMPLES = 1 << 20  # triangles whose centroids stand for all
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
        self._reference = _Load(_samples(mesh), mesh.count, OF_FIRST)
        cells, needed = self._fewest([self._reference], 0)
        if not cells:
            raise Refused(
                f"--memory: {memory / 1e6:,.0f} MB is too little: the triangles within the tolerance of one place need at "
                f"least {(FIXED + needed) / 1e6:,.0f} MB"
            )
        self.first = cells

    def later(self, soups, turn):
        """Returns the Cells of round `turn`, 1 for the second one, for the mesh that these soups hold.

        There is a single cell where all of the mesh and the reference fits the memory; None if no cells fit it.
        """
        reference = replace(self._reference, of_each=OF_REFERENCE)
        count = sum(soup.count for soup in soups)
        step = math.ceil(max(1, count) / _SAMPLES)
        points = np.concatenate([centroids(soup.corners()[::step]) for soup in soups])
        return self._fewest([reference, _Load(points, count, OF_MESH)], turn)[0]

    def parts(self, count):
        """Returns `count` Cells for the soups of the reference."""
        return Cells(self._reference.points, count)

    def grid_memory(self):
        """Returns the most bytes that the grid of a cell's volume may take."""
        return max(0, (self._memory - FIXED) * OF_GRID // OF_REFERENCE)

    def _fewest(self, loads, turn):
        """Returns (the fewest Cells, each of which fits, or None; the bytes that the largest of the tried ones needs)."""
        room = max(0, self._memory - FIXED)
        # Where not even FIXED is there, no cells will do, and the need of small ones is told.
        wanted, finest = (room, _FINEST) if room else (_SMALL * OF_FIRST, 1)
        points = self._reference.points
        places = points[:: max(1, len(points) // _PLACES)]
        # No cell that holds one of these places needs less.
        needed = max(sum(load.around(place, self._tolerance) for load in loads) for place in places)
        if needed > wanted:
            return None, needed
        count = min(math.ceil(sum(load.bytes for load in loads) / wanted), len(points))
        limit, least = min(finest * count, len(points)), math.inf
        while True:
            cells = Cells(points, count, turn)
            needed = sum(load.near(cells, self._tolerance) for load in loads).max()
            least = min(least, needed)
            if needed <= wanted:
                return (cells if room else None), least
            if count == limit:
                return None, least
            count = min(limit, count + max(1, count // 4))


@dataclass(frozen=True)
class _Load:
    """Triangles that need memory: the centroids of some of them, (k, 3), how many there are, and the bytes for each."""

    points: np.ndarray
    count: int
    of_each: int

    @property
    def bytes(self):
        return self.count * self.of_each

    def near(self, cells, length):
        """Returns the bytes that each of the cells needs with what is within the length of it."""
        return self._bytes_of(cells.count_near(self.points, length))

    def around(self, place, length):
        """Returns the bytes for what is within the length of a point."""
        return self._bytes_of(Box(tuple(place), tuple(place)).grown(length).holds(self.points).sum())

    def _bytes_of(self, points):
        return points * (self.bytes / max(1, len(self.points)))


def _samples(mesh):
    """Returns the centroids of triangles all over a MappedMesh, (k, 3)."""
    run = min(_RUN, mesh.count)
    firsts = np.linspace(0, mesh.count - run, max(1, min(_SAMPLES, mesh.count) // run)).astype(np.int64)
    return np.concatenate([centroids(mesh.corners(first, first + run)) for first in np.unique(firsts)])
