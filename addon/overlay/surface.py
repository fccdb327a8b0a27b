# SPDX-License-Identifier: GPL-3.0-or-later
"""The mesh of an object as the 3D view shows it now, and its place on the GPU."""

import gpu
import numpy as np

from .. import mesh_io


class Surface:
    """An object's triangles; written to the GPU anew only after they changed."""

    def __init__(self):
        self.vertices = None  # (n, 3) float32, local
        self.triangles = None  # (m, 3) int32
        self.changes = 0  # how often it was read
        self._polygons = 0
        self._mode = None
        self._indices = None
        self._batch = None
        self._stale = True  # positions may have changed
        self._recut = True  # and the triangles as well

    def touch(self, recut):
        """Says that the mesh may have changed; recut: not only where its vertices are."""
        self._stale = True
        self._recut |= recut

    def update(self, ob, depsgraph):
        """Reads the mesh if it may have changed. In a draw handler."""
        if ob.mode != self._mode:
            self.touch(True)
            self._mode = ob.mode
        if not self._stale:
            return
        # Sculpting changes the stored mesh alone; elsewhere the evaluated one is what the view shows.
        evaluated = ob.evaluated_get(depsgraph)
        if ob.mode == "SCULPT":
            self._read(ob.data, sculpted_vertices(ob), True)
        elif ob.mode == "EDIT":
            self._read(evaluated.to_mesh(), None, True)
            evaluated.to_mesh_clear()
        else:
            self._read(evaluated.data, None, False)
        self._stale = False

    def _read(self, mesh, vertices, hides):
        vertices = mesh.vertices if vertices is None else vertices
        co = mesh_io.column(vertices, "co", 3)
        same = self.vertices is not None and len(co) == len(self.vertices) and len(mesh.polygons) == self._polygons
        if same and not self._recut and np.array_equal(co, self.vertices):
            return
        if self._recut or not same:
            mesh.calc_loop_triangles()
            self.triangles = mesh_io.column(mesh.loop_triangles, "vertices", 3, np.int32)
            if hides:
                hidden = mesh_io.column(mesh.polygons, "hide", 1, bool)
                if hidden.any():
                    owners = mesh_io.column(mesh.loop_triangles, "polygon_index", 1, np.int32)
                    self.triangles = self.triangles[~hidden[owners]]
            self._polygons = len(mesh.polygons)
            self._indices = None
            self._recut = False
        self.vertices = co
        self.changes += 1
        self._batch = None

    def draw(self, shader):
        if len(self.triangles) == 0:
            return
        if self._indices is None:
            self._indices = gpu.types.GPUIndexBuf(type="TRIS", seq=np.ascontiguousarray(self.triangles, np.uint32))
        if self._batch is None:
            layout = gpu.types.GPUVertFormat()
            layout.attr_add(id="position", comp_type="F32", len=3, fetch_mode="FLOAT")
            buffer = gpu.types.GPUVertBuf(layout, len(self.vertices))
            buffer.attr_fill("position", self.vertices)
            self._batch = gpu.types.GPUBatch(type="TRIS", buf=buffer, elem=self._indices)
        self._batch.draw(shader)


def sculpted_vertices(ob):
    """What sculpting moves: the active shape key, or the mesh itself."""
    return ob.active_shape_key.data if ob.active_shape_key else ob.data.vertices
