# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads PLY files where Blender's own reader is slow: before Blender 3.6 it is written in Python.

The mesh is the same, bit for bit, with the faces, UVs and colours of the file. Like that reader, this one leaves out normals and
other numbers of the vertices. Blender's reader of STL files is as fast as this would be.
"""

from pathlib import Path

import bpy
import numpy as np

from ..mesh import mesh_io
from ..mesh.mesh_io import Polygons

_UVS, _COLOURS, _ALPHA = ("s", "t"), ("red", "green", "blue"), "alpha"
_LARGEST = float(np.finfo(np.float32).max)


def read(path, content):
    """Adds an object with the mesh of a checked file to the scene, as Blender's reader would.

    content: the Content that the check of the file has returned. Returns whether this was done: it is not where Blender's
    own reader is as fast, where the file holds more, and where it is not known how its colours are to be scaled.
    """
    if not content.faces or content.others or Path(path).suffix.lower() != ".ply" or "ply_import" in dir(bpy.ops.wm):
        return False
    name = bpy.path.display_name_from_filepath(str(path))
    mesh = _mesh(name, content)
    if mesh is None:
        return False
    mesh.validate()  # This leaves out faces that repeat a corner or another face.
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))
    return True


def _mesh(name, content):
    """Returns a new datablock, or None for a file that is left to Blender's reader."""
    columns = content.columns
    colours = [*_COLOURS, *([_ALPHA] if _ALPHA in columns else [])]
    has_uvs, has_colours = (columns.keys() >= set(names) for names in (_UVS, colours))
    # Where the header of a text declares whole numbers and fractions follow, the numbers are float64.
    if has_colours and any(columns[channel].dtype.itemsize == 8 for channel in colours):
        return None
    corners = content.corners
    sizes = np.broadcast_to(np.asarray(content.sizes, np.int32), content.faces)
    if has_uvs or has_colours:
        corners = _turned(corners, sizes)
    mesh = mesh_io.new_mesh_of_polygons(name, content.vertices, Polygons(corners, sizes))
    if has_uvs:
        # Blender stores the nearest number that it has, and its validation turns what is not a number to zero.
        uvs = np.stack([columns[axis] for axis in _UVS], 1).clip(-_LARGEST, _LARGEST).astype(np.float32)
        mesh.uv_layers.new().data.foreach_set("uv", uvs[corners].ravel())
    if has_colours:
        values = np.ones((len(content.vertices), 4), np.float32)
        for place, channel in enumerate(colours):
            column = columns[channel]
            values[:, place] = column if column.dtype.kind == "f" else column * (1 / 255)
        mesh.vertex_colors.new().data.foreach_set("color", values[corners].ravel())
    return mesh


def _turned(corners, sizes):
    """Returns the corners as Blender's reader stores them where there are UVs or colours: it turns triangles and quads so that
    the vertex 0 is never the third or fourth corner."""
    turned, starts = corners.copy(), np.cumsum(sizes) - sizes
    for size, last, shift in ((3, [2], 1), (4, [2, 3], 2)):
        first = starts[sizes == size]
        first = first[(corners[first[:, None] + last] == 0).any(1)][:, None]
        turned[first + np.arange(size)] = corners[first + (np.arange(size) + shift) % size]
    return turned
