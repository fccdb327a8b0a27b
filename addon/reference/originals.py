# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the mesh of the reference with all its data: UV maps, materials, vertex groups, shape keys and custom normals.

The snapshot holds only vertices and triangles, which the proof needs. The original is a second Mesh datablock that
Object.tolvol points to: a copy that Blender saves with the file. Neither is ever changed. A reference that was set by an
earlier version has no original, and then only its shape is known.
"""

import operator

import numpy as np

from ..mesh import carry
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
        "vertex groups": _has_weights(mesh),
    }
    return [name for name, present in layers.items() if present]


def _has_weights(mesh):
    return any(map(operator.attrgetter("groups"), mesh.vertices))


def with_its_data(mesh):
    """Returns the end of a sentence about a mesh: what data it has, or "" if it has none but its faces."""
    kept = ", ".join(data_names(mesh))
    return f", with its {kept}" if kept else ""


def _uv_maps(mesh):
    return [(layer.name, column(layer.data, "uv", 2).tobytes()) for layer in mesh.uv_layers]


def _materials(mesh):
    return list(mesh.materials), column(mesh.polygons, "material_index", 1, np.int32).tobytes()


def _marks(mesh):
    smooth = column(mesh.polygons, "use_smooth", 1, bool).tobytes()
    return smooth, {name: values.tobytes() for name, values in carry.edge_marks(mesh).items()}


def _attributes(mesh):
    return {
        (domain, name): values.tobytes()
        for domain in ("POINT", "EDGE", "FACE", "CORNER")
        for name, (values, _) in carry.attributes(mesh, domain).items()
    }


def _shape_keys(mesh):
    keys = mesh.shape_keys.key_blocks if mesh.shape_keys else ()
    return [(key.name, column(key.data, "co", 3).tobytes()) for key in keys]


def _custom_normals(mesh):
    normals = carry.custom_normals(mesh)
    return None if normals is None else normals.tobytes()


def _weights(mesh):
    if not _has_weights(mesh):  # It takes a fifth of the time to know that.
        return None
    return [[(group.group, group.weight) for group in vertex.groups] for vertex in mesh.vertices]


_DATA = (_uv_maps, _materials, _marks, _attributes, _shape_keys, _custom_normals, _weights)


def same_data(mesh, other):
    """Whether two meshes of the same shape have the same UV maps, materials, marks, attributes, shape keys, custom normals and
    weights of vertex groups. About a second for a million vertices."""
    return all(read(mesh) == read(other) for read in _DATA)
