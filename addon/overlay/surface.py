# SPDX-License-Identifier: GPL-3.0-or-later
"""Holds the triangles that the overlay colours, and their buffers on the GPU."""

import gpu
import numpy as np

from ..mesh import mesh_io
from ..shared.surface import to_world


class Triangles:
    """Triangles and their places in the frame of a tree. They are written to the GPU anew only after they changed."""

    def __init__(self, vertices=None, triangles=None):
        self.vertices = vertices  # (n, 3) float32, local
        self.triangles = triangles  # (m, 3) int32
        self.changes = 0  # how often changed triangles were read
        self._buffers = {}
        self._to_frame = None  # the matrix with which the buffer of the vertices was made

    def draw(self, shader, to_frame):
        """Draws the triangles. to_frame: (4, 4) float64 from the vertices to the frame of the tree."""
        if len(self.triangles):
            self._batch(to_frame, "TRIS", lambda: self.triangles).draw(shader)

    def _batch(self, to_frame, kind, corners, *which):
        if "vertices" not in self._buffers or not np.array_equal(to_frame, self._to_frame):
            layout = gpu.types.GPUVertFormat()
            for name in ("position", "framed"):
                layout.attr_add(id=name, comp_type="F32", len=3, fetch_mode="FLOAT")
            vertices = gpu.types.GPUVertBuf(layout, len(self.vertices))
            vertices.attr_fill("position", self.vertices)
            vertices.attr_fill("framed", framed(self.vertices, to_frame))
            self._buffers["vertices"], self._to_frame = vertices, to_frame
        key = kind, *which
        if key not in self._buffers:
            self._buffers[key] = gpu.types.GPUIndexBuf(type=kind, seq=np.ascontiguousarray(corners(), np.uint32))
        return gpu.types.GPUBatch(type=kind, buf=self._buffers["vertices"], elem=self._buffers[key])


def framed(vertices, to_frame):
    """Returns the places of vertices in the frame of a tree, (n, 3) float32.

    They are computed in double precision. A shader has float32 alone, in which the product for vertices far from their origin
    would lose all digits that count.
    """
    return to_world(vertices, to_frame).astype(np.float32)


class Surface(Triangles):
    """The triangles of an object as the 3D view shows it now."""

    def __init__(self):
        super().__init__()
        self.all_triangles = None  # (k, 3) int32, with those that are hidden in Edit and Sculpt Mode
        self._polygons = 0
        self._mode = None
        self._edges = None  # (k, 2) int32, in Edit Mode
        self._selected = None  # (k,) bool: whether the edge is selected, in Edit Mode
        self._stale = True  # The positions may have changed.
        self._recut = True  # The triangles may have changed.

    def touch(self, recut):
        """Marks the mesh as possibly changed. recut: whether its triangles may have changed too, not only positions."""
        self._stale = True
        self._recut |= recut

    def update(self, ob, depsgraph):
        """Reads the mesh if it may have changed. It may be called only in a draw handler."""
        if ob.mode != self._mode:
            self.touch(True)
            self._mode = ob.mode
        if not self._stale:
            return
        # Sculpting changes only the stored mesh. In the other modes the view shows the evaluated mesh.
        evaluated = ob.evaluated_get(depsgraph)
        if ob.mode == "SCULPT":
            self._read(ob.data, sculpted_vertices(ob), True)
        elif ob.mode == "EDIT":
            mesh = evaluated.to_mesh()
            self._read(mesh, None, True)
            self._read_edges(mesh)
            evaluated.to_mesh_clear()
        else:
            self._read(evaluated.data, None, False)
        self._stale = False

    def _read(self, mesh, vertices, hides):
        co = mesh_io.column(vertices or mesh.vertices, "co", 3)
        recut = self._recut or len(co) != len(self.vertices) or len(mesh.polygons) != self._polygons
        if not recut and np.array_equal(co, self.vertices):
            return
        if recut:
            found = mesh_io.loop_triangles(mesh)
            triangles = all_triangles = mesh_io.column(found, "vertices", 3, np.int32)
            if hides:
                hidden = mesh_io.column(mesh.polygons, "hide", 1, bool)
                triangles = triangles[~hidden[mesh_io.column(found, "polygon_index", 1, np.int32)]]
            self._polygons = len(mesh.polygons)
            self._recut = False
            # Blender also reports a change where the mesh stays the same, for example when a label is added.
            now = co, triangles, all_triangles
            if all(map(np.array_equal, now, (self.vertices, self.triangles, self.all_triangles))):
                return
            self.triangles, self.all_triangles = triangles, all_triangles
            self._buffers.clear()
        self.vertices = co
        self.changes += 1
        self._buffers.pop("vertices", None)

    def _read_edges(self, mesh):
        shown = ~mesh_io.column(mesh.edges, "hide", 1, bool)
        self._edges = mesh_io.column(mesh.edges, "vertices", 2, np.int32)[shown]
        self._selected = mesh_io.column(mesh.edges, "select", 1, bool)[shown]
        for selected in (False, True):
            self._buffers.pop(("LINES", selected), None)

    def draw_edges(self, shader, to_frame, selected):
        """Draws the selected edges or the edges that are not selected, in Edit Mode."""
        chosen = self._selected == selected
        if chosen.any():
            self._batch(to_frame, "LINES", lambda: self._edges[chosen], selected).draw(shader)


def sculpted_vertices(ob):
    """Returns the collection that sculpting changes: the points of the active shape key or the vertices of the mesh."""
    return ob.active_shape_key.data if ob.active_shape_key else ob.data.vertices
