# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves vertices of an object while its faces stay: stops them at the tolerance, certifies the result and writes it."""

from dataclasses import replace
from functools import partial

import bmesh
import numpy as np

from .. import native
from ..mesh import mesh_io
from ..proof import last_run
from ..reference import measurements, snapshots, tolerances
from ..shared import volumes
from ..shared.errors import NotProved, Refused
from ..shared.proof import report, solidity
from ..shared.proof.certify import certify
from ..shared.proof.verdict import Interval, Verdict
from ..shared.surface import Surface
from .mesh_and_reference import mesh_and_reference

_FOUND = {"forward": "the result is {} from the reference", "backward": "the reference is {} from the result"}

BENT = "Corners of bent quads stay where cutting these along their other diagonal would leave the tolerance"

# settle() holds a mesh back at most so many times. Each time more corners stay, so that the first time is mostly enough.
_MOST_TRIES = 8


class Motion:
    """The main thread makes it and calls settle() and write(). The thread of the job calls volume(), hold() and certify()."""

    @classmethod
    def of(cls, ob, threads):
        """A generator for an operator's steps(): reads the mesh of an object and its reference, and returns the Motion."""
        ob.update_from_editmode()
        surface, reference = yield from mesh_and_reference(ob)
        return cls(ob, surface, reference, threads)

    def __init__(self, ob, surface, reference, threads):
        self.surface, self.reference = surface, reference
        self.size = self.reference.size()
        self.tolerance = tolerances.required(ob, self.size)
        self.two_sided = ob.tolvol.keep == "BOTH"
        self.crossings = ob.tolvol.crossings.lower()
        self.faces = self.surface.arrays.triangles
        self._only_triangles = len(ob.data.polygons) == len(self.faces)
        if not self._only_triangles:
            self.faces, _ = mesh_io.Polygons.of(ob.data).whole_quads(self.faces)
        self.threads = threads
        self.warnings = []  # of hold()
        self._mesh = ob.data
        self._facts_before = None

    @property
    def before(self):
        """The positions of the vertices before the motion: (n, 3) float32, local."""
        return self.surface.arrays.vertices

    def volume(self, progress):
        return volumes.native_volume(self.reference, self.tolerance, self.threads, progress)

    def hold(self, wished, progress):
        """Moves every vertex towards `wished` as far as the tolerance and the crossings permit. Returns (n, 3), and keeps
        the warnings.

        Quads keep the tolerance in both triangulations, and crossings out of both.
        """
        triangles = self.surface.arrays.triangles
        held = self._constrain(wished, triangles, "error", progress)
        # A bent quad may be beyond the tolerance from the start in the triangulation that Blender does not show: its
        # corners stay.
        return held if self.faces is triangles else self._constrain(held, self.faces, "keep", progress)

    def _constrain(self, wished, faces, outside, progress):
        held = native.module.constrain(
            self.before,
            wished,
            faces,
            self.volume(progress),
            to_world=self.surface.matrix,
            two_sided=self.two_sided,
            outside=outside,
            crossings=self.crossings,
            threads=self.threads,
            progress=progress,
        )
        warnings = held.report["warnings"]
        if outside == "keep" and held.report["outside"]["reference_faces"]:
            # The triangles that Blender shows are within the tolerance, or the first pass would have refused the mesh. The
            # other warnings are those of the first pass.
            warnings = [BENT]
        self.warnings += [text for text in warnings if text not in self.warnings]
        return held.vertices

    def certify(self, vertices, triangles, progress):
        """Returns the result of certify() for the moved mesh, and "solidity", the result of solidity.compared().

        Raises NotProved unless the mesh is within the tolerance and, where crossings are kept out, no polygons cross that did
        not cross before. Raises Refused where too many cross to tell.
        """
        moved = Surface(replace(self.surface.arrays, vertices=vertices, triangles=triangles), self.surface.matrix)
        certified = certify(moved, self.reference, self.tolerance, 0, self.threads, progress)
        for way, said in _FOUND.items() if self.two_sided else [("forward", _FOUND["forward"])]:
            found = Interval(*certified[way])
            if not found.within(self.tolerance):
                ends = (report.percent(end, self.size) for end in (found.lower, found.upper))
                raise NotProved(said.format("between {} and {} of the size".format(*ends)))
        facts = solidity.facts(moved, self.threads, progress)
        if self._facts_before is None:
            self._facts_before = solidity.facts(self.surface, self.threads, progress)
        if self.crossings == "keep_out" and not facts["uncrossed"]:
            before = self._crossing(self.surface, progress)
            if new := self._crossing(moved, progress) - before:
                raise NotProved(f"{len(new):,} pairs of faces would cross that do not cross now")
        return certified | {"solidity": solidity.compared(self._facts_before, facts)}

    def _crossing(self, surface, progress):
        """Returns the pairs of polygons of which triangles cross as a set. Raises Refused for solidity.MOST_PAIRS or more."""
        found = solidity.crossing_pairs(surface.arrays, self.threads, progress)
        if reason := solidity.too_many(len(found)):
            raise Refused(reason)
        polygons = surface.arrays.polygons[found]
        return set(map(tuple, np.sort(polygons, axis=1).tolist()))

    def settle(self, vertices, may_hold=True):
        """A generator for an operator's steps(): returns the vertices and the result of certify() for the triangles that Blender
        shows after the motion.

        Blender may cut a bent polygon otherwise after the motion. If certify() refuses the mesh then, the corners of these
        polygons stay where they were, and hold() moves the other vertices. Raises NotProved if that does not help, or at
        once unless `may_hold`.
        """
        for tries_left in reversed(range(_MOST_TRIES)):
            arrays = self.surface.arrays
            triangles = arrays.triangles if self._only_triangles else mesh_io.triangles_at(self._mesh, vertices)
            try:
                return vertices, (yield partial(self.certify, vertices, triangles))
            except NotProved as error:
                if not may_hold or not tries_left:
                    raise
                refusal = error
            wished = vertices.copy()
            cut_otherwise = arrays.polygons[(triangles != arrays.triangles).any(1)]
            stays = triangles[np.isin(arrays.polygons, cut_otherwise)]
            wished[stays] = self.before[stays]
            held = yield partial(self.hold, wished)
            if np.array_equal(held, vertices):
                raise refusal
            vertices = held

    def write(self, ob, vertices, certified, operation):
        """Moves the vertices of `ob`, whose mesh is the one that was read or a copy of that mesh.

        operation: its name, for the run that the object keeps.
        """
        self.keep_reference(ob)
        if ob.mode == "EDIT":
            self._write_edited(ob, vertices)
        else:
            mesh_io.move_vertices(ob.data, self.before, vertices)
        measurements.remember(ob, snapshots.surface_of(ob), certified, self.tolerance)
        last_run.keep(ob, {"operation": operation, "solidity": certified["solidity"]})

    def _write_edited(self, ob, vertices):
        """Moves vertices of the mesh that is in Edit Mode. Blender moves the other shape keys when Edit Mode is left."""
        moved = np.flatnonzero((vertices != self.before).any(1))
        mesh_io.move_edited(ob.data, moved, vertices[moved]).normal_update()
        bmesh.update_edit_mesh(ob.data, destructive=False)
        ob.update_from_editmode()

    def keep_reference(self, ob):
        """Stores the reference that was used if the object had none. It has to be called before the mesh is changed."""
        if ob.tolvol.snapshot is None:
            snapshots.set_reference(ob, self.reference)

    def verdict(self, certified):
        """Returns the Verdict of the result of certify()."""
        return Verdict.certified(certified, self.tolerance, self.two_sided)

    def line(self, remarks, certified):
        """Returns the outcome as one line of text."""
        forward, backward = (report.percent(certified[way][1], self.size) for way in ("forward", "backward"))
        return (
            f"{self.verdict(certified).word}: {', '.join(remarks)}, "
            f"tolerance {100 * self.tolerance / self.size:.4g} % = {self.tolerance:.3g}, "
            f"result within {forward}, reference within {backward} (proved)"
        )

    def count_moved(self, vertices):
        return int((vertices != self.before).any(1).sum())

    def moved(self, vertices, wished):
        """Returns remarks for line(): how many vertices moved, and how many of them were held back."""
        count = self.count_moved(vertices)
        held = int((vertices != wished).any(1).sum())
        return [f"{count:,} of {len(vertices):,} vertices moved", *([f"{held:,} held back"] if held else [])]
