# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes certified distances between two surfaces in the world, from the stored coordinates."""

import contextlib
from dataclasses import replace

import numpy as np

from .. import package
from . import known
from .verdict import Interval

_HASHED_AT_ONCE = 1 << 16  # triangles


def largest_distance(from_surface, to_surface, tolerance=None, threads=None, progress=None, again=True):
    """Returns the Interval of the largest distance of a point of `from_surface` from `to_surface`.

    Each surface is a pair (vertices, triangles). The width of the interval is at most 0.1 % of `upper`, with the
    exceptions that native/measure/hausdorff.h names, and `tolerance` does not lie inside the interval, as far as rounding
    permits. again: whether to measure even if these surfaces were measured before in this session (known.py).
    """
    key = _key(_content(from_surface), _content(to_surface))
    return _largest(key, from_surface, to_surface, tolerance, threads, progress, again)


def _largest(key, from_surface, to_surface, tolerance, threads, progress, again):
    found = None if again else known.get(key)
    if found and (tolerance is None or not found.undecided(tolerance)):
        return found

    def measured(**options):
        found = package.module.directed_hausdorff(
            *from_surface, *to_surface, threads=threads, progress=progress, **options
        )
        return Interval(found.lower, found.upper, found.position, found.triangle)

    interval = measured() if tolerance is None else measured(bound=tolerance)
    if tolerance is not None and not interval.within(tolerance):
        # The search ended as soon as the distance was known to be beyond, or after many pieces: the interval may be wide.
        interval = interval.narrowed(measured())
    # What an operation has proved may be narrower than what a second measurement finds.
    if earlier := known.get(key):
        interval = interval.narrowed(earlier)
    known.keep(key, interval)
    return interval


def take_over(surface, same, other, rows):
    """Remembers what was measured between `same` and `other` as the distances between `surface` and `other`, too.

    Each is a pair (vertices, triangles). `surface` is `same` with its vertices and triangles in another order: its triangle i
    is the triangle rows[i] of `same`.
    """
    same, surface, other = map(_content, (same, surface, other))
    if found := known.get(_key(same, other)):
        triangle = int(np.flatnonzero(rows == found.triangle)[0])
        known.keep(_key(surface, other), replace(found, triangle=triangle))
    if found := known.get(_key(other, same)):
        known.keep(_key(other, surface), found)


def _content(surface):
    """Returns a value that is equal for surfaces of equal triangles in equal order, however their vertices are numbered."""
    vertices, triangles = surface

    def parts():
        """Yields a part at a time, because the corners of all triangles would need several times the memory of the surface."""
        for first in range(0, len(triangles), _HASHED_AT_ONCE):
            yield vertices[triangles[first : first + _HASHED_AT_ONCE]]
            package.module.pause(0.0)  # In Blender the window is drawn between two parts.

    return known.key_of("corners", parts())


def _key(from_content, to_content):
    """Returns the key of the largest distance, whatever tolerance it is compared with."""
    return known.key_of("largest", (from_content, to_content))


def sampled_distance(points, to_surface, threads=None, progress=None):
    """Returns the largest distance of the points, (n, 3), from a surface: a lower bound of that of a surface through them."""
    corners = np.repeat(np.arange(len(points), dtype=np.int32)[:, None], 3, 1)
    return package.module.directed_hausdorff(points, corners, *to_surface, threads=threads, progress=progress).lower


def both_ways(surface, reference, tolerance=None, threads=None, progress=None, again=True):
    """Returns two Intervals: of the surface from the reference, and of the reference from the surface."""
    own, other = _content(surface), _content(reference)
    judge = (tolerance, threads, progress, again)
    with part_of(progress, 0, 0.5):
        forward = _largest(_key(own, other), surface, reference, *judge)
    with part_of(progress, 0.5, 1):
        return forward, _largest(_key(other, own), reference, surface, *judge)


def part_of(progress, first, last):
    """Returns a context within which calls show their progress as a part of the whole. progress: may be None."""
    return contextlib.nullcontext() if progress is None else progress.part(first, last)
