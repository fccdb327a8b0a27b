# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a mesh is within the tolerance: the one comparison that panel, status bar, Check and Select Outside show."""

from dataclasses import dataclass

from ..reference import measurements, tolerances
from ..units import NO_BREAK
from .measure import Interval

# What is known of the two directions together.
WITHIN, ONE_WAY, UNDECIDED, BEYOND = range(4)


@dataclass(frozen=True)
class Verdict:
    """Certified distances and the tolerance that they are compared with, in double, world units."""

    tolerance: float
    forward: Interval  # of the mesh from the reference
    backward: Interval
    share_outside: float = 0.0  # of the mesh's area; 0 where it is not known for this tolerance

    @property
    def forward_within(self):
        """Proved."""
        return self.forward.within(self.tolerance)

    @property
    def backward_within(self):
        return self.backward.within(self.tolerance)

    @property
    def kind(self):
        if self.forward_within:
            return WITHIN if self.backward_within else ONE_WAY
        return BEYOND if self.forward.beyond(self.tolerance) else UNDECIDED

    def line(self):
        """For the panel."""
        if self.kind == WITHIN:
            return "Within the tolerance both ways, proved"
        if self.kind == ONE_WAY:
            return "Within the tolerance one way, proved: parts of the reference are farther"
        if self.kind == UNDECIDED:
            return "As far as the tolerance: rounding is more than what is left of it"
        share = f": {100 * self.share_outside:.1f}{NO_BREAK}% of the mesh" if self.share_outside else ""
        return f"Beyond the tolerance{share}"


def of(ob):
    """The Verdict of what was measured of `ob` last, about the tolerance as it is set now; None where nothing is known."""
    measured = measurements.measurement_of(ob)
    if measured is None:
        return None
    # Per cent are of the size that was measured: a turned object is larger or smaller by the rounding of its matrix.
    tolerance = tolerances.tolerance_length(ob.tolvol, measured.size)
    return Verdict(
        tolerance,
        Interval(measured.forward_lower, measured.forward),
        Interval(measured.backward_lower, measured.backward),
        measured.share_outside if tolerance == measured.tolerance else 0.0,
    )
