# SPDX-License-Identifier: GPL-3.0-or-later
"""What the check of a mesh file has read, and the checks that all formats share."""

import warnings
from dataclasses import dataclass, field

import numpy as np

from ..errors import Refused

_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Content:
    """What a mesh file holds. The arrays are None where the check does not build them, as for glTF.

    faces: the number of faces that the file declares
    vertices: (n, 3) float32 or float64, whichever holds exactly what the file stores
    corners: the vertex at each corner of the polygons, one polygon after another; integers
    sizes: (faces,) the number of corners of each polygon, or one number if all have as many
    columns: the other numbers of each vertex, by the names in a PLY file, {name: (n,)}
    uvs, normals: a pair (values, the index of a value at each corner) for an OBJ file that has them at every corner
    others: what the file holds beyond that, as words for a message
    """

    faces: int
    vertices: np.ndarray | None = None
    corners: np.ndarray | None = None
    sizes: np.ndarray | int = 3
    columns: dict = field(default_factory=dict)
    uvs: tuple | None = None
    normals: tuple | None = None
    others: tuple = ()

    @property
    def uniform(self):
        """The polygons as (faces, k) if all of them have k corners, else None."""
        if self.corners is None or not isinstance(self.sizes, int):
            return None
        return self.corners.reshape(-1, self.sizes)


def require_finite(coordinates, number=lambda row: row + 1):
    """coordinates: (n, 3). A number beyond float32 counts as infinite, because Blender's readers store float32.

    number: returns the number of the vertex in a row, as the message gives it.
    """
    if not len(coordinates) or -_LARGEST <= coordinates.min() and coordinates.max() <= _LARGEST:
        return
    bad = np.flatnonzero(~(np.abs(coordinates) <= _LARGEST).all(1))
    if len(bad):
        shown = ", ".join(f"{value:g}" for value in coordinates[bad[0]])
        raise Refused(f"vertex {number(bad[0])} is not finite ({shown})")


def require_indices(lowest, highest, count, first, faces_before=0):
    """lowest, highest: the smallest and largest vertex number of each face; vertices are numbered from `first`."""
    bad = np.flatnonzero((lowest < first) | (highest >= first + count))
    if len(bad):
        face = bad[0]
        index = lowest[face] if lowest[face] < first else highest[face]
        raise Refused(f"face {faces_before + face + 1} names vertex {index}, but there are only {count} vertices")


def positions(lines):
    """Returns ((n, 3) float64, whether there is more on the lines), for lines that begin with three numbers, as bytes."""
    # Most files have three numbers on each line. What else stands there is looked at only if there are more or fewer.
    found = numbers(b" ".join(lines), np.float64)
    if found is not None and len(found) == 3 * len(lines):
        return found.reshape(-1, 3), False
    rows = [line.split()[:3] for line in lines]
    found = numbers(b" ".join(word for row in rows for word in row), np.float64)
    if found is None or len(found) != 3 * len(lines):
        for number, row in enumerate(rows, 1):
            one = numbers(b" ".join(row), np.float64)
            if one is None or len(one) != 3:
                raise Refused(f"vertex {number} is not three numbers ({b' '.join(row).decode(errors='replace')})")
    return found.reshape(-1, 3), True


def common_size(sizes):
    """Returns the number of corners of all polygons if they have equally many, else the numbers, as Content has them."""
    return int(sizes[0]) if len(sizes) and (sizes == sizes[0]).all() else sizes


def are_whole(values):
    """Tells which numbers are whole, and not too large for an integer."""
    return (values == np.rint(values)) & (np.abs(values) < 2**53)


def numbers(text, dtype):
    """Returns the numbers in a text, or None when the text holds anything else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # NumPy warns where it stops before the end
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            return None
