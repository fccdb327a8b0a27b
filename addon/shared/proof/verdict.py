# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides whether a mesh is within the tolerance. Nothing else in the add-on or the commands compares a distance with it.

The panel, the legend, the status bar, Check, Select Outside, the other operators and the reports all show the outcome of a
Verdict, so they always agree.
"""

import math
from dataclasses import dataclass, replace

from ..numbers import NO_BREAK

# The words for the outcome that are shown everywhere.
PASS, FAIL, NOT_CHECKED = "PASS", "FAIL", "NOT CHECKED"

_LITTLE = 1e-4  # share of the tolerance

# The outcomes for the two directions together.
WITHIN, ONE_WAY, UNDECIDED, BEYOND = range(4)


@dataclass(frozen=True)
class Interval:
    """The true largest distance lies between `lower` and `upper`.

    The point `position` on the triangle `triangle` of the surface is at least `lower` away from the other surface.
    """

    lower: float
    upper: float
    position: tuple = ()
    triangle: int = -1

    def within(self, tolerance):
        """Whether the distance is proved to be at most the tolerance."""
        return self.upper <= tolerance

    def beyond(self, tolerance):
        """Whether the distance is proved to be larger than the tolerance."""
        return self.lower > tolerance

    def undecided(self, tolerance):
        return not self.within(tolerance) and not self.beyond(tolerance)

    def narrowed(self, other):
        """Returns the Interval with the better one of both ends. other: what else is known about the same distance.

        If both cannot be true, `other` was read from a damaged file, and the Interval stays as it is.
        """
        best = max(self, other, key=lambda found: found.lower)
        upper = min(self.upper, other.upper)
        return replace(best, upper=upper) if best.lower <= upper else self


@dataclass(frozen=True)
class Verdict:
    """Certified distances, and the tolerance that they are compared with, in double precision and world units."""

    tolerance: float
    forward: Interval  # from the mesh to the reference
    backward: Interval  # from the reference to the mesh
    share_outside: float = 0.0  # share of the mesh's area beyond the tolerance; 0 if not known for this tolerance
    two_sided: bool = True  # whether both directions have to be within the tolerance, or the mesh alone

    @classmethod
    def certified(cls, found, tolerance, two_sided=True):
        """Returns the Verdict of the result of certify()."""
        return cls(tolerance, Interval(*found["forward"]), Interval(*found["backward"]), two_sided=two_sided)

    @property
    def passed(self):
        """Whether every direction that has to be within the tolerance is proved to be."""
        return self.forward_within and (self.backward_within or not self.two_sided)

    @property
    def word(self):
        return PASS if self.passed else FAIL

    @property
    def largest(self):
        """The largest proved distance of the directions that have to be within the tolerance."""
        return max(self.forward.upper, self.backward.upper) if self.two_sided else self.forward.upper

    @property
    def margin(self):
        """What is left of the tolerance. It is negative if a distance is beyond the tolerance."""
        return self.tolerance - self.largest

    @property
    def surely_beyond(self):
        """Whether a direction that has to be within the tolerance is proved to be beyond it."""
        ways = (self.forward, self.backward) if self.two_sided else (self.forward,)
        return any(way.beyond(self.tolerance) for way in ways)

    @property
    def margin_is_little(self):
        """Whether the margin is so small a share of the tolerance that its digits say little and have no room."""
        return abs(self.margin) < _LITTLE * self.tolerance

    def margin_percent(self):
        """Returns the margin without its sign as text in percent of the tolerance.

        It is rounded down if the mesh passed and else up, so that it never looks better than it is, and to the last digit of
        the largest distance in percent. Where that is 10 % or more, the two texts together make 100 %.
        """
        share = 100 * abs(self.margin) / self.tolerance
        if not share:
            return "0 %"
        if self.passed:
            digits = 2 - math.floor(math.log10(max(share, 100 - share)))
            steps = math.floor(share * 10.0**digits + 1e-4)
        else:
            # report.percent() has more digits just above 100 %.
            digits = (1 if share < 1 else 2) - math.floor(math.log10(share if share < 1 else 100 + share))
            steps = math.ceil(share * 10.0**digits - 1e-4)
        digits, least = max(digits, 0), 10.0**-digits
        return f"{steps * least:,.{digits}f} %" if steps else f"<{least:g} %"

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

    @property
    def ways(self):
        """Says in a few words what the word is about."""
        if self.passed:
            return "both ways, proved" if self.two_sided else "one way, proved"
        if not self.forward_within and not self.backward_within:
            return "both ways" if self.two_sided else "one way"
        return "the mesh" if not self.forward_within else "the reference"

    def line(self):
        """Returns the verdict as a sentence."""
        if self.kind == WITHIN:
            return "Within the tolerance both ways, proved"
        if self.kind == ONE_WAY:
            return "Within the tolerance one way, proved: parts of the reference are farther from the mesh"
        if self.kind == UNDECIDED:
            return "Not proved: the distance differs from the tolerance by less than the rounding"
        share = f": about {self.about_outside()} of the mesh" if self.share_outside else ""
        return f"Beyond the tolerance{share}"

    def about_outside(self):
        """Returns the share outside as text, with as many digits as two estimates of it have in common."""
        percent = 100 * self.share_outside
        return f"{percent:.0f}{NO_BREAK}%" if percent >= 1 else f"{percent:.1g}{NO_BREAK}%"


# What is a smaller share of the tolerance is no more than rounding.
_ROUNDING = 1e-6


def negligible(distance, tolerance):
    """Whether a distance is so small beside the tolerance that its digits say nothing."""
    return distance < _ROUNDING * tolerance


def together(words):
    """Returns the word for several objects: FAIL if one of them fails, PASS if all pass."""
    words = set(words)
    return FAIL if FAIL in words else NOT_CHECKED if NOT_CHECKED in words else PASS
