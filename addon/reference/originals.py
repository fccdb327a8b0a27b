# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the mesh of the reference with all its data: UV maps, materials, vertex groups, shape keys and custom normals.

The snapshot holds only vertices and triangles, which the proof needs. The original is a second Mesh datablock that
Object.tolvol points to: a copy that Blender saves with the file. Neither is ever changed. A reference that was set by an
earlier version has no original, and then only its shape is known.
"""

from ..mesh.mesh_io import column


def copy_of(source, arrays):
    """Returns a copy of the mesh of the object `source`, or None if it is no longer the mesh that `arrays` were read from."""
    if source is None or source.type != "MESH":
        return None
    mesh = source.data
    if (
        len(mesh.vertices) != len(arrays.vertices)
        or column(mesh.vertices, "co", 3).tobytes() != arrays.vertices.tobytes()
    ):
        return None
    copy = mesh.copy()
    copy.name = f".{mesh.name} original"
    copy.use_fake_user = False
    return copy


def kept(ob):
    """Returns the mesh that stands for the original of `ob`: the original, or the snapshot if only the shape is known."""
    return ob.tolvol.original or ob.tolvol.snapshot


def data_names(mesh):
    """Returns the kinds of data of a mesh that a new mesh of the same shape would lack, as words for a message."""
    layers = {
        "UV maps": mesh.uv_layers,
        "materials": mesh.materials,
        "shape keys": mesh.shape_keys,
        "custom normals": mesh.has_custom_normals,
    }
    return [name for name, present in layers.items() if present]
