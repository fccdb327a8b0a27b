# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference of an object: a snapshot of a mesh and its place.

The snapshot is a Mesh datablock that Object.tolvol points to, so that it is saved with the file and followed by undo; it
is never written to. An object that is its own reference carries it along, moved, turned or scaled: snapshot and mesh are
mapped to the world by the object's present matrix. Another object's reference stays where it was in the world when it was
set.
"""

import math
from dataclasses import dataclass

import bpy
import numpy as np

from .. import native
from ..errors import Refused
from ..mesh import mesh_io
from ..redraw import redraw_views

# fingerprint of a snapshot -> the box of its used vertices, (2, 3) float32; a snapshot never changes.
_boxes = {}


# Called whenever the reference of an object may have become another one: set, let go of, undone, loaded.
listeners = []


@dataclass(frozen=True)
class Surface:
    """A mesh and its place in the world."""

    arrays: mesh_io.MeshArrays
    matrix: np.ndarray  # (4, 4) float64

    def world(self):
        return mesh_io.to_world(self.arrays.vertices, self.matrix)

    def size(self):
        """The length that is 100 %."""
        return native.module.size(self.arrays.vertices, self.arrays.triangles, to_world=self.matrix)


def surface_of(ob):
    """The object's base mesh as it is now."""
    return Surface(mesh_io.read_mesh(ob.data), mesh_io.matrix_array(ob.matrix_world))


def joined(surfaces):
    """Several Surfaces as one; their coordinates are the world's, in double precision, unless there is only one."""
    surfaces = list(surfaces)
    if len(surfaces) == 1:
        return surfaces[0]
    vertices, triangles, base = [], [], 0
    for surface in surfaces:
        vertices.append(surface.world())
        triangles.append(surface.arrays.triangles + base)
        base += len(surface.arrays.vertices)
    arrays = mesh_io.MeshArrays(np.concatenate(vertices), np.concatenate(triangles).astype(np.int32), None, None)
    return Surface(arrays, np.eye(4))


def source_object(ob):
    """The object whose mesh a new reference would be taken from, or None."""
    return ob if ob.tolvol.reference_kind == "SELF" else ob.tolvol.reference_object


def reference_of(ob):
    """The reference as it lies in the world now; the mesh that Set Reference would take when none is set."""
    settings = ob.tolvol
    if settings.snapshot is None:
        source = source_object(ob)
        if source is None:
            raise Refused(f"{ob.name} has no reference: choose an object, or This Mesh")
        return surface_of(source)
    reason = stale_reason(ob)
    if reason:
        raise Refused(f"The reference of {ob.name} is out of date: {reason}. {REMEDY}")
    return Surface(mesh_io.read_mesh(settings.snapshot), reference_matrix(ob))


def reference_matrix(ob):
    """(4, 4): from the snapshot to the world, now."""
    settings = ob.tolvol
    own = settings.snapshot_kind == "SELF"
    return mesh_io.matrix_array(ob.matrix_world) if own else stored_matrix(settings.snapshot_matrix)


def snapshot_size(ob):
    """What reference_of(ob).size() is, bit for bit, in the time of a glance; cheap enough to draw.

    Not a number (nan) where a damaged file holds no surface.
    """
    settings = ob.tolvol
    key = settings.snapshot_fingerprint
    if key not in _boxes:
        arrays = mesh_io.read_mesh(settings.snapshot)
        used = arrays.vertices[np.unique(arrays.triangles)]
        _boxes[key] = np.array([used.min(0), used.max(0)]) if len(used) else np.full((2, 3), np.nan)
    if not np.isfinite(_boxes[key]).all():
        return math.nan
    # The size is that of the box of the used vertices.
    return native.module.size(_boxes[key], np.array([[0, 1, 1]]), to_world=reference_matrix(ob))


def set_reference(ob, surface):
    """Makes `surface` the reference, as chosen by the settings of `ob`."""
    clear_reference(ob)
    settings = ob.tolvol
    settings.snapshot = mesh_io.new_mesh(f".{ob.name} reference", surface.arrays.vertices, surface.arrays.triangles)
    settings.snapshot_kind = settings.reference_kind
    settings.snapshot_object = settings.reference_object if settings.reference_kind == "OBJECT" else None
    settings.snapshot_matrix = surface.matrix.ravel()
    settings.snapshot_fingerprint = surface.arrays.fingerprint()
    _boxes.pop(settings.snapshot_fingerprint, None)  # a damaged snapshot may have had this fingerprint
    settings.tolerance_percent = settings.tolerance_percent  # no longer what the preferences say
    notify()


def clear_reference(ob):
    snapshot = ob.tolvol.snapshot
    ob.tolvol.snapshot = None
    ob.tolvol.measurement.fingerprint = ""
    if snapshot is not None and snapshot.users == 0:
        bpy.data.meshes.remove(snapshot)
    notify()


def notify():
    for listener in listeners:
        listener()
    redraw_views()


REMEDY = "Replace the reference, or choose the one before again"


def stale_reason(ob):
    """Why the reference that is set no longer fits, or None. Cheap enough to draw."""
    settings = ob.tolvol
    if settings.snapshot is None:
        return None
    if not sound(settings.snapshot_size):
        return "what the file holds of it is damaged"
    if settings.snapshot_kind != settings.reference_kind:
        return "another one was chosen"
    if settings.snapshot_kind == "OBJECT" and settings.snapshot_object != settings.reference_object:
        return "another object was chosen"
    return None


def reference_missing(ob):
    """Why there is no reference to compare `ob` with, or None. Cheap enough to draw."""
    if ob.tolvol.snapshot is None:
        return "Set the reference first"
    if reason := stale_reason(ob):
        return f"The reference is out of date: {reason}. {REMEDY}"
    return None


def sound(length):
    """Whether a stored length can be one: what a damaged file holds may be anything."""
    return 0 < length < np.inf


def stored_matrix(values):
    return np.array(values, np.float64).reshape(4, 4)


def forget():
    _boxes.clear()
