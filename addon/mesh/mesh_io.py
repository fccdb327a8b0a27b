# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads Blender's meshes as arrays (stored coordinates and the triangles that Blender shows) and writes arrays to them."""

from dataclasses import dataclass, replace

import bmesh
import bpy
import numpy as np

from ..shared import islands
from ..shared.surface import MeshArrays


def column(collection, attribute, width=1, dtype=np.float32):
    """Returns one attribute of a whole collection, (n,) or (n, width)."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(attribute, values)
    return values if width == 1 else values.reshape(-1, width)


def loop_triangles(mesh):
    """Returns Mesh.loop_triangles as Blender draws and exports them."""
    if mesh.polygons:
        # Blender cuts some bent quads along the other diagonal as long as it has not computed the normals of the faces. To
        # read one normal makes it compute all of them.
        _ = mesh.polygon_normals[0].vector
    mesh.calc_loop_triangles()
    return mesh.loop_triangles


def read_mesh(mesh):
    """Returns the arrays of `mesh`. This takes about 60 ms for 270,000 triangles, and half of that if all faces are triangles."""
    if all_triangles(mesh):
        corners = np.arange(len(mesh.loops), dtype=np.int32).reshape(-1, 3)
        triangles = column(mesh.loops, "vertex_index", 1, np.int32).reshape(-1, 3)
        return MeshArrays(
            column(mesh.vertices, "co", 3), triangles, corners, np.arange(len(mesh.polygons), dtype=np.int32)
        )
    triangles = loop_triangles(mesh)
    return MeshArrays(
        column(mesh.vertices, "co", 3),
        column(triangles, "vertices", 3, np.int32),
        column(triangles, "loops", 3, np.int32),
        column(triangles, "polygon_index", 1, np.int32),
    )


def all_triangles(mesh):
    """Whether face i of `mesh` is a triangle with the corners 3 i, 3 i + 1 and 3 i + 2: Blender draws it as it is stored."""
    count = len(mesh.polygons)
    if len(mesh.loops) != 3 * count:
        return False
    starts, sizes = (column(mesh.polygons, name, 1, np.int32) for name in ("loop_start", "loop_total"))
    return bool((sizes == 3).all()) and np.array_equal(starts, np.arange(0, 3 * count, 3))


def triangle_count(mesh):
    """Returns how many triangles Blender cuts the polygons of `mesh` into."""
    return len(mesh.loops) - 2 * len(mesh.polygons)


@dataclass(frozen=True)
class Polygons:
    """The polygons of a mesh by the vertices of their corners, one polygon after the other."""

    corners: np.ndarray  # (k,) int32: the vertex of each corner
    sizes: np.ndarray  # (p,) int32: the number of corners of each polygon

    @classmethod
    def of(cls, mesh):
        starts, sizes = (column(mesh.polygons, name, 1, np.int32) for name in ("loop_start", "loop_total"))
        return cls(column(mesh.loops, "vertex_index", 1, np.int32)[_runs(starts, sizes)], sizes)

    def of_corners(self):
        """Returns (k,): the polygon of each corner."""
        return np.repeat(np.arange(len(self.sizes)), self.sizes)

    def of_triangles(self):
        """Returns (m,): the polygon of each triangle that triangles_at() returns."""
        return np.repeat(np.arange(len(self.sizes)), self.sizes - 2)

    def chosen(self, polygons):
        """Returns the polygons with these indices, ascending."""
        starts, sizes = np.cumsum(self.sizes) - self.sizes, self.sizes[polygons]
        return Polygons(self.corners[_runs(starts[polygons], sizes)], sizes)

    def triangles_at(self, vertices):
        """Returns (m, 3) int32: the triangles that Blender shows for the polygons when the vertices are at these
        positions, those of one polygon after those of another. They depend on the corners of the polygon alone."""
        if (self.sizes == 3).all():
            return self.corners.reshape(-1, 3)
        used, corners = np.unique(self.corners, return_inverse=True)
        scratch = bpy.data.meshes.new(".triangles")
        try:
            _add_polygons(scratch, vertices[used], Polygons(corners, self.sizes))
            return used[column(loop_triangles(scratch), "vertices", 3, np.int32)].astype(np.int32)
        finally:
            # Nothing uses the datablock: it is not necessary to look for users of it everywhere.
            bpy.data.meshes.remove(scratch, do_unlink=False)

    def whole_quads(self, triangles):
        """Returns faces for a check of quads in both their triangulations, and the polygon of each: (m, 4) or, if there are
        no quads, (m, 3).

        triangles: those of the polygons, as triangles_at() returns them. A quad begins where the diagonal does along which
        Blender cuts it. In (m, 4) a triangle repeats its last corner. A face with more than four corners is replaced by its
        triangles.
        """
        of_triangles = self.of_triangles()
        quad = self.sizes == 4
        if not quad.any():
            return triangles, of_triangles
        quads = self.chosen(np.flatnonzero(quad)).corners.reshape(-1, 4)
        shown = triangles[quad[of_triangles]].reshape(-1, 6)
        otherwise = np.count_nonzero(shown == quads[:, :1], axis=1) == 1
        quads[otherwise] = np.roll(quads[otherwise], -1, axis=1)
        others = ~quad[of_triangles]
        faces = np.concatenate([quads, triangles[others][:, [0, 1, 2, 2]]])
        return faces, np.concatenate([np.flatnonzero(quad), of_triangles[others]])


def _runs(starts, sizes):
    """Returns the numbers from each start on, as many as its size says, one run after the other."""
    return np.arange(sizes.sum()) + np.repeat(starts - (np.cumsum(sizes) - sizes), sizes)


def both_triangulations(mesh, arrays):
    """Returns the arrays of a mesh with the triangles of its quads along either diagonal."""
    return replace(arrays, triangles=cut_both_ways(Polygons.of(mesh).whole_quads(arrays.triangles)[0])[0])


def cut_both_ways(faces):
    """Returns the triangles of faces, of quads those along either diagonal: (k, 3), and the face of each, (k,).

    faces: (m, 3) or (m, 4), where a triangle repeats its last corner.
    """
    of_face = np.arange(len(faces))
    if faces.shape[1] == 3:
        return faces, of_face
    quads = np.flatnonzero(faces[:, 2] != faces[:, 3])
    others = [faces[quads][:, corners] for corners in ([0, 2, 3], [0, 1, 3], [1, 2, 3])]
    return np.concatenate([faces[:, :3], *others]), np.concatenate([of_face, quads, quads, quads])


def following_corners(mesh):
    """Returns the next corner around the face for each corner of a mesh, (corners,)."""
    begins, sizes = (column(mesh.polygons, name, 1, np.int32) for name in ("loop_start", "loop_total"))
    following = np.arange(1, len(mesh.loops) + 1)
    following[begins + sizes - 1] = begins
    return following


def faces_of_corners(mesh):
    """Returns (corners,) int32: the face of each corner of a mesh.

    Before Blender 4.0 a face may have its corners anywhere among those of the mesh: scripts and importers choose loop_start.
    """
    begins, sizes = (column(mesh.polygons, name, 1, np.int32) for name in ("loop_start", "loop_total"))
    faces = np.zeros(len(mesh.loops), np.int32)
    faces[_runs(begins, sizes)] = np.repeat(np.arange(len(sizes)), sizes)
    return faces


def triangles_at(mesh, vertices):
    """Returns (m, 3) int32: the triangles that Blender would show if the mesh had these vertex positions."""
    scratch = mesh.copy()
    try:
        scratch.vertices.foreach_set("co", vertices.ravel())
        _forget_triangles(scratch)
        return read_mesh(scratch).triangles
    finally:
        bpy.data.meshes.remove(scratch)


def select_faces(mesh, chosen):
    """Selects the chosen faces and no other element, in Object Mode. chosen: (polygons,) bool."""
    _deselect(mesh)
    mesh.polygons.foreach_set("select", chosen)


def select_vertices(mesh, chosen):
    """Selects the chosen vertices and no other element, in Object Mode. chosen: (vertices,) bool."""
    _deselect(mesh)
    mesh.vertices.foreach_set("select", chosen)


def _deselect(mesh):
    if bpy.app.version >= (5, 0) and (attribute := mesh.attributes.get(".select_edge")):
        # Blender 5.0 crashes when the selection of edges is written while this attribute exists. Removing the attribute
        # deselects all edges.
        mesh.attributes.remove(attribute)
    for elements in (mesh.vertices, mesh.edges, mesh.polygons):
        elements.foreach_set("select", np.zeros(len(elements), bool))


def move_vertices(mesh, before, after):
    """Writes coordinates bit for bit. before: the present coordinates.

    Shape keys keep their offsets from the basis.
    """
    mesh.vertices.foreach_set("co", after.ravel())
    if mesh.shape_keys:
        for key in mesh.shape_keys.key_blocks:
            basis = key == mesh.shape_keys.reference_key
            key.data.foreach_set("co", (after if basis else column(key.data, "co", 3) + (after - before)).ravel())
    _forget_triangles(mesh)
    mesh.update()


def _forget_triangles(mesh):
    """Makes Blender compute the normals and the triangles of `mesh` anew. foreach_set() and update() keep them."""
    mesh.vertices[0].co = mesh.vertices[0].co


def move_edited(mesh, indices, places):
    """Writes the coordinates of some vertices bit for bit while the mesh is in Edit Mode.

    Returns the BMesh; the caller has to update the edit mesh.
    """
    edited = bmesh.from_edit_mesh(mesh)
    edited.verts.ensure_lookup_table()
    for index, place in zip(indices.tolist(), places.tolist()):
        edited.verts[index].co = place
    return edited


def new_mesh(name, vertices, faces):
    """Returns a new datablock that holds these coordinates, rounded to float32, and these faces, (m, k)."""
    sizes = np.full(len(faces), faces.shape[1], np.int32)
    return new_mesh_of_polygons(name, vertices, Polygons(faces.ravel(), sizes))


def new_mesh_of_polygons(name, vertices, polygons):
    """Returns a new datablock that holds these coordinates, rounded to float32, and these polygons."""
    mesh = bpy.data.meshes.new(name)
    _add_polygons(mesh, vertices, polygons)
    mesh.update(calc_edges=True)
    return mesh


def _add_polygons(mesh, vertices, polygons):
    """Gives an empty mesh these vertices and polygons, and no edges."""
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(len(polygons.corners))
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(polygons.corners, np.int32))
    mesh.polygons.add(len(polygons.sizes))
    mesh.polygons.foreach_set("loop_start", (np.cumsum(polygons.sizes) - polygons.sizes).astype(np.int32))
    if bpy.app.version < (4, 0):  # From 4.0 on Blender computes loop_total, and it is read-only.
        mesh.polygons.foreach_set("loop_total", np.ascontiguousarray(polygons.sizes, np.int32))


def matrix_array(matrix):
    """Returns a mathutils.Matrix as (4, 4) float64."""
    return np.array(matrix, dtype=np.float64)


def edges_of_faces(mesh):
    """Returns (m,) bool: the edges that a face uses."""
    used = np.zeros(len(mesh.edges), bool)
    used[column(mesh.loops, "edge_index", 1, np.int32)] = True
    return used


def loose_edges(mesh):
    """Returns (k, 2) int32: the vertices of the edges that no face uses."""
    loose = np.flatnonzero(~edges_of_faces(mesh))
    if not len(loose):
        return np.empty((0, 2), np.int32)
    return column(mesh.edges, "vertices", 2, np.int32)[loose]


def corner_uvs(mesh):
    """Returns (corners, 2 * layers) float32: the values of all UV maps, of which those at one vertex that differ only by
    rounding are made equal. They tell islands apart, and are not for writing. Returns None if there are no UV maps."""
    if not mesh.uv_layers:
        return None
    uvs = np.hstack([column(layer.data, "uv", 2) for layer in mesh.uv_layers])
    return islands.without_rounding(uvs, column(mesh.loops, "vertex_index", 1, np.int32))
