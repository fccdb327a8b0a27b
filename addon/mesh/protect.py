# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the vertices that an operation has to leave alone, by selection, marked edges, symmetry planes or weights."""

import bpy
import numpy as np

from .. import native
from ..shared.decimation import meeting
from ..shared.errors import Refused
from . import mesh_io
from .mesh_io import column

# A vertex counts as lying on a symmetry plane up to this share of the mesh's extent: rounding to float32 and modelling by
# hand leave vertices so far from the plane.
_ON_PLANE = 1e-5


def unselected(ob):
    """Returns (n,) bool: the vertices of faces that are not selected."""
    mesh = ob.data
    selected = column(mesh.polygons, "select", 1, bool)
    if not selected.any():
        raise Refused(f"No face of {ob.name} is selected: select some in Edit Mode")
    vertices = np.zeros(len(mesh.vertices), bool)
    corners = selected[mesh_io.faces_of_corners(mesh)]
    vertices[column(mesh.loops, "vertex_index", 1, np.int32)[~corners]] = True
    return vertices


def unselected_vertices(ob):
    """Returns (n,) bool: the vertices that are not selected."""
    return ~column(ob.data.vertices, "select", 1, bool)


def on_edges(mesh, kinds):
    """Returns (n,) bool: the vertices of the edges of these kinds, which are named as in operation_settings.PROTECTED."""
    chosen = np.zeros(len(mesh.edges), bool)
    for kind in kinds:
        chosen |= _EDGES[kind](mesh)
    vertices = np.zeros(len(mesh.vertices), bool)
    if not chosen.any():
        return vertices
    vertices[column(mesh.edges, "vertices", 2, np.int32)[chosen]] = True
    return vertices


def on_planes(mesh, axes):
    """Returns (n,) bool: the vertices whose coordinate along one of the axes is 0. axes: a set of "X", "Y" and "Z"."""
    if not axes:
        return np.zeros(len(mesh.vertices), bool)
    coordinates = np.abs(column(mesh.vertices, "co", 3))
    near = coordinates <= _ON_PLANE * coordinates.max(initial=0.0)
    return near[:, ["XYZ".index(axis) for axis in axes]].any(1)


def where_islands_meet(arrays, uvs):
    """Returns (n,) bool: the vertices at which three or more UV islands meet. Decimation has to keep them.

    arrays: the MeshArrays of the mesh; uvs: its corner_uvs().
    """
    found = meeting(arrays.triangles, native.module.wedges(arrays.triangles, uvs[arrays.corners]))
    return np.pad(found, (0, len(arrays.vertices) - len(found)))


def group_weights(ob, name, invert):
    """Returns (n,) float64: the weights of the vertex group with this name. Returns None if the name is empty."""
    if not name:
        return None
    group = ob.vertex_groups.get(name)
    if group is None:
        raise Refused(f"{ob.name} has no vertex group {name}")
    weights = np.zeros(len(ob.data.vertices))
    for i, vertex in enumerate(ob.data.vertices):
        for element in vertex.groups:
            if element.group == group.index:
                weights[i] = element.weight
    return 1 - weights if invert else weights


def _boundary(mesh):
    return np.bincount(column(mesh.loops, "edge_index", 1, np.int32), minlength=len(mesh.edges)) == 1


def _creases(mesh):
    if "crease" in bpy.types.MeshEdge.bl_rna.properties:
        return column(mesh.edges, "crease") > 0
    found = mesh.attributes.get("crease_edge")  # where newer versions of Blender store creases
    return column(found.data, "value") > 0 if found else np.zeros(len(mesh.edges), bool)


def _material_borders(mesh):
    materials = column(mesh.polygons, "material_index", 1, np.int32)
    return _differ(mesh, materials[mesh_io.faces_of_corners(mesh)][:, None])


def _island_borders(mesh):
    uvs = mesh_io.corner_uvs(mesh)
    if uvs is None:
        return np.zeros(len(mesh.edges), bool)
    # A corner stands for the edge to the next corner of its face. Its row holds the UVs at the edge's vertex with the
    # smaller index, then those at the other vertex, so that both faces of the edge list them in the same order.
    following = mesh_io.following_corners(mesh)
    vertices = column(mesh.loops, "vertex_index", 1, np.int32)
    swapped = (vertices > vertices[following])[:, None]
    ends = np.where(swapped, uvs[following], uvs), np.where(swapped, uvs, uvs[following])
    return _differ(mesh, np.hstack(ends))


def _differ(mesh, values):
    """Returns (edges,) bool: the edges whose corners have different values. values: (corners, width)."""
    edges = column(mesh.loops, "edge_index", 1, np.int32)
    first = np.zeros(len(mesh.edges), np.int64)
    first[edges] = np.arange(len(edges))
    other = (values != values[first[edges]]).any(1)
    found = np.zeros(len(mesh.edges), bool)
    found[edges[other]] = True
    return found


_EDGES = {
    "BOUNDARY": _boundary,
    "SHARP": lambda mesh: column(mesh.edges, "use_edge_sharp", 1, bool),
    "SEAM": lambda mesh: column(mesh.edges, "use_seam", 1, bool),
    "CREASE": _creases,
    "MATERIAL": _material_borders,
    "UV": _island_borders,
}
