# SPDX-License-Identifier: GPL-3.0-or-later
"""Watches one mesh that Blender's tools edit: keeps it within the tolerance and remembers how much was held back."""

import hashlib
import time
from collections import OrderedDict
from dataclasses import dataclass, replace
from functools import cached_property

import bpy
import numpy as np

from .. import native, preferences
from ..background import Job
from ..mesh import mesh_io
from ..reference import snapshots, tolerances
from ..shared import volumes
from ..shared.errors import Refused
from ..shared.proof import solidity
from ..shared.surface import MeshArrays, areas

# Blender waits so many seconds for a guard to be prepared. If preparing takes longer, it goes on in a thread.
_PATIENCE = 0.4
# An edit after which Blender cuts polygons otherwise, so that they would not be kept within the tolerance, goes on without
# the corners of these polygons at most so many times. Then nothing moves.
_MOST_TRIES = 16
# After so many seconds without an edit the next edit counts as another stroke.
_STROKE_GAP = 0.5
# So many pairs of triangles that cross are found at most, those of the triangulations of one quad included.
_MOST_PAIRS = 20_000_000
# A stroke counts as over so many seconds after vertices were last held back in it.
REST = 0.3

_NONE = np.empty(0, np.int32)


def blocked(ob):
    """Why the mesh of `ob` cannot be guarded now, in any mode, or None. It is quick enough to be called while drawing."""
    if native.module is None:
        return native.reason
    if reason := snapshots.reference_missing(ob):
        return reason
    return None


def without_faces(ob):
    """Why a mesh that has no faces cannot be guarded, or None."""
    return None if ob.data.polygons else f"{ob.name} has no faces"


def situation(ob):
    """Returns a value that identifies mesh, matrix, tolerance, directions, crossings and reference. When it changes, a
    new watch is needed."""
    settings, key = ob.tolvol, ob.active_shape_key
    return (
        ob.as_pointer(),
        ob.data.as_pointer(),
        key.name if key else None,
        mesh_io.matrix_array(ob.matrix_world).tobytes(),
        tolerances.tolerance_length(settings, settings.snapshot_size),
        settings.keep,
        settings.guard.crossings,
        (settings.snapshot.as_pointer(), settings.snapshot_fingerprint),
    )


def points_of(ob):
    """Returns the collection with the coordinates that are edited: those of the active shape key or of the mesh."""
    return ob.active_shape_key.data if ob.active_shape_key else ob.data.vertices


@dataclass(frozen=True)
class Faces:
    """The polygons of a mesh as a guard keeps them: as the triangles that Blender shows, and quads in their other
    triangulation as well."""

    all: mesh_io.Polygons
    larger: np.ndarray  # (p,) the polygons with more than three corners
    larger_corners: mesh_io.Polygons  # of these
    shown: np.ndarray  # (k, 3) int32: the triangles that Blender shows, those of one polygon after those of another
    shown_polygons: np.ndarray  # (k,) the polygon of each triangle

    @classmethod
    def at(cls, mesh, positions):
        """Takes the polygons of a mesh as they would be shown if the vertices were at these positions."""
        polygons = mesh_io.Polygons.of(mesh)
        larger = np.flatnonzero(polygons.sizes > 3)
        shown = polygons.triangles_at(positions)
        return cls(polygons, larger, polygons.chosen(larger), shown, polygons.of_triangles())

    @cached_property
    def guarded(self):
        """The faces for a guard, (m, 3) or (m, 4) int32, and the polygon of each, (m,)."""
        return self.all.whole_quads(self.shown)

    def moved(self, before, after):
        """Returns these faces as Blender shows them after a motion: this object itself if it cuts no polygon otherwise."""
        moves = (before != after).any(1)
        chosen = np.zeros(len(self.larger), bool)
        chosen[self.larger_corners.of_corners()[moves[self.larger_corners.corners]]] = True
        if not chosen.any():
            return self
        triangles = np.flatnonzero(np.isin(self.shown_polygons, self.larger[chosen]))
        shown = self.shown.copy()
        shown[triangles] = self.larger_corners.chosen(np.flatnonzero(chosen)).triangles_at(after)
        return self if np.array_equal(shown, self.shown) else replace(self, shown=shown)

    def crossing_count(self, positions, threads, progress):
        """Returns how many pairs of polygons cross in any of these triangulations."""
        faces, polygons = self.guarded
        triangles, of_face = mesh_io.cut_both_ways(faces)
        found = solidity.crossing_pairs(MeshArrays(positions, triangles, None, None), threads, progress, _MOST_PAIRS)
        return len(solidity.polygon_pairs(found, polygons[of_face]))

    def flat_count(self, positions):
        """The number of polygons without an area, as those are that an extrusion makes until what was extruded is moved."""
        return int((np.bincount(self.shown_polygons, areas(positions[self.shown])) == 0).sum())

    def outside(self, built, positions, options):
        """Returns how many polygons are outside in the triangulation that Blender shows. options: of a check."""
        verdict = built.check(positions, self.shown, **options).verdicts
        return len(np.unique(self.shown_polygons[verdict < native.module.Verdict.INSIDE]))


