# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a decimated mesh into a Blender mesh and keeps the mesh's attributes.

The remaining triangles stay the faces that they are in the Blender mesh. A vertex that has none of them is removed, and one
call of bmesh.ops.weld_verts merges each other vertex that the result lacks into a remaining one. Data that Blender stores at
faces and at remaining vertices is thereby kept as it is. Data at corners and edges is computed as arrays by carry.py.
"""

import bmesh
import bpy
import numpy as np

from ..shared.errors import Refused
from ..shared.filling import FilledArrays
from .carry import Carry
from .filling import add_faces
from .mesh_io import column, edges_of_faces

# Vertices are removed one by one, so many between two breaths: 0.1 s.
_PIECE = 100_000


class MeshMismatch(Refused):
    """Blender's mesh would differ from the computed one. Nothing was written."""

    def __init__(self, reason):
        super().__init__(f"Blender cannot hold the computed mesh: {reason}")


class Writing:
    """A context manager that turns `mesh`, whose arrays are `source`, into the Decimated `result`. The arrays may be
    FilledArrays: the mesh then gets their new faces first.

    prepare() builds a scratch mesh, which lives as long as the context. After that, `layout` tells where the result is in
    the written mesh. Only write() changes a mesh.

    compact: whether prepare() ends with a copy of the scratch mesh, which frees the memory of removed elements. LOD Chain
    asks for it, because it prepares all levels before it writes the first one.
    """

    def __init__(self, mesh, source, result, compact=False):
        self._mesh = mesh
        self._source = source
        self._result = result
        self._is_compact = compact

    def __enter__(self):
        self._built = bmesh.new()
        return self

    def __exit__(self, *_):
        self._built.free()

    def prepare(self):
        """A generator: builds the scratch mesh and compares it with the result vertex by vertex and triangle by triangle.
        Raises MeshMismatch if they differ.

        It yields between its parts, each of which takes at most about 0.1 s for 300,000 triangles: Blender takes so long to make
        the scratch mesh. The mesh must stay as it is.
        """
        mesh, source, result, built = self._mesh, self._source, self._result, self._built
        self._carry = Carry(mesh, source, result)
        yield
        built.from_mesh(mesh)
        yield
        loose = _loose(mesh, built)
        if isinstance(source, FilledArrays):
            add_faces(built, mesh, source)
        yield
        if not _only_triangles(source):
            _triangulate(built, source)
        yield
        self._carry.blend_groups(built)
        verts = built.verts[:]
        targets = _weld_targets(result)
        yield
        faces, present = yield from _keep_faces(built, verts, source, result.triangle_source, targets)
        yield
        _turn(built, verts, faces, result)
        _weld(built, verts, present, targets, loose)
        if self._is_compact:
            self._built = built.copy()
            built.free()
        self.layout = _compare(_scratch_arrays(self._built), source, result, targets)
        yield

    def prepare_at_once(self):
        """The same without a pause."""
        for _ in self.prepare():
            pass

    def write(self, mesh):
        """Writes the result into `mesh`, which has the same content as the mesh that was prepared: it may be a copy, or that
        mesh itself, which Blender makes anew when it undoes a step."""
        self._built.to_mesh(mesh)
        self._carry.write(mesh, self.layout)
        stored = column(mesh.vertices, "co", 3)[self.layout.result_vertices]
        if not np.array_equal(stored.view(np.uint32), self._result.vertices.view(np.uint32)):
            raise RuntimeError("the mesh that was written is not the one that was proved")


class Layout:
    """Tells where vertices and corners of the native result are in the written mesh.

    vertices: (n,) the new index of each input vertex; a merged vertex has the index of the one that it was merged into
    result_vertices: (k,) the new index of each result vertex
    triangles: (f,) the result triangle of each written face
    corners: (f, 3) the corner of that result triangle at each corner of the written face
    """

    def __init__(self, vertices, result_vertices, triangles, corners):
        self.vertices = vertices
        self.result_vertices = result_vertices
        self.triangles = triangles
        self.corners = corners


def _loose(mesh, built):
    """Returns the edges of `built`, which was made of `mesh`, that no face uses."""
    indices = np.flatnonzero(~edges_of_faces(mesh))
    if not len(indices):
        return set()
    built.edges.ensure_lookup_table()
    return {built.edges[i] for i in indices.tolist()}


def _triangulate(built, source):
    """Cuts every polygon along the diagonals of its loop_triangles."""
    faces = built.faces[:]
    sizes = np.bincount(source.polygons, minlength=len(faces)) + 2
    starts = np.searchsorted(source.polygons, np.arange(len(faces)))
    quads = np.flatnonzero(sizes == 4)
    # Both triangles of a quad contain the two corners of its diagonal, and the corner with the lowest index is the quad's
    # first one: the diagonal goes through the first corner if both triangles contain that corner.
    one, two = source.corners[starts[quads]], source.corners[starts[quads] + 1]
    lowest = np.minimum(one.min(1), two.min(1))[:, None]
    through_first = (one == lowest).any(1) & (two == lowest).any(1)
    # EAR_CLIP uses the code that makes the loop_triangles of an n-gon. _keep_faces() refuses a triangulation that differs.
    for chosen, method in (
        (quads[through_first], {"quad_method": "FIXED"}),
        (quads[~through_first], {"quad_method": "ALTERNATE"}),
        (np.flatnonzero(sizes > 4), {"ngon_method": "EAR_CLIP"}),
    ):
        if len(chosen):
            bmesh.ops.triangulate(built, faces=[faces[i] for i in chosen], **method)


