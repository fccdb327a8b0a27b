# SPDX-License-Identifier: GPL-3.0-or-later
"""Continues a surface beyond its open borders: there a mesh within the tolerance may lie beside the surface."""

import bpy
import numpy as np

from ..mesh.carry import corner_normals
from ..mesh.mesh_io import column, faces_of_corners, following_corners, new_mesh


def around(mesh, width):
    """Returns a new mesh of a strip of this width along all borders of `mesh`, in the direction in which its faces end, with
    the normals of the border. Returns None if there are no borders.
    """
    edges, starts = (column(mesh.loops, name, 1, np.int32) for name in ("edge_index", "vertex_index"))
    first = np.flatnonzero((np.bincount(edges, minlength=len(mesh.edges)) == 1)[edges])
    if not len(first):
        return None
    second = following_corners(mesh)[first]
    places, normals = column(mesh.vertices, "co", 3), corner_normals(mesh)
    faces = faces_of_corners(mesh)[first]
    along = places[starts[second]] - places[starts[first]]
    outward = _unit(np.cross(along, column(mesh.polygons, "normal", 3)[faces]))
    outwards = np.zeros_like(places)
    for corners in (first, second):
        np.add.at(outwards, starts[corners], outward)
    ends = places + width * _unit(outwards)
    a, b = starts[first], starts[second]
    strip = new_mesh(
        ".skirt",
        np.stack([places[b], places[a], ends[a], ends[b]], 1).reshape(-1, 3),
        np.arange(4 * len(first)).reshape(-1, 4),
    )
    strip.polygons.foreach_set("use_smooth", np.ones(len(first), bool))
    if bpy.app.version < (4, 1):
        strip.use_auto_smooth = True
    strip.normals_split_custom_set(
        np.stack([normals[each] for each in (second, first, first, second)], 1).reshape(-1, 3)
    )
    return strip


def _unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-30)