class Preparing:
    """A watch that is prepared in a thread.

    on: whether it guards the mesh.
    reason: why it does not guard the mesh; None while it is on or being prepared.
    followed: whether it takes over from a watch that was on, for the same mesh with other faces.
    """

    would = "leave the tolerance"  # what the mesh would do if an edit that is refused were kept
    two_sided = False  # whether it keeps the reference within the tolerance of the mesh, too
    # (m,) bool: the faces of the reference that may be uncovered all the same; None if that is not known.
    uncovered = None

    def __init__(self, before=None):
        """before: the watch from which this one takes over, or None."""
        self.followed = before is not None
        self.reason = None
        self.on = False
        self.rest_at = None  # the time at which the current stroke counts as over; None if nothing was held back in it
        self._job = None

    def begin(self, work):
        self._job = Job(work, native.module.Progress())
        self.settled(None if bpy.app.background else _PATIENCE)

    def settled(self, seconds=0.0):
        """Whether the preparing has ended. It is waited for up to `seconds`, without limit if that is None."""
        if self._job is not None and self._job.done(seconds):
            job, self._job = self._job, None
            try:
                self.prepared(job.outcome())
            except (Refused, native.module.TolvolError) as error:
                self.reason = str(error)
        return self._job is None

    @property
    def preparing(self):
        return self._job is not None

    def end(self):
        """Cancels a thread that is still at work."""
        if self._job is not None:
            self._job.progress.cancel()


def needed(ob):
    """Returns (reference, tolerance, to_world, threads) for a guard of `ob`. Raises Refused and TolvolError."""
    reference = snapshots.reference_of(ob)
    tolerance = tolerances.required(ob, reference.size())
    return reference, tolerance, mesh_io.matrix_array(ob.matrix_world), preferences.threads(bpy.context)


