# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices of an object that move while its faces stay: pulled back to the tolerance, certified, written in one go."""

from dataclasses import replace

import bmesh
import numpy as np

from .. import native
from ..errors import NotProved
from ..mesh import mesh_io
from ..proof import report
from ..proof.certify import certify
from ..reference import measurements, snapshots, tolerances, volumes


class Motion:
    """Read and written in the main thread; volume(), hold() and certify() are for the job's."""

    def __init__(self, ob, threads):
        ob.update_from_editmode()
        self.surface = snapshots.surface_of(ob)
        self.reference = snapshots.reference_of(ob)
        self.size = self.reference.size()
        self.tolerance = tolerances.tolerance_length(ob.tolvol, self.size)
        self.faces = mesh_io.whole_quads(ob.data, self.surface.arrays)
        self.threads = threads
        self._mesh = ob.data

    @property
    def before(self):
        """(n, 3) float32, local."""
        return self.surface.arrays.vertices

    def volume(self, progress):
        return volumes.native_volume(self.reference, self.tolerance, self.threads, progress)

    def hold(self, wished, progress):
        """(n, 3): every vertex as far on its way to `wished` as the tolerance permits, quads in every triangulation."""
        triangles = self.surface.arrays.triangles
        held = self._constrain(wished, triangles, "error", progress)
        # A quad may be bent so much that across its other diagonal it is outside from the start: it stays.
        return held if self.faces is triangles else self._constrain(held, self.faces, "keep", progress)

    def _constrain(self, wished, faces, outside, progress):
        return native.module.constrain(
            self.before,
            wished,
            faces,
            self.volume(progress),
            to_world=self.surface.matrix,
            outside=outside,
            threads=self.threads,
            progress=progress,
        ).vertices

    def certify(self, vertices, progress, triangles=None):
        """What certify() says of the moved mesh, which is within the tolerance or NotProved is raised."""
        arrays = replace(self.surface.arrays, vertices=vertices)
        if triangles is not None:
            arrays = replace(arrays, triangles=triangles)
        moved = snapshots.Surface(arrays, self.surface.matrix)
        certified = certify(moved, self.reference, self.tolerance, 0, self.threads, progress)
        lower, upper = certified["forward"]
        if upper > self.tolerance:
            ends = f"between {report.percent(lower, self.size)} and {report.percent(upper, self.size)}"
            raise NotProved(f"the result is {ends} of the size from the reference")
        return certified

    def settle(self, vertices, certified):
        """`certified`, or that of the triangles into which Blender cuts the faces where they are now."""
        triangles = mesh_io.triangles_at(self._mesh, vertices)
        if np.array_equal(triangles, self.surface.arrays.triangles):
            return certified
        return self.certify(vertices, native.module.Progress(), triangles)

    def write(self, ob, vertices, certified):
        """Moves the vertices of `ob`, which has the mesh that was read or a copy of it."""
        if ob.mode == "EDIT":
            self._write_edited(ob, vertices)
        else:
            mesh_io.move_vertices(ob.data, self.before, vertices)
        self.keep_reference(ob)
        measurements.remember(ob, snapshots.surface_of(ob), certified, self.tolerance)

    def _write_edited(self, ob, vertices):
        """The mesh is the one that Edit Mode works on; Blender moves other shape keys along when it is left."""
        moved = np.flatnonzero((vertices != self.before).any(1))
        mesh_io.move_edited(ob.data, moved, vertices[moved]).normal_update()
        bmesh.update_edit_mesh(ob.data, destructive=False)
        ob.update_from_editmode()

    def keep_reference(self, ob):
        """A mesh that had no reference was its own."""
        if ob.tolvol.snapshot is None:
            snapshots.set_reference(ob, self.reference)

    def line(self, remarks, certified):
        """What was done, in one line."""
        forward, backward = (report.percent(certified[way][1], self.size) for way in ("forward", "backward"))
        return (
            f"{', '.join(remarks)}, tolerance {100 * self.tolerance / self.size:.4g} % = {self.tolerance:.3g}, "
            f"result within {forward} (certified), reference within {backward}"
        )

    def moved(self, vertices, wished):
        """Remarks of line(): how many vertices moved, and how many not as far as was wished."""
        count = int((vertices != self.before).any(1).sum())
        held = int((vertices != wished).any(1).sum())
        return [f"{count:,} of {len(vertices):,} vertices moved", *([f"{held:,} held back"] if held else [])]
