# SPDX-License-Identifier: GPL-3.0-or-later
"""Certifies the distances between a mesh and its reference, for a mesh in memory or one read back from a file."""

import numpy as np

from .. import package, volumes
from . import measure


def verdicts(surface, reference, tolerance, threads=None, progress=None):
    """Returns the native verdict of each triangle of a Surface."""
    built = volumes.native_volume(reference, tolerance, threads, progress)
    arrays, matrix = surface.arrays, surface.matrix
    return built.check(arrays.vertices, arrays.triangles, to_world=matrix, threads=threads, progress=progress).verdicts


def outside(surface, reference, found, tolerance, threads=None, progress=None):
    """Returns (m,) bool: the triangles of a Surface that are not proved to be within the tolerance.

    found: the Interval of the largest distance of the Surface from the reference. There are no such triangles if it is within
    the tolerance, and otherwise there is at least one.
    """
    if found.within(tolerance):
        return np.zeros(len(surface.arrays.triangles), bool)
    unproved = verdicts(surface, reference, tolerance, threads, progress) < package.module.Verdict.INSIDE
    unproved[found.triangle] = True
    return unproved


def certify(surface, reference, tolerance, kept_faces=0, threads=None, progress=None, again=True):
    """Returns the entries "forward", "backward" and "outside" of a report for two Surfaces, with intervals as pairs.

    kept_faces: the number of faces that were outside from the start and were kept. If it is not 0, "outside" has the entry
    "rest", the interval of all other faces, unless more faces than these are outside. again: whether to measure even if
    exactly these surfaces were measured before in this session, as those of a file are that holds bit for bit what was
    certified in memory.
    """
    judge = (tolerance, threads, progress, again)
    triangles = surface.arrays.triangles
    other = reference.world(), reference.arrays.triangles
    forward, backward = measure.both_ways((surface.world(), triangles), other, *judge)
    outside = {}
    if kept_faces:
        inside = triangles[verdicts(surface, reference, tolerance, threads, progress) == package.module.Verdict.INSIDE]
        if len(triangles) - len(inside) <= kept_faces and len(inside):
            rest = measure.largest_distance((surface.world(), inside), other, *judge)
            outside["rest"] = [rest.lower, rest.upper]
    return {"forward": [forward.lower, forward.upper], "backward": [backward.lower, backward.upper], "outside": outside}
