# SPDX-License-Identifier: GPL-3.0-or-later
"""How colours stand for distances: up to which distance they go, and whether in bands."""

import math
from dataclasses import dataclass

import numpy as np

# Beyond so many times the last colour the search for the reference ends, and only stripes are drawn.
FAR = 8.0
# The shares of so many bands are counted where the colours are smooth.
_SMOOTH_BANDS = 4
# A histogram has about so many bins: the same number of them in each band.
_BINS = 48
# The leading digits of an automatic range.
_ROUNDING = 1e-9  # relative; the power of ten is rounded
_ROUND = (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)


@dataclass(frozen=True)
class Scale:
    tolerance: float  # in world units, as all lengths here
    signed: bool
    reach: float  # the distance at which the colours end
    bands: int  # number of colours; 0 for a smooth change

    @property
    def lowest(self):
        return -self.reach if self.signed else 0.0

    @property
    def counted(self):
        """The number of bands whose shares are counted."""
        return self.bands or _SMOOTH_BANDS

    @property
    def bins(self):
        """The number of bins of the histogram."""
        return self.counted * max(round(_BINS / self.counted), 1)

    @property
    def coloured_beyond(self):
        """Whether parts beyond the tolerance have colours of their distance between the stripes."""
        return self.reach > self.tolerance

    def edges(self):
        """Returns the distances, ascending and signed, between which shares have to be counted for fold()."""
        ends = np.linspace(self.lowest, self.reach, self.bins + 1)
        others = [self.tolerance] + [FAR * self.reach] * self.coloured_beyond
        return np.unique(np.concatenate([ends, -ends, others, np.negative(others)]))

    def fold(self, shares):
        """Returns the shares in the bands, from the lowest colour on, and beyond the tolerance.

        shares: those between edges() and beyond them at both ends. What is beyond the last colour counts to its band. What is
        beyond the tolerance counts to a band only if it has its colour.
        """
        bands, outside = self._binned(shares, self.counted)
        return [*bands, outside]

    def histogram(self, shares):
        """Returns the shares in `bins` equal intervals of distances, counted as those of the bands."""
        return self._binned(shares, self.bins)[0]

    def _binned(self, shares, count):
        edges, shares = self.edges(), np.asarray(shares)
        middles = (edges[1:] + edges[:-1]) / 2
        distances = middles if self.signed else np.abs(middles)
        at = np.floor((distances - self.lowest) / (self.reach - self.lowest) * count).astype(int)
        at = np.clip(at, 0, count - 1)
        outside = np.abs(middles) > self.tolerance
        shown = shares[1:-1] * (1 if self.coloured_beyond else ~outside)
        bins = np.bincount(at, shown, count)
        return bins.tolist(), float(shares[1:-1][outside].sum() + shares[0] + shares[-1])


def rounded_up(distance):
    """Returns the next round number that is not below a distance."""
    power = 10.0 ** math.floor(math.log10(distance))
    return next(digits * power for digits in _ROUND if digits * power >= distance * (1 - _ROUNDING))