class Watch(Preparing):
    """Guards the coordinates of one mesh. Edits that are made before the watch is ready are checked when it is ready.

    A watch that takes over from another one guards the mesh only if the edit of the faces, which lies between the two, kept
    what the guard keeps: the mesh has to be inside, no face of the reference may be uncovered that was covered before, and
    where crossings are kept out, no more pairs of polygons may cross than before, in any of their triangulations.
    """

    def __init__(self, ob, positions, before=None, edits_faces=False):
        """edits_faces: whether another watch may take over from this one."""
        super().__init__(before)
        self.remark = None  # what the guard cannot keep, or why something cannot move
        self._guard = None
        self._last = positions
        self._held = np.zeros(len(positions), bool)
        self._edited_at = 0.0
        self.uncovered = before and before.uncovered
        self._faces, self._accepted = None, before and before.accepted
        if reason := without_faces(ob):
            self.reason = reason
            return
        try:
            self._faces = faces = Faces.at(ob.data, positions)
            reference, tolerance, matrix, threads = needed(ob)
        except (Refused, native.module.TolvolError) as error:
            self.reason = str(error)
            return

        self.two_sided = two_sided = ob.tolvol.keep == "BOTH"
        crossings = "keep_out" if ob.tolvol.guard.crossings else "allow"
        accepted = self._accepted

        def work(progress):
            built = volumes.native_volume(reference, tolerance, threads, progress)
            options = {"to_world": matrix, "threads": threads, "progress": progress}
            keep = {"two_sided": two_sided, "outside": "keep", "crossings": crossings}
            # The walls of an extrusion stand upright on the reference: the rule of the angle would hold them where they are.
            if accepted is not None and faces.flat_count(positions) > accepted[0].flat_count(accepted[1]):
                keep["max_normal_angle"] = 180.0
            rows, polygons = faces.guarded
            guard = native.module.Guard(positions, rows, built, **keep, **options)
            # A concave or bent quad may be inside in its present triangulation and outside in the other one. The guard keeps the
            # corners of such a quad where they are.
            kept = len(np.unique(polygons[guard.outside]))
            if kept:
                one = "1 bent or concave face stays where it is"
                remark = one if kept == 1 else f"{kept:,} bent or concave faces stay where they are"
            elif guard.uncovered:
                remark = f"{guard.uncovered:,} faces of the reference are beyond the tolerance: what is nearest stays"
            else:
                remark = next(iter(guard.warnings), None)
            uncovered = None
            if edits_faces and two_sided:
                uncovered = np.zeros(len(reference.arrays.triangles), bool)
                if guard.uncovered:
                    uncovered = uncovered_faces(reference, positions, faces.shown, tolerance, options)
            crossing = None
            if accepted is not None and crossings == "keep_out":
                crossing = [of.crossing_count(at, threads, progress) for of, at in (accepted, (faces, positions))]
            return guard, kept and faces.outside(built, positions, options), uncovered, crossing, remark

        self.begin(work)

    def prepared(self, outcome):
        guard, outside, uncovered, crossing, self.remark = outcome
        lost = 0
        if self.uncovered is None:
            self.uncovered = uncovered
        else:
            lost = int(np.count_nonzero(uncovered & ~self.uncovered))
        if outside:
            self.reason = outside_reason(outside)
        elif lost:
            self.reason = lost_reason(lost)
        elif crossing is not None and crossing[1] > crossing[0]:
            self.reason = "Crossing pairs of faces: {1:,}, before the edit {0:,}".format(*crossing)
            self.would = "have more crossing faces"
        else:
            self._guard, self.on = guard, True

    @property
    def accepted(self):
        """The faces and positions of the last state that the guard keeps, or of the one before a refused edit, or None."""
        return (self._faces, self._last) if self.on else self._accepted

    @property
    def held_back(self):
        """The number of vertices that were held back in the last stroke."""
        return int(np.count_nonzero(self._held))

    def hold(self, positions):
        """Takes the edited positions, and moves those vertices in the array that would leave the tolerance.

        Returns the indices of these vertices, (k,). The watch keeps the array.
        """
        if np.array_equal(positions.view(np.int32), self._last.view(np.int32)):
            return _NONE
        now = time.monotonic()
        if now - self._edited_at > _STROKE_GAP:
            self._held[:] = False
        self._edited_at = now
        try:
            indices = self._constrain(positions)
        except native.module.TolvolError as error:  # for example, a coordinate is not finite
            self.on, self.reason = False, str(error)
            return _NONE
        if len(indices):
            self._held[indices] = True
            self.rest_at = now + REST
        self._last = positions
        return indices

    def _constrain(self, positions):
        """Moves those vertices in the array that would leave the tolerance. Returns their indices.

        Blender may cut polygons otherwise after the motion. Then the guard has to go on with the triangles that Blender
        shows now. The corners of polygons of which it cannot take these go back to where they were.
        """
        held = np.zeros(len(positions), bool)
        for tries_left in reversed(range(_MOST_TRIES + 1)):
            indices, places = self._guard.constrain(positions)
            positions[indices], held[indices] = places, True
            shown = self._faces.moved(self._last, positions)
            if shown is self._faces:
                break
            faces, polygons = shown.guarded
            refused = self._guard.replace_faces(faces)
            if not len(refused):
                self._faces = shown
                break
            stays = shown.all.chosen(np.unique(polygons[refused])).corners if tries_left > 1 else slice(None)
            held[stays] |= (positions[stays] != self._last[stays]).any(1)
            positions[stays] = self._last[stays]
            if len(self._guard.constrain(self._last)[0]):
                self._guard.reset(self._last)
        return np.flatnonzero(held)

    def said(self):
        """Returns the message about the last stroke, or None."""
        if self._held.any():
            return "Held back 1 vertex" if self.held_back == 1 else f"Held back {self.held_back:,} vertices"
        return self.remark


