# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads PLY files that hold nothing but positions, normals and faces, where Blender's own reader is slow.

Before Blender 3.6 its reader of PLY files is written in Python and takes six times as long. The mesh is the same, bit for
bit. That reader leaves out normals, too.
"""

from pathlib import Path

import bpy

from ..mesh import mesh_io

_NORMALS = {"nx", "ny", "nz"}


def read(path, content):
    """Adds an object with the mesh of a checked file to the scene, as Blender's reader would.

    content: the Content that the check of the file has returned. Returns whether this was done: it is not where Blender's
    own reader is as fast, or where the file holds more.
    """
    plain = content.uniform is not None and content.columns.keys() <= _NORMALS and not content.others
    if not plain or Path(path).suffix.lower() != ".ply" or "ply_import" in dir(bpy.ops.wm):
        return False
    name = bpy.path.display_name_from_filepath(str(path))
    mesh = mesh_io.new_mesh(name, content.vertices, content.uniform)
    mesh.validate()  # This leaves out faces that repeat a corner or another face.
    bpy.context.collection.objects.link(bpy.data.objects.new(name, mesh))
    return True
