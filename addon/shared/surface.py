# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes as arrays, and their place in the world."""

import hashlib
from dataclasses import dataclass

import numpy as np

from . import package


@dataclass(frozen=True)
class MeshArrays:
    """A mesh of n vertices and m triangles. In Blender it is the base mesh of a datablock."""

    vertices: np.ndarray  # (n, 3) float32 or float64, local space, as stored
    triangles: np.ndarray  # (m, 3) int32; in Blender its own triangulation (loop_triangles)
    corners: np.ndarray  # (m, 3) int32, the mesh corner (loop) at each triangle corner, or None
    polygons: np.ndarray  # (m,) int32, the polygon that each triangle is part of, or None

    def fingerprint(self):
        """Returns a text that is equal for equal coordinates and triangles, whatever datablock they are from."""
        digest = hashlib.blake2b(self.vertices.tobytes(), digest_size=16)
        digest.update(self.triangles.tobytes())
        return digest.hexdigest()


def areas(corners):
    """Returns the areas of triangles, (k,). corners: (k, 3, 3), in any lengths."""
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2


@dataclass(frozen=True)
class Surface:
    """A mesh and its place in the world."""

    arrays: MeshArrays
    matrix: np.ndarray  # (4, 4) float64

    def world(self):
        return to_world(self.arrays.vertices, self.matrix)

    def size(self):
        """The length that is 100 %."""
        return package.module.diagonal(self.arrays.vertices, self.arrays.triangles, to_world=self.matrix)


def to_world(vertices, matrix):
    """Maps stored coordinates to the world: (n, 3) float64."""
    return np.asarray(vertices, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def joined(surfaces):
    """Joins several Surfaces to one with world coordinates in double precision. A single Surface is returned as it is.

    Triangles of a mirrored surface run the other way round in the world, as Blender shows them.
    """
    surfaces = list(surfaces)
    if len(surfaces) == 1:
        return surfaces[0]
    vertices, triangles, base = [], [], 0
    for surface in surfaces:
        vertices.append(surface.world())
        mirrored = np.linalg.det(surface.matrix[:3, :3]) < 0
        triangles.append(surface.arrays.triangles[:, :: -1 if mirrored else 1] + base)
        base += len(surface.arrays.vertices)
    arrays = MeshArrays(np.concatenate(vertices), np.concatenate(triangles).astype(np.int32), None, None)
    return Surface(arrays, np.eye(4))
