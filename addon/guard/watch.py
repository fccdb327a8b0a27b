# SPDX-License-Identifier: GPL-3.0-or-later
"""One mesh that other hands edit, kept within the tolerance: from which state on, and what was held back."""

import hashlib
import itertools
import time
from collections import OrderedDict
from dataclasses import dataclass

import bpy
import numpy as np

from .. import native, preferences
from ..errors import Refused
from ..job import Job
from ..mesh import mesh_io
from ..proof.certify import INSIDE
from ..reference import snapshots, tolerances, volumes

# What is ready sooner than this is waited for; Blender goes on meanwhile where it is not.
_PATIENCE = 0.4
# Of a face with so many corners all triangles between any three of them are kept inside: 41,664.
_MOST_CORNERS = 64
# Seconds without an edit after which the next one is another stroke.
_STROKE_GAP = 0.5
# Seconds after something was held back in which the stroke counts as going on.
REST = 0.3

_NONE = np.empty(0, np.int32)


def blocked(ob):
    """Why the mesh of `ob` cannot be guarded now, whatever the mode, or None. Cheap enough to draw."""
    if native.module is None:
        return native.reason
    if reason := snapshots.reference_missing(ob):
        return reason
    if not ob.data.polygons:
        return f"{ob.name} has no faces"
    return None


def situation(ob):
    """What a watch is made for; another value calls for another watch. Cheap."""
    settings, key = ob.tolvol, ob.active_shape_key
    return (
        ob.as_pointer(),
        ob.data.as_pointer(),
        key.name if key else None,
        mesh_io.matrix_array(ob.matrix_world).tobytes(),
        tolerances.tolerance_length(settings, settings.snapshot_size),
        (settings.snapshot.as_pointer(), settings.snapshot_fingerprint),
    )


def points_of(ob):
    """The collection that holds the coordinates being edited: the active shape key's or the mesh's own."""
    return ob.active_shape_key.data if ob.active_shape_key else ob.data.vertices


@dataclass(frozen=True)
class Faces:
    """What has to stay inside, in every triangulation, and what Blender shows of it."""

    faces: np.ndarray  # (m, 3) or (m, 4) int32
    polygons: np.ndarray  # (m,) the polygon of each
    shown: np.ndarray  # (k, 3) int32 triangles
    shown_polygons: np.ndarray  # (k,)

    @classmethod
    def of(cls, mesh):
        """Quads whole; of faces with more corners every triangle between three of them, however Blender may cut them."""
        arrays = mesh_io.read_mesh(mesh)
        starts = mesh_io.column(mesh.polygons, "loop_start", 1, np.int32)
        sizes = mesh_io.column(mesh.polygons, "loop_total", 1, np.int32)
        corners = mesh_io.column(mesh.loops, "vertex_index", 1, np.int32)
        if sizes.max() > _MOST_CORNERS:
            raise Refused(f"A face has {sizes.max()} corners: Face > Triangulate Faces in Edit Mode first")
        faces, polygons = [], []
        for size in np.unique(sizes):
            found = np.flatnonzero(sizes == size)
            pieces = [(0, 1, 2, 3)] if size == 4 else list(itertools.combinations(range(size), 3))
            pieces = np.array([(*piece, piece[-1])[:4] for piece in pieces])
            faces.append(corners[starts[found][:, None, None] + pieces].reshape(-1, 4))
            polygons.append(np.repeat(found, len(pieces)))
        faces = np.concatenate(faces)
        if sizes.max() == 3:
            faces = np.ascontiguousarray(faces[:, :3])
        return cls(faces, np.concatenate(polygons), arrays.triangles, arrays.polygons)

    def outside(self, built, positions, options):
        """How many polygons are outside as Blender shows them; options: of a check."""
        verdict = built.check(positions, self.shown, **options).verdict
        return len(np.unique(self.shown_polygons[verdict < INSIDE]))


class Preparing:
    """What begins in a thread. `on` once it guards; else `reason` says why not, None while it is being prepared.
    `followed`: it takes over from one that was on, for the same mesh with other faces."""

    def __init__(self, followed=False):
        self.followed = followed
        self.reason = None
        self.on = False
        self.rest_at = None  # when the stroke that something was held back in counts as over, if there is one
        self._job = None

    def begin(self, work):
        self._job = Job(work, native.module.Progress())
        self.settled(None if bpy.app.background else _PATIENCE)

    def settled(self, seconds=0.0):
        """Whether it is known by now if this mesh is guarded; None waits for it."""
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
        """Lets go of a thread that is still at work."""
        if self._job is not None:
            self._job.progress.cancel()


