# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing a decimated mesh into a Blender mesh with all that hangs on it.

The triangles that go on stay the faces they are and their vertices are welded onto the survivors by one
bmesh.ops.weld_verts, so that whatever Blender stores at faces and at surviving vertices is kept as it is. What lies at
corners and edges is gathered by arrays (carry.py).
"""

from dataclasses import dataclass

import bmesh
import bpy
import numpy as np

from ..errors import Refused
from .carry import Carry
from .mesh_io import column


class MeshMismatch(Refused):
    """Nothing was written."""

    def __init__(self, reason):
        super().__init__(f"Blender cannot hold the mesh that was computed: {reason}")


@dataclass(frozen=True)
class Decimated:
    """The native result of decimate(), as far as Blender can hold it: see there for the arrays."""

    vertices: np.ndarray
    triangles: np.ndarray
    vertex_map: np.ndarray
    vertex_source: np.ndarray
    triangle_source: np.ndarray
    turned: np.ndarray  # (l,) bool: an edge was flipped, so that the corners are not those of the source triangle
    source_triangle: np.ndarray
    source_weights: np.ndarray
    coincident: int  # triangles left out: Blender holds one face on any three vertices

    @classmethod
    def of(cls, result, source):
        vertices, vertex_map, vertex_source = result.vertices, result.vertex_map, result.vertex_source
        welded = vertex_map[source.triangles[result.triangle_source]]
        turned = (welded != result.triangles).any(1)
        # A face that is only a segment or a point may have had vertices at one position joined: it keeps its own.
        a, b, c = result.triangles.T
        repeats = source.triangles[result.triangle_source[(a == b) | (b == c) | (c == a)]]
        own = np.unique(repeats[vertex_source[vertex_map[repeats]] != repeats])
        vertex_map = vertex_map.copy()
        vertex_map[own] = len(vertices) + np.arange(len(own))
        vertices = np.concatenate([vertices, source.vertices[own]])
        vertex_source = np.concatenate([vertex_source, own.astype(vertex_source.dtype)])
        triangles = np.where(turned[:, None], result.triangles, vertex_map[source.triangles[result.triangle_source]])
        # Two sheets that lay exactly on one another may end on the same vertices; as surfaces they are one.
        _, first = np.unique(np.sort(triangles, 1), axis=0, return_index=True)
        kept = np.sort(first)
        return cls(
            vertices,
            triangles[kept],
            vertex_map,
            vertex_source,
            result.triangle_source[kept],
            turned[kept],
            result.source_triangle[kept],
            result.source_weights[kept],
            len(triangles) - len(kept),
        )


class Writing:
    """Turns `mesh`, whose arrays are `source`, into the Decimated `result`; a context manager.

    Entering builds a scratch mesh and compares it with the result, vertex by vertex and triangle by triangle, and raises
    MeshMismatch when they differ; the mesh is touched by write() alone.
    """

    def __init__(self, mesh, source, result):
        self._mesh = mesh
        self._source = source
        self._result = result

    def __enter__(self):
        mesh, source, result = self._mesh, self._source, self._result
        self._carry = Carry(mesh, source, result)
        self._built = built = bmesh.new()
        try:
            built.from_mesh(mesh)
            loose = _loose(built)
            _triangulate(built, source)
            faces = _keep_faces(built, source, result.triangle_source)
            _turn(built, faces, result)
            self._carry.blend_groups(built)
            _weld(built, _weld_targets(result), loose)
            self._layout = _compare(_scratch_arrays(built), source, result)
        except BaseException:
            built.free()
            raise
        return self

    def __exit__(self, *_):
        self._built.free()

    def write(self):
        self._built.to_mesh(self._mesh)
        self._carry.write(self._mesh, self._layout)
        stored = column(self._mesh.vertices, "co", 3)[self._layout.result_vertices]
        if not np.array_equal(stored.view(np.uint32), self._result.vertices.view(np.uint32)):
            raise RuntimeError("the mesh that was written is not the one that was certified")


class Layout:
    """Where vertices and corners of the native result are found in the mesh that was written.

    vertices: (n,) new index of each input vertex, those merged into a survivor have the survivor's
    result_vertices: (k,) new index of each result vertex
    triangles, corners: (f,) and (f, 3), the result triangle at each new face, and which of its corners is where
    """

    def __init__(self, vertices, result_vertices, triangles, corners):
        self.vertices = vertices
        self.result_vertices = result_vertices
        self.triangles = triangles
        self.corners = corners


def _loose(built):
    return {edge for edge in built.edges if edge.is_wire}


def _triangulate(built, source):
    """Cuts every polygon along the diagonals of its loop_triangles."""
    faces = built.faces[:]
    sizes = np.bincount(source.polygons, minlength=len(faces)) + 2
    starts = np.searchsorted(source.polygons, np.arange(len(faces)))
    quads = np.flatnonzero(sizes == 4)
    # The two corners of a quad's diagonal are in both its triangles, and the lowest corner is the polygon's first.
    one, two = source.corners[starts[quads]], source.corners[starts[quads] + 1]
    lowest = np.minimum(one.min(1), two.min(1))[:, None]
    through_first = (one == lowest).any(1) & (two == lowest).any(1)
    # An n-gon is clipped by the code that makes its loop_triangles; _keep_faces would notice another cut.
    for chosen, method in (
        (quads[through_first], {"quad_method": "FIXED"}),
        (quads[~through_first], {"quad_method": "ALTERNATE"}),
        (np.flatnonzero(sizes > 4), {"ngon_method": "EAR_CLIP"}),
    ):
        if len(chosen):
            bmesh.ops.triangulate(built, faces=[faces[i] for i in chosen], **method)


def _keep_faces(built, source, kept):
    """Deletes all faces but the triangles `kept` of the source, which it returns; edges and vertices stay."""
    faces = built.faces[:]
    if source.polygons[-1] + 1 == len(source.polygons):  # nothing was cut: face i is triangle i
        rows = np.arange(len(faces))
    else:
        _, present = _scratch_arrays(built)
        rows = _matching_rows(_rotated(source.triangles)[0], _rotated(present)[0])
        if rows is None:
            raise MeshMismatch("its n-gons are cut otherwise than shown. Triangulate them first (Ctrl T in Edit Mode)")
    stays = np.zeros(len(faces), bool)
    stays[rows[kept]] = True
    bmesh.ops.delete(built, geom=[faces[i] for i in np.flatnonzero(~stays)], context="FACES_ONLY")
    return [faces[i] for i in rows[kept].tolist()]


def _turn(built, faces, result):
    """Makes the faces around which edges were flipped anew, on the vertices that survive; they keep what they are.

    faces: those of the result's triangles.
    """
    turned = np.flatnonzero(result.turned).tolist()
    if not turned:
        return
    # One of them may lie where another one was: what they are is kept by copies that lie nowhere.
    copies = bmesh.ops.duplicate(built, geom=[faces[row] for row in turned])["face_map"]
    copies = [copies[faces[row]] for row in turned]
    bmesh.ops.delete(built, geom=[faces[row] for row in turned], context="FACES_ONLY")
    built.verts.ensure_lookup_table()
    corners = result.vertex_source[result.triangles[turned]].tolist()
    for copy, vertices in zip(copies, corners):
        face = built.faces.new([built.verts[vertex] for vertex in vertices], copy)
        for loop, other in zip(face.loops, copy.loops):
            loop.copy_from(other)
    bmesh.ops.delete(built, geom=list({vertex for copy in copies for vertex in copy.verts}), context="VERTS")


def _weld_targets(result):
    """(n,) the input vertex that each input vertex is merged onto; itself where it stays."""
    targets = np.arange(len(result.vertex_map))
    merged = result.vertex_map >= 0
    targets[merged] = result.vertex_source[result.vertex_map[merged]]
    return targets


def _weld(built, targets, loose):
    verts = built.verts[:]
    gone = np.flatnonzero(targets != np.arange(len(targets)))
    bmesh.ops.weld_verts(built, targetmap={verts[i]: verts[j] for i, j in zip(gone.tolist(), targets[gone].tolist())})
    # Edges of deleted faces that became an edge of no other face.
    stray = [edge for edge in built.edges if edge.is_wire and edge not in loose]
    bmesh.ops.delete(built, geom=stray, context="EDGES")


def _scratch_arrays(built):
    """(vertices, triangles) as the mesh would be stored; triangles is None when a face has more than three corners."""
    scratch = bpy.data.meshes.new(".scratch")
    try:
        built.to_mesh(scratch)
        vertices = column(scratch.vertices, "co", 3)
        if len(scratch.loops) != 3 * len(scratch.polygons):
            return vertices, None
        return vertices, column(scratch.loops, "vertex_index", 1, np.int32).reshape(-1, 3)
    finally:
        bpy.data.meshes.remove(scratch)


def _compare(written, source, result):
    """The Layout of the written arrays; raises MeshMismatch unless they are the result, triangle by triangle."""
    vertices, triangles = written
    targets = _weld_targets(result)
    stays = targets == np.arange(len(targets))
    rank = np.cumsum(stays) - 1
    if not np.array_equal(vertices.view(np.uint32), source.vertices[stays].view(np.uint32)):
        raise MeshMismatch("its vertices were not merged as computed")
    result_vertices = rank[result.vertex_source]
    wanted, wanted_shift = _rotated(result_vertices[result.triangles])
    present, present_shift = _rotated(triangles) if triangles is not None else (None, None)
    rows = None if present is None else _matching_rows(present, wanted)
    if rows is None:
        raise MeshMismatch("its faces were not merged as computed")
    corners = (np.arange(3) - present_shift[:, None] + wanted_shift[rows][:, None]) % 3
    return Layout(rank[targets], result_vertices, rows, corners)


def _rotated(triangles):
    """Each triangle turned so that its lowest vertex comes first, and by how many corners it was turned."""
    shift = np.argmin(triangles, 1)
    return np.take_along_axis(triangles, (np.arange(3) + shift[:, None]) % 3, 1), shift


def _matching_rows(wanted, present):
    """For each row of `wanted` the row of `present` that equals it, one to one; None when they differ."""
    if wanted.shape != present.shape:
        return None
    of_wanted, of_present = np.lexsort(wanted.T), np.lexsort(present.T)
    if not np.array_equal(wanted[of_wanted], present[of_present]):
        return None
    rows = np.empty(len(wanted), np.int64)
    rows[of_wanted] = of_present
    return rows