def uncovered_faces(reference, positions, triangles, tolerance, options):
    """Returns (m,) bool: the faces of the reference that are not proved to be within the tolerance of a mesh. options: of a
    check, for the mesh."""
    threads, progress = options["threads"], options["progress"]
    # The mesh is another one after the next edit, so that the volume is not kept.
    volume = native.module.ToleranceVolume(positions, triangles, tolerance, **options)
    own = reference.arrays
    found = volume.check(own.vertices, own.triangles, to_world=reference.matrix, threads=threads, progress=progress)
    return found.verdicts < native.module.Verdict.INSIDE


def outside_reason(count):
    return f"{count:,} faces are outside: Select Outside in Object Mode shows them"


def lost_reason(count):
    faces = "1 face of the reference is" if count == 1 else f"{count:,} faces of the reference are"
    return f"{faces} no longer within the tolerance of the mesh"


class Watches:
    """The watches of one kind, by the names of their objects."""

    def __init__(self):
        self._of = {}  # name -> ((situation, topology) that the watch was made for, watch)

    def __iter__(self):
        return iter([(name, watch) for name, (_, watch) in self._of.items()])

    def of(self, ob, topology, make):
        """Returns the watch of `ob`. If its situation or topology has changed, make(before) makes a new watch first, which
        takes over from the watch `before` if that is not None."""
        key = situation(ob), topology
        known, watch = self._of.get(ob.name, (None, None))
        if known != key:
            followed = watch is not None and known[0] == key[0] and (watch.on or watch.followed)
            self.drop(ob.name)
            watch = make(watch if followed else None)
            self._of[ob.name] = key, watch
        return watch

    def restart(self, ob, positions, edits_faces=False):
        """Replaces the watch of `ob` by a new one for these positions if they are inside. Returns whether they are."""
        watch = Watch(ob, positions, edits_faces=edits_faces)
        watch.settled(None)
        if watch.on:
            self._of[ob.name] = self._of[ob.name][0], watch
        return watch.on

    def shown(self, ob):
        return self._of.get(ob.name, (None, None))[1]

    def drop(self, name):
        if name in self._of:
            self._of.pop(name)[1].end()


class Corrections:
    """Remembers how edits were corrected, for undo and redo.

    Blender stores the undo step of an operator before a guard can correct the outcome, so that undo and redo bring back
    the uncorrected positions. The remembered correction then leads to the same positions bit for bit.
    """

    _KEPT = 64_000_000  # bytes

    def __init__(self):
        self._of = OrderedDict()

    def __setitem__(self, wish, arrays):
        self._of[wish] = arrays
        while len(self._of) > 1 and sum(array.nbytes for kept in self._of.values() for array in kept) > self._KEPT:
            self._of.popitem(last=False)

    def get(self, wish):
        return self._of.get(wish)


def fingerprint(*arrays):
    digest = hashlib.blake2b(digest_size=16)
    for array in arrays:
        digest.update(array.tobytes())
    return digest.digest()


def topology(mesh):
    """Returns a fingerprint of the faces: equal faces have equal fingerprints."""
    return fingerprint(
        mesh_io.column(mesh.loops, "vertex_index", 1, np.int32),
        mesh_io.column(mesh.polygons, "loop_start", 1, np.int32),
    )
