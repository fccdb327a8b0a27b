# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers that a decimated mesh has to prove, whether it is still in memory or was read back from a file."""

import numpy as np

from ..reference import volumes
from . import measure

INSIDE = 2  # of the native verdicts; unproved counts as outside


def verdicts(surface, reference, tolerance, threads=0, progress=None):
    """The native verdict of each triangle of a Surface."""
    built = volumes.native_volume(reference, tolerance, threads, progress)
    arrays, matrix = surface.arrays, surface.matrix
    return built.check(arrays.vertices, arrays.triangles, to_world=matrix, threads=threads, progress=progress).verdict


def outside(surface, reference, tolerance, threads=0, progress=None):
    """(m,) bool: the triangles of a Surface that are not proved; none where certify() finds it within the tolerance, at
    least one where it does not."""
    pair = (surface.world(), surface.arrays.triangles), (reference.world(), reference.arrays.triangles)
    found = measure.largest_distance(*pair, tolerance, threads, progress)
    if found.within(tolerance):
        return np.zeros(len(surface.arrays.triangles), bool)
    unproved = verdicts(surface, reference, tolerance, threads, progress) < INSIDE
    unproved[found.triangle] = True
    return unproved


def certify(surface, reference, tolerance, kept_faces=0, threads=0, progress=None):
    """{"forward", "backward", "outside"} of a report: intervals as pairs, for two Surfaces.

    kept_faces: how many faces of the mesh were outside from the start and kept as they are. "outside" then has "rest", the
    interval of all other faces, unless more than that many are outside.
    """
    judge = (tolerance, threads, progress)
    triangles = surface.arrays.triangles
    other = reference.world(), reference.arrays.triangles
    forward, backward = measure.both_ways((surface.world(), triangles), other, *judge)
    outside = {}
    if kept_faces:
        inside = triangles[verdicts(surface, reference, tolerance, threads, progress) >= INSIDE]
        if len(triangles) - len(inside) <= kept_faces and len(inside):
            rest = measure.largest_distance((surface.world(), inside), other, *judge)
            outside["rest"] = [rest.lower, rest.upper]
    return {"forward": [forward.lower, forward.upper], "backward": [backward.lower, backward.upper], "outside": outside}
