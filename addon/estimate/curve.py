# SPDX-License-Identifier: GPL-3.0-or-later
"""The number of triangles that decimation leaves, as a curve over the tolerance.

The curve goes through the outcomes of some decimations. Between two of them the logarithm of the number changes evenly with
the logarithm of the tolerance: for tolerances a factor of 2 apart this is within 15 % of a decimation for nearly all meshes.
Where few triangles are left, or where all details of one size vanish together, the number falls by steps, so the curve
asks for decimations between.
"""

import bisect
import math

# Tolerances of the ladder are this factor apart.
STEP = 2.0
# Tolerances are in percent of the size here. The ladder goes through the default tolerance.
_ON_LADDER = 0.2
_FINEST, _COARSEST = _ON_LADDER / STEP**5, _ON_LADDER * STEP**6
# Between two numbers with at most this ratio the curve needs no decimation.
_CLOSE = 1.2
# Tolerances that differ by a smaller factor count as the same.
_SAME = 1 + 1e-6
# Below the tolerance that leaves this share of the triangles, finer ones leave hardly more. One that is finer by more than
# the factor is not estimated from it, because float32 may not hold it, and Decimate then refuses it.
_NEARLY_ALL, _FINER = 0.9, 100.0
# For meshes of more than so many triangles, the ladder goes on towards finer tolerances, which take longer, only while a
# decimation takes at most so many seconds.
_LARGE, _PATIENCE = 50_000, 4.0
# After the ladder come decimations between: of so many triangles together, and not nearer to others than this factor.
_REFINED = 400_000
_NARROWEST = 2**0.25


class Curve:
    def __init__(self, triangles):
        """triangles: the number before the decimation."""
        self.triangles = triangles
        self.too_large = False  # whether a decimation had not enough memory
        self._tolerances = []  # in percent of the size, in rising order
        self._counts = {}  # tolerance -> number of triangles, or None if the mesh cannot be decimated within it
        self._seconds = {}
        self._refined = 0  # number of triangles of all decimations at other tolerances than those of the ladder

    def add(self, tolerance, count, seconds):
        """Adds the outcome of a decimation, which took so many seconds. count: None if the decimation was refused."""
        if tolerance not in self._counts:
            bisect.insort(self._tolerances, tolerance)
        self._counts[tolerance], self._seconds[tolerance] = count, seconds
        rungs = math.log(tolerance / _ON_LADDER, STEP)
        if abs(rungs - round(rungs)) > 1e-6:
            self._refined += self.triangles

    def count(self, tolerance):
        """Returns the estimated number of triangles, or None if it is not known."""
        below, above = self._around(tolerance)
        if below is None and self._nearly_all(tolerance):
            return float(self._counts[above])
        if below is None or above is None or self._counts[below] is None or self._counts[above] is None:
            return None
        if below == above:
            return float(self._counts[below])
        share = math.log(tolerance / below) / math.log(above / below)
        first, last = (math.log(max(self._counts[each], 1)) for each in (below, above))
        return math.exp(first + share * (last - first))

    def refused(self, tolerance):
        """Whether a decimation within this tolerance is known to be refused: one within a larger tolerance was."""
        return any(self._counts[each] is None for each in self._tolerances if each >= tolerance / _SAME)

    def exact(self, tolerance):
        """Whether the outcome at this tolerance is known from a decimation."""
        below, above = self._around(tolerance)
        return below is not None and below == above

    def good(self, tolerance):
        """Whether no decimation within this tolerance is needed to know the number."""
        below, above = self._around(tolerance)
        if below is not None and above is not None:
            return below == above or self._close(below, above)
        return self.refused(tolerance) or below is None and self._nearly_all(tolerance)

    def missing(self, tolerance):
        """Returns the tolerance, near to the present one, of the next decimation that the whole curve needs, or None."""
        rungs = [rung for rung in self._ladder() if not self.exact(rung) and not self.refused(rung)]
        gaps = self._gaps() if not rungs and self._refined < _REFINED else []
        return min(rungs or gaps, key=lambda each: abs(math.log(each / tolerance)), default=None)

    def _around(self, tolerance):
        """Returns the two known tolerances around this one, both the same if it is known, None where there is none."""
        at = bisect.bisect_left(self._tolerances, tolerance)
        for near in self._tolerances[max(at - 1, 0) : at + 1]:
            if 1 / _SAME <= near / tolerance <= _SAME:
                return near, near
        below = self._tolerances[at - 1] if at else None
        return below, self._tolerances[at] if at < len(self._tolerances) else None

    def _close(self, below, above):
        first, last = self._counts[below], self._counts[above]
        return first is not None and last is not None and max(first, last) <= _CLOSE * max(min(first, last), 1)

    def _ladder(self):
        """Yields the tolerances at which the curve is to be known."""
        rung = _ON_LADDER
        while rung <= _COARSEST * _SAME:
            yield rung
            rung *= STEP
        rung = _ON_LADDER
        while rung >= _FINEST / _SAME:
            yield rung
            at, _ = self._around(rung)
            if not self.exact(rung) or self._counts[at] is None or self._nearly_all(rung):
                return
            if self.triangles > _LARGE and self._seconds[at] > _PATIENCE:
                return
            rung /= STEP

    def _gaps(self):
        """Returns tolerances between two at which the numbers differ much."""
        return [
            math.sqrt(below * above)
            for below, above in zip(self._tolerances, self._tolerances[1:])
            if above / below > _NARROWEST * _SAME and self._counts[below] is not None and not self._close(below, above)
        ]

    def _nearly_all(self, tolerance):
        """Whether this tolerance, like the finest known one, leaves nearly all triangles."""
        finest = self._tolerances[0] if self._tolerances else None
        least = self._counts.get(finest)
        return least is not None and least >= _NEARLY_ALL * self.triangles and tolerance > finest / _FINER