def needed(ob):
    """(reference, tolerance, to_world, threads) for a guard of `ob`. Raises Refused and TolvolError."""
    reference = snapshots.reference_of(ob)
    tolerance = tolerances.tolerance_length(ob.tolvol, reference.size())
    return reference, tolerance, mesh_io.matrix_array(ob.matrix_world), preferences.threads(bpy.context)


class Watch(Preparing):
    """Keeps the coordinates of one mesh. Edits made before it is ready are judged when it is."""

    def __init__(self, ob, positions, followed=False):
        super().__init__(followed)
        self.kept_polygons = 0
        self._guard = None
        self._last = positions
        self._held = np.zeros(len(positions), bool)
        self._edited_at = 0.0
        try:
            faces = Faces.of(ob.data)
            reference, tolerance, matrix, threads = needed(ob)
        except (Refused, native.module.TolvolError) as error:
            self.reason = str(error)
            return

        def work(progress):
            built = volumes.native_volume(reference, tolerance, threads, progress)
            options = {"to_world": matrix, "threads": threads, "progress": progress}
            guard = native.module.Guard(positions, faces.faces, built, outside="keep", **options)
            # A concave face may be inside as it is cut and outside as it might be: its corners stay where they are.
            kept = len(np.unique(faces.polygons[guard.outside]))
            return guard, kept and faces.outside(built, positions, options), kept

        self.begin(work)

    def prepared(self, outcome):
        guard, outside, self.kept_polygons = outcome
        self.on = not outside
        if outside:
            self.reason = outside_reason(outside)
        else:
            self._guard = guard

    @property
    def held_back(self):
        """How many vertices were held back in the last stroke that was."""
        return int(np.count_nonzero(self._held))

    def hold(self, positions):
        """Takes the mesh as it was edited, and keeps the array; moves what has to go back in it: (k,) these vertices."""
        if np.array_equal(positions.view(np.int32), self._last.view(np.int32)):
            return _NONE
        now = time.monotonic()
        if now - self._edited_at > _STROKE_GAP:
            self._held[:] = False
        self._edited_at = now
        try:
            indices, places = self._guard.constrain(positions)
        except native.module.TolvolError as error:  # a coordinate that is not finite
            self.on, self.reason = False, str(error)
            return _NONE
        if len(indices):
            positions[indices] = places
            self._held[indices] = True
            self.rest_at = now + REST
        self._last = positions
        return indices

    def said(self):
        """What happened in the last stroke, or None."""
        if self._held.any():
            return f"Held back {self.held_back:,} vertices"
        return f"{self.kept_polygons:,} concave faces stay where they are" if self.kept_polygons else None


def outside_reason(count):
    return f"{count:,} faces are outside: Select Outside in Object Mode shows them"


class Watches:
    """The watches of one kind, by the names of their objects."""

    def __init__(self):
        self._of = {}  # name -> (what it was made for, watch)

    def __iter__(self):
        return iter([(name, watch) for name, (_, watch) in self._of.items()])

    def of(self, ob, topology, make):
        """The watch of `ob`; a new one, make(followed), unless all is as it was when the present one was made."""
        key = situation(ob), topology
        known, watch = self._of.get(ob.name, (None, None))
        if known != key:
            followed = watch is not None and known[0] == key[0] and (watch.on or watch.followed)
            self.drop(ob.name)
            watch = make(followed)
            self._of[ob.name] = key, watch
        return watch

    def restart(self, ob, positions):
        """Puts a new watch in the place of the one of `ob` if these positions are inside; whether they are."""
        watch = Watch(ob, positions)
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
    """What became of wishes: Blender pushes the undo step of an operator before anybody can look at the outcome, so that
    undo and redo bring back the wish. The same wish then ends at the same places bit for bit."""

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
    """Equal for equal faces."""
    return fingerprint(
        mesh_io.column(mesh.loops, "vertex_index", 1, np.int32),
        mesh_io.column(mesh.polygons, "loop_start", 1, np.int32),
    )
