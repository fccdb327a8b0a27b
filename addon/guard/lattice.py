# SPDX-License-Identifier: GPL-3.0-or-later
"""Guard Lattice: the control points of a lattice stop where the mesh that its modifier deforms would leave the tolerance.

The mesh is checked as the viewport shows it, with all modifiers: both ways if the object keeps both ways, and for crossings
if they are kept out. If only lattices deform the mesh, its vertices move in a straight line while the control points do:
along that line the guard looks for the farthest permitted position. It moves the control points there, and checks the mesh
that results once more.
"""

import time
from dataclasses import replace

import bpy
import numpy as np

from .. import native
from ..mesh import mesh_io
from ..shared import volumes
from ..shared.errors import Refused
from ..shared.proof import solidity
from . import watch

watches = watch.Watches()
_corrections = watch.Corrections()  # fingerprint of the control points of all lattices -> their corrected positions

# Number of bisection steps: the farthest permitted share of the way is found to 1/256.
_HALVINGS = 8
# After so many corrections in a row the control points go all the way back.
_MOST_TRIES = 3


def wanted(ob):
    return ob.mode == "OBJECT" and ob.tolvol.guard.lattice


def blocked(ob):
    """Why no lattice of `ob` can be guarded, or None."""
    if reason := watch.blocked(ob) or watch.without_faces(ob):
        return reason
    return None if cages_of(ob) else f"{ob.name} has no Lattice modifier with a lattice"


def cages_of(ob):
    """Returns the lattice objects that deform `ob` in the viewport."""
    return [m.object for m in ob.modifiers if m.type == "LATTICE" and m.object and m.show_viewport]


# What may stop a lattice.
_AT_TOLERANCE, _AT_CROSSINGS = "at the tolerance", "where faces would cross"


class LatticeWatch(watch.Preparing):
    """Keeps the last control points for which the deformed mesh was inside, and that mesh."""

    def __init__(self, ob):
        super().__init__()
        self._tries = 0
        self._stopped = False
        self._built = None
        self._positions = self._points = self._proposed = None
        self._first_pairs = None  # the pairs of polygons that cross in the first mesh that is kept
        self._limit = _AT_TOLERANCE  # what stopped the lattice last
        try:
            reference, tolerance, matrix, threads = watch.needed(ob)
        except (Refused, native.module.TolvolError) as error:
            self.reason = str(error)
            return
        self._reference, self._tolerance = reference, tolerance
        self._options = {"to_world": matrix, "threads": threads, "progress": None}
        self.two_sided = ob.tolvol.keep == "BOTH"
        self._keeps_crossings_out = ob.tolvol.guard.crossings
        self.begin(lambda progress: volumes.native_volume(reference, tolerance, threads, progress))

    def prepared(self, outcome):
        self._built = outcome

    @property
    def ready(self):
        return self._built is not None

    def judge(self, arrays, points):
        """Returns where the control points have to go, or None if they may stay.

        A mesh that is inside is kept together with its points. If the mesh is outside, the points have to go back towards
        the last ones that were kept. They stay if the guard is off, or if a change of something else took the mesh out.
        """
        positions = arrays.vertices
        if not (broken := self._broken(positions, arrays)):
            self._positions, self._points = positions, points
            self.on, self.reason = True, None
            self._stopped = _equal(points, self._proposed)
            return None
        if not self.on or _equal(points, self._points):
            self.on, self.reason = False, broken[1]
            return None
        self._limit = broken[0]
        self.stopped()
        # A proposed position whose mesh is outside leads to a nearer proposal, but only _MOST_TRIES times.
        self._tries = self._tries + 1 if _equal(points, self._proposed) else 0
        share = 0.0 if self._tries > _MOST_TRIES else self._share(positions, arrays)
        self._proposed = [last + np.float32(share) * (now - last) for now, last in zip(points, self._points)]
        return self._proposed

    def stopped(self):
        self.rest_at = time.monotonic() + watch.REST
        self._stopped = True

    def said(self):
        """Returns the message about the last correction or about what the guard does not keep, or None."""
        if self._stopped:
            return f"The lattice was stopped {self._limit}"
        if self.uncovered is not None and self.uncovered.any():
            return f"{np.count_nonzero(self.uncovered):,} faces of the reference are beyond the tolerance"
        return None

    def _broken(self, positions, arrays):
        """Returns (what stops the lattice, what is wrong with a mesh that has these positions), or None if the guard keeps it.

        Faces of the reference may be beyond the tolerance, and faces cross, as far as they do for the first mesh that is kept.
        """
        try:
            verdicts = self._built.check(positions, arrays.triangles, **self._options).verdicts
            outside = verdicts < native.module.Verdict.INSIDE
            if outside.any():
                return (
                    _AT_TOLERANCE,
                    f"{len(np.unique(arrays.polygons[outside])):,} faces of the deformed mesh are outside",
                )
            if self.two_sided:
                uncovered = watch.uncovered_faces(
                    self._reference, positions, arrays.triangles, self._tolerance, self._options
                )
                if self.uncovered is None:
                    self.uncovered = uncovered
                if lost := np.count_nonzero(uncovered & ~self.uncovered):
                    return _AT_TOLERANCE, watch.lost_reason(lost)
            if self._keeps_crossings_out:
                found = solidity.crossing_pairs(replace(arrays, vertices=positions), self._options["threads"])
                if reason := solidity.too_many(len(found)):
                    return _AT_CROSSINGS, reason
                pairs = set(map(tuple, solidity.polygon_pairs(found, arrays.polygons).tolist()))
                if self._first_pairs is None:
                    self._first_pairs = pairs
                if new := len(pairs - self._first_pairs):
                    return _AT_CROSSINGS, f"{new:,} pairs of faces would cross that did not cross when the guard began"
        except native.module.TolvolError as error:  # for example, the mesh has become smaller than the tolerance
            return _AT_TOLERANCE, str(error)
        return None

    def _share(self, positions, arrays):
        inside, outside = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = (inside + outside) / 2
            tried = self._positions + np.float32(middle) * (positions - self._positions)
            if broken := self._broken(tried, arrays):
                outside, self._limit = middle, broken[0]
            else:
                inside = middle
        return inside


def follow(ob, restored, depsgraph):
    """Called after every change of `ob`. restored: "undo" or "redo" if one of these made the change, else None."""
    cages = cages_of(ob)
    points = [mesh_io.column(cage.data.points, "co_deform", 3) for cage in cages]
    wish = watch.fingerprint(*points)
    known = _corrections.get(wish) if restored else None
    current = watches.shown(ob)
    if known and current:
        _write(cages, known)
        current.stopped()
        return
    evaluated = ob.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        arrays = mesh_io.read_mesh(mesh)
    finally:
        evaluated.to_mesh_clear()
    made_for = len(arrays.vertices), [(cage.name, len(places)) for cage, places in zip(cages, points)]
    current = watches.of(ob, made_for, lambda _before: LatticeWatch(ob))
    if not current.settled() or not current.ready:
        return
    corrected = current.judge(arrays, points)
    if corrected is not None:
        _corrections[wish] = corrected
        _write(cages, corrected)


def _write(cages, points):
    for cage, places in zip(cages, points):
        cage.data.points.foreach_set("co_deform", places.ravel())
        cage.data.update_tag()


def rest(ob):
    """Checks the mesh after a correction: Blender evaluates the written control points without calling a handler."""
    follow(ob, None, bpy.context.evaluated_depsgraph_get())


def _equal(points, others):
    return others is not None and all(np.array_equal(now, then) for now, then in zip(points, others))
