# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds the faces that close holes to a BMesh, with the attributes of the rims."""

import numpy as np

from ..shared.errors import Refused
from .mesh_io import column, faces_of_corners


def add_faces(built, mesh, source):
    """Adds the new faces of FilledArrays to a BMesh that holds `mesh`. They come last."""
    count = len(built.faces)
    built.verts.ensure_lookup_table()
    built.faces.ensure_lookup_table()
    faces = built.faces[:]
    starts = column(mesh.polygons, "loop_start", 1, np.int32)
    new = slice(len(source.triangles) - len(source.like), None)
    of_corner = faces_of_corners(mesh)[source.corners[new]]
    offsets = source.corners[new] - starts[of_corner]
    for vertices, like, polygons, places in zip(
        source.triangles[new].tolist(), source.like.tolist(), of_corner.tolist(), offsets.tolist()
    ):
        face = built.faces.new([built.verts[vertex] for vertex in vertices], faces[like])
        for loop, polygon, place in zip(face.loops, polygons, places):
            loop.copy_from(faces[polygon].loops[place])
    built.faces.index_update()
    if [face.index for face in faces] != list(range(count)):
        raise Refused("Blender does not keep the order of faces when some are added")
