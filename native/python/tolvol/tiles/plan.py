# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the cells of each round, so that the work in each cell fits the memory of a worker."""

import math

import numpy as np

from ..shared.errors import Refused
from .cells import Box, Cells, centroids

# What the work in a cell takes at its peak, in bytes: by itself, and for each triangle of the reference, in the first round,
# where the mesh is the reference, and in later rounds (docs/benchmark.md).
FIXED, OF_FIRST, OF_LATER = 160 << 20, 1650, 850
# As much of this may be the grid of distances.
OF_GRID = 100

_SAMPLES = 1 << 20  # triangles whose centroids stand for all
_RUN = 1 << 10  # neighbouring triangles that are sampled together
_ROUNDS = 5  # over several cells, at most
_FINEST = 64  # times as many cells as would do if each had the same number of triangles, and none around it
_SMALL = 1000  # triangles in a small cell
_PLACES = 16  # where the triangles within the tolerance are counted before any cell is made


class Plan:
    """The rounds for a MappedMesh: a list of Cells for each.

    memory: bytes for a worker; tolerance: a length. The last round has a single cell where all triangles fit the memory.
    Raises Refused, which says how much memory is needed, where not even the smallest part of the mesh fits.
    """

    def __init__(self, mesh, tolerance, memory):
        self.points, self.count = _samples(mesh), mesh.count
        self._tolerance, self._memory = tolerance, memory
        self.rounds = [self._cells(OF_FIRST, 0)]
        while len(self.rounds[-1].boxes) > 1 and len(self.rounds) < _ROUNDS:
            self.rounds.append(self._cells(OF_LATER, len(self.rounds)))

    def parts(self, count):
        """Returns `count` Cells for the soups of the reference."""
        return Cells(self.points, count)

    def grid_memory(self):
        """Returns the most bytes that the grid of a cell's volume may take."""
        return OF_GRID * self._most(OF_LATER)

    def _most(self, of_each):
        return max(0, int((self._memory - FIXED) / of_each))

    def _cells(self, of_each, turn):
        """Returns the fewest Cells whose triangles fit, with those within the tolerance of the cell."""
        most = self._most(of_each)
        # Where not even FIXED is there, no cells will do, and the need of small ones is told.
        wanted, finest = (most, _FINEST) if most else (_SMALL, 1)
        least = self._triangles(self._near_places())
        if least <= wanted:
            cells, least = self._small_enough(wanted, finest, turn)
            if least <= most:
                return cells
        needed = (FIXED + least * of_each) / 1e6
        raise Refused(
            f"--memory: {self._memory / 1e6:,.0f} MB is too little: the triangles within the tolerance of one place need at "
            f"least {needed:,.0f} MB"
        )

    def _small_enough(self, wanted, finest, turn):
        """Returns (the fewest Cells with at most `wanted` triangles in each, the most in one), or (None, more than wanted)."""
        count = min(-(-self.count // wanted), len(self.points))
        limit, least = min(finest * count, len(self.points)), math.inf
        while True:
            cells = Cells(self.points, count, turn)
            largest = self._triangles(cells.count_near(self.points, self._tolerance))
            if largest <= wanted:
                return cells, largest
            least = min(least, largest)
            if count == limit:
                return None, least
            count = min(limit, count + max(1, count // 4))

    def _triangles(self, counts):
        """Returns for how many triangles of the mesh the largest of some numbers of points stands."""
        return math.ceil(counts.max() / len(self.points) * self.count)

    def _near_places(self):
        """Returns how many points are within the tolerance of some of them: no cell that holds one of these has fewer."""
        places = self.points[:: max(1, len(self.points) // _PLACES)]
        return np.array([Box(tuple(p), tuple(p)).grown(self._tolerance).holds(self.points).sum() for p in places])


def _samples(mesh):
    """Returns the centroids of triangles all over a MappedMesh, (k, 3)."""
    run = min(_RUN, mesh.count)
    firsts = np.linspace(0, mesh.count - run, max(1, min(_SAMPLES, mesh.count) // run)).astype(np.int64)
    return np.concatenate([centroids(mesh.corners(first, first + run)) for first in np.unique(firsts)])
