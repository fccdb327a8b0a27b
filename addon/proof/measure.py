# SPDX-License-Identifier: GPL-3.0-or-later
"""Certified distances between two surfaces, in the world, of the coordinates as they are stored."""

from dataclasses import dataclass, replace

from .. import native


@dataclass(frozen=True)
class Interval:
    """The true largest distance lies between the two; at `position`, on that face of the surface, it is at least `lower`."""

    lower: float
    upper: float
    position: tuple = ()
    triangle: int = -1

    def within(self, tolerance):
        return self.upper <= tolerance

    def beyond(self, tolerance):
        return self.lower > tolerance


def largest_distance(from_surface, to_surface, tolerance=None, threads=0, progress=None):
    """Interval of the largest distance of a point of the one (vertices, triangles) from the other.

    Its width is at most 1 % of it; where that leaves open whether it is within `tolerance`, it is narrowed until it
    does not.
    """

    def measured(**options):
        found = native.module.hausdorff(*from_surface, *to_surface, threads=threads, progress=progress, **options)
        return Interval(found.lower, found.upper, found.position, found.triangle)

    interval = measured()
    if tolerance is not None and interval.lower <= tolerance < interval.upper:
        decided = measured(bound=tolerance)
        best = max(interval, decided, key=lambda found: found.lower)
        interval = replace(best, upper=min(interval.upper, decided.upper))
    return interval


def both_ways(surface, reference, tolerance=None, threads=0, progress=None):
    """(surface -> reference, reference -> surface)."""
    forward = largest_distance(surface, reference, tolerance, threads, progress)
    return forward, largest_distance(reference, surface, tolerance, threads, progress)