def _only_triangles(source):
    """Whether face i of the mesh is triangle i of the source."""
    return source.polygons[-1] + 1 == len(source.polygons)


def _keep_faces(built, verts, source, kept, targets):
    """A generator like Writing.prepare(): deletes all faces except the triangles `kept` of the source, and vertices that only
    deleted faces use.

    Returns the faces of these triangles, and (n,) bool: the vertices of the source that are there still.
    """
    if _only_triangles(source):
        rows = np.arange(len(built.faces))
    else:
        _, triangles = _scratch_arrays(built)
        rows = _matching_rows(_rotated(source.triangles)[0], _rotated(triangles)[0])
        if rows is None:
            raise MeshMismatch(
                "its n-gons would be triangulated otherwise than shown. Triangulate them first (Ctrl T in Edit Mode)"
            )
    built.faces.ensure_lookup_table()
    faces = [built.faces[i] for i in rows[kept].tolist()]
    present = _stays(targets)
    present[source.triangles[kept]] = True
    # To remove a vertex with its faces takes a fraction of the time that it takes to delete these and to merge it.
    gone = np.flatnonzero(~present).tolist()
    for begin in range(0, len(gone), _PIECE):
        for vertex in gone[begin : begin + _PIECE]:
            built.verts.remove(verts[vertex])
        yield
    stays = set(faces)
    bmesh.ops.delete(built, geom=[face for face in built.faces if face not in stays], context="FACES_ONLY")
    return faces, present


def _turn(built, verts, faces, result):
    """Replaces each face around which an edge was flipped by a new one on the remaining vertices, with the same attributes,
    and one that was divided at T-junctions by its pieces.

    verts: the vertex of each vertex of the source; faces: the face of each triangle of the result; several triangles may
    be pieces of one face.
    """
    turned = np.flatnonzero(result.turned).tolist()
    if not turned:
        return
    # A new face may have the vertices of an old one that is not replaced yet, and Blender holds only one face there. So
    # all old faces are deleted first, and copies on vertices of their own keep the attributes meanwhile.
    replaced = list(dict.fromkeys(faces[row] for row in turned))
    copies = bmesh.ops.duplicate(built, geom=replaced)["face_map"]
    copies = [copies[faces[row]] for row in turned]
    bmesh.ops.delete(built, geom=replaced, context="FACES_ONLY")
    corners = result.vertex_source[result.triangles[turned]].tolist()
    for copy, vertices in zip(copies, corners):
        face = built.faces.new([verts[vertex] for vertex in vertices], copy)
        for loop, other in zip(face.loops, copy.loops):
            loop.copy_from(other)
    bmesh.ops.delete(built, geom=list({vertex for copy in copies for vertex in copy.verts}), context="VERTS")


def _weld_targets(result):
    """Returns (n,): the input vertex that each input vertex is merged into. A vertex that stays has its own index."""
    targets = np.arange(len(result.vertex_map))
    merged = result.vertex_map >= 0
    targets[merged] = result.vertex_source[result.vertex_map[merged]]
    return targets


def _stays(targets):
    """Returns (n,) bool: the vertices that are not merged into another one."""
    return targets == np.arange(len(targets))


def _weld(built, verts, present, targets, loose):
    """Merges the vertices that are there still. verts: the vertex of each vertex of the source."""
    gone = np.flatnonzero(present & ~_stays(targets))
    bmesh.ops.weld_verts(built, targetmap={verts[i]: verts[j] for i, j in zip(gone.tolist(), targets[gone].tolist())})
    # Some edges of deleted faces have become edges of no other face. Edges that were loose before stay.
    stray = [edge for edge in built.edges if edge.is_wire and edge not in loose]
    bmesh.ops.delete(built, geom=stray, context="EDGES")


def _scratch_arrays(built):
    """Returns (vertices, triangles) as Blender would store the mesh; triangles is None if any face is not a triangle."""
    scratch = bpy.data.meshes.new(".scratch")
    try:
        built.to_mesh(scratch)
        vertices = column(scratch.vertices, "co", 3)
        if len(scratch.loops) != 3 * len(scratch.polygons):
            return vertices, None
        return vertices, column(scratch.loops, "vertex_index", 1, np.int32).reshape(-1, 3)
    finally:
        bpy.data.meshes.remove(scratch)


def _compare(written, source, result, targets):
    """Returns the Layout of the written arrays. Raises MeshMismatch if they are not the result, triangle by triangle."""
    vertices, triangles = written
    stays = _stays(targets)
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
    """Rotates the corners of each triangle so that its lowest vertex comes first. Returns (triangles, number of steps)."""
    shift = np.argmin(triangles, 1)
    return np.take_along_axis(triangles, (np.arange(3) + shift[:, None]) % 3, 1), shift


def _matching_rows(wanted, present):
    """Returns for each row of `wanted` the equal row of `present`, one to one; None if they do not all have one."""
    if wanted.shape != present.shape:
        return None
    of_wanted, of_present = np.lexsort(wanted.T), np.lexsort(present.T)
    if not np.array_equal(wanted[of_wanted], present[of_present]):
        return None
    rows = np.empty(len(wanted), np.int64)
    rows[of_wanted] = of_present
    return rows
