# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes as arrays: coordinates as they are stored, the triangles that Blender shows, and the 4x4 to the world."""

import hashlib
from dataclasses import dataclass

import bmesh
import bpy
import numpy as np


@dataclass(frozen=True)
class MeshArrays:
    """The base mesh of a datablock, n vertices and m triangles."""

    vertices: np.ndarray  # (n, 3) float32, local space, as stored
    triangles: np.ndarray  # (m, 3) int32, Blender's own triangulation (loop_triangles)
    corners: np.ndarray  # (m, 3) int32, the mesh corner (loop) at each triangle corner
    polygons: np.ndarray  # (m,) int32, the polygon that each triangle is part of

    def fingerprint(self):
        """Equal for equal coordinates and triangles, whatever the datablock."""
        digest = hashlib.blake2b(self.vertices.tobytes(), digest_size=16)
        digest.update(self.triangles.tobytes())
        return digest.hexdigest()


def column(collection, attribute, width=1, dtype=np.float32):
    """One attribute of a whole collection, (n,) or (n, width)."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(attribute, values)
    return values if width == 1 else values.reshape(-1, width)


def read_mesh(mesh):
    """The arrays of `mesh`, about 60 ms for 270,000 triangles."""
    mesh.calc_loop_triangles()
    triangles = mesh.loop_triangles
    return MeshArrays(
        column(mesh.vertices, "co", 3),
        column(triangles, "vertices", 3, np.int32),
        column(triangles, "loops", 3, np.int32),
        column(triangles, "polygon_index", 1, np.int32),
    )


def whole_quads(mesh, arrays):
    """(m, 3), or (m, 4) with quads whole and triangles with a repeated corner: faces for checks in every triangulation.

    arrays: those of the mesh. Of faces with more corners the triangles that Blender shows.
    """
    sizes = column(mesh.polygons, "loop_total", 1, np.int32)
    quad = sizes == 4
    if not quad.any():
        return arrays.triangles
    corners = column(mesh.polygons, "loop_start", 1, np.int32)[quad][:, None] + np.arange(4)
    quads = column(mesh.loops, "vertex_index", 1, np.int32)[corners]
    others = arrays.triangles[~quad[arrays.polygons]]
    return np.concatenate([quads, others[:, [0, 1, 2, 2]]])


def triangles_at(mesh, vertices):
    """(m, 3) int32: how Blender would triangulate the mesh if its vertices were there."""
    scratch = mesh.copy()
    try:
        scratch.vertices.foreach_set("co", vertices.ravel())
        return read_mesh(scratch).triangles
    finally:
        bpy.data.meshes.remove(scratch)


def select_faces(mesh, chosen):
    """chosen: (polygons,) bool; no vertex or edge by itself. In Object Mode."""
    if bpy.app.version >= (5, 0) and (attribute := mesh.attributes.get(".select_edge")):
        mesh.attributes.remove(attribute)  # which selects none; 5.0 crashes when they are set in one that is there
    for elements in (mesh.vertices, mesh.edges):
        elements.foreach_set("select", np.zeros(len(elements), bool))
    mesh.polygons.foreach_set("select", chosen)


def move_vertices(mesh, before, after):
    """Writes coordinates bit for bit; shape keys keep their motion from the basis. before: the present ones."""
    mesh.vertices.foreach_set("co", after.ravel())
    if mesh.shape_keys:
        for key in mesh.shape_keys.key_blocks:
            basis = key == mesh.shape_keys.reference_key
            key.data.foreach_set("co", (after if basis else column(key.data, "co", 3) + (after - before)).ravel())
    # Blender keeps the triangles it has through foreach_set and update(); one vertex set by itself makes it cut anew.
    mesh.vertices[0].co = mesh.vertices[0].co
    mesh.update()


def move_edited(mesh, indices, places):
    """Writes coordinates of some vertices bit for bit while the mesh is in Edit Mode; the BMesh, to be updated."""
    edited = bmesh.from_edit_mesh(mesh)
    edited.verts.ensure_lookup_table()
    for index, place in zip(indices.tolist(), places.tolist()):
        edited.verts[index].co = place
    return edited


def new_mesh(name, vertices, triangles):
    """A datablock that holds these coordinates and triangles bit for bit, and nothing else."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(triangles, np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    if bpy.app.version < (4, 0):  # computed, and read-only, from 4.0 on
        mesh.polygons.foreach_set("loop_total", np.full(len(triangles), 3, np.int32))
    mesh.update(calc_edges=True)
    return mesh


def matrix_array(matrix):
    """A mathutils.Matrix as (4, 4) float64."""
    return np.array(matrix, dtype=np.float64)


def to_world(vertices, matrix):
    """Stored coordinates mapped to the world, (n, 3) float64."""
    return np.asarray(vertices, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def loose_edges(mesh):
    """(k, 2) int32: the vertices of the edges that no face uses."""
    used = np.zeros(len(mesh.edges), bool)
    used[column(mesh.loops, "edge_index", 1, np.int32)] = True
    return column(mesh.edges, "vertices", 2, np.int32)[~used]


def corner_uvs(mesh):
    """(corners, 2 * layers) float32: the values of all UV maps, or None when there are none."""
    if not mesh.uv_layers:
        return None
    return np.hstack([column(layer.data, "uv", 2) for layer in mesh.uv_layers])
