# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes certified distances between two surfaces in the world, from the stored coordinates."""

from dataclasses import replace

import numpy as np

from .. import native
from . import known
from .verdict import Interval


def largest_distance(from_surface, to_surface, tolerance=None, threads=None, progress=None, again=True):
    """Returns the Interval of the largest distance of a point of `from_surface` from `to_surface`.

    Each surface is a pair (vertices, triangles). The width of the interval is at most 0.1 % of `upper`, with the
    exceptions that native/measure/hausdorff.h names. If `tolerance` lies inside the interval, the interval is narrowed
    until `tolerance` no longer does, as far as rounding permits. again: whether to measure even if this was
    measured before in this session (known.py).
    """
    key = known.key_of("largest", *from_surface, *to_surface, None if tolerance is None else float(tolerance))
    if not again and (found := known.get(key)) is not None:
        return found

    def measured(**options):
        found = native.module.directed_hausdorff(
            *from_surface, *to_surface, threads=threads, progress=progress, **options
        )
        return Interval(found.lower, found.upper, found.position, found.triangle)

    interval = measured()
    if tolerance is not None and interval.undecided(tolerance):
        decided = measured(bound=tolerance)
        best = max(interval, decided, key=lambda found: found.lower)
        interval = replace(best, upper=min(interval.upper, decided.upper))
    known.keep(key, interval)
    return interval


def sampled_distance(points, to_surface, threads=None, progress=None):
    """Returns the largest distance of the points, (n, 3), from a surface: a lower bound of that of a surface through them."""
    corners = np.repeat(np.arange(len(points), dtype=np.int32)[:, None], 3, 1)
    return native.module.directed_hausdorff(points, corners, *to_surface, threads=threads, progress=progress).lower


def both_ways(surface, reference, tolerance=None, threads=None, progress=None):
    """Returns two Intervals: of the surface from the reference, and of the reference from the surface."""
    forward = largest_distance(surface, reference, tolerance, threads, progress)
    return forward, largest_distance(reference, surface, tolerance, threads, progress)
