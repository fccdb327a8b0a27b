# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides whether a mesh is within the tolerance. Panel and Check both use this comparison, so they always agree."""

from dataclasses import dataclass

from ..reference import measurements, tolerances
from ..units import NO_BREAK
from .measure import Interval

# The outcomes for the two directions together.
WITHIN, ONE_WAY, UNDECIDED, BEYOND = range(4)


@dataclass(frozen=True)
class Verdict:
    """Certified distances, and the tolerance that they are compared with, in double precision and world units."""

    tolerance: float
    forward: Interval  # from the mesh to the reference
    backward: Interval  # from the reference to the mesh
    share_outside: float = 0.0  # share of the mesh's area beyond the tolerance; 0 if not known for this tolerance

    @property
    def forward_within(self):
        """Whether the mesh is proved to be within the tolerance of the reference."""
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
        """Returns the verdict as a line for the panel."""
        if self.kind == WITHIN:
            return "Within the tolerance both ways, proved"
        if self.kind == ONE_WAY:
            return "Within the tolerance one way, proved: parts of the reference are farther from the mesh"
        if self.kind == UNDECIDED:
            return "Not proved: the distance differs from the tolerance by less than the rounding"
        share = f": {100 * self.share_outside:.1f}{NO_BREAK}% of the mesh" if self.share_outside else ""
        return f"Beyond the tolerance{share}"


def of(ob):
    """Returns the Verdict of the last measurement of `ob` for the present tolerance, or None without a measurement."""
    measured = measurements.measurement_of(ob)
    if measured is None:
        return None
    # A percentage is taken of the size that was measured: rotating the object changes its size by rounding.
    tolerance = tolerances.tolerance_length(ob.tolvol, measured.size)
    return Verdict(
        tolerance,
        Interval(measured.forward_lower, measured.forward),
        Interval(measured.backward_lower, measured.backward),
        measured.share_outside if tolerance == measured.tolerance else 0.0,
    )
