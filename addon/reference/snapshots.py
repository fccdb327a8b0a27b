# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the reference of an object: a snapshot of a mesh and its place.

The snapshot is a Mesh datablock that Object.tolvol points to, so that Blender saves it with the file and includes it in
undo. It is never changed. Beside it a second datablock keeps the mesh with all its data (originals.py). If an object is
its own reference, the object's present matrix maps snapshot and mesh to the world, so that the reference moves, turns and
scales with the object. If the reference is another object's mesh, it stays at the place in the world where it was when it
was set.
"""

import math

import bpy
import numpy as np

from .. import native
from ..mesh import mesh_io
from ..redraw import redraw_views
from ..shared.errors import Refused
from ..shared.surface import Surface
from . import originals

# Fingerprint of a snapshot -> the bounding box of its used vertices, (2, 3) float32. The box never becomes outdated,
# because a snapshot never changes.
_boxes = {}


# Functions that notify() calls whenever a reference may have changed: it was set or removed, or a step was undone, or a
# file was loaded.
listeners = []


def surface_of(ob):
    """Returns the object's base mesh as it is now."""
    return Surface(mesh_io.read_mesh(ob.data), mesh_io.matrix_array(ob.matrix_world))


def source_object(ob):
    """Returns the object whose mesh Set Reference would take, or None."""
    return ob if ob.tolvol.reference_kind == "SELF" else ob.tolvol.reference_object


def reference_of(ob, own=None):
    """Returns the reference at its present place. If none is set, it returns the mesh that Set Reference would take.

    own: the Surface of `ob`, if it has been read: it is not read again where it is the reference. If the object was moved since,
    its own reference is where it was then, so that the two belong together.
    """
    settings = ob.tolvol
    if settings.snapshot is None:
        source = source_object(ob)
        if source is None:
            raise Refused(f"{ob.name} has no reference: choose an object, or This Mesh")
        return own if source == ob and own is not None else surface_of(source)
    reason = stale_reason(ob)
    if reason:
        raise Refused(f"The reference of {ob.name} is out of date: {reason}. {REMEDY}")
    matrix = own.matrix if own is not None and settings.snapshot_kind == "SELF" else reference_matrix(ob)
    return Surface(mesh_io.read_mesh(settings.snapshot), matrix)


def reference_matrix(ob):
    """Returns (4, 4): the present matrix from the snapshot to the world."""
    settings = ob.tolvol
    own = settings.snapshot_kind == "SELF"
    return mesh_io.matrix_array(ob.matrix_world) if own else stored_matrix(settings.snapshot_matrix)


def snapshot_size(ob):
    """Returns the same number as reference_of(ob).size(), bit for bit, but is quick enough to be called while drawing.

    Returns nan if a damaged file holds no surface, or if an axis of the object is scaled to zero.
    """
    box = _box_of(ob)
    if not np.isfinite(box).all():
        return math.nan
    # The size of a surface is the size of the bounding box of its used vertices.
    try:
        return native.module.diagonal(box, np.array([[0, 1, 1]]), to_world=reference_matrix(ob))
    except native.module.TolvolError:
        return math.nan


def farthest(ob, matrix):
    """Returns a length that no coordinate of the snapshot in the world exceeds, if `matrix` maps it there.

    The sum of the absolute values of the four numbers whose sum a coordinate is does not exceed it either.
    """
    return float((np.abs(matrix[:3, :3]) @ np.abs(_box_of(ob)).max(0) + np.abs(matrix[:3, 3])).max())


def _box_of(ob):
    key = ob.tolvol.snapshot_fingerprint
    if key not in _boxes:
        _boxes[key] = _box(mesh_io.read_mesh(ob.tolvol.snapshot))
    return _boxes[key]


def _box(arrays):
    used = arrays.vertices[np.unique(arrays.triangles)]
    return np.array([used.min(0), used.max(0)]) if len(used) else np.full((2, 3), np.nan)


def set_reference(ob, surface):
    """Stores `surface` as the reference of `ob`, of the kind that the settings of `ob` name.

    An operator calls it before it changes the mesh, so that the original is kept with its data.
    """
    clear_reference(ob)
    settings = ob.tolvol
    settings.original = originals.copy_of(source_object(ob), surface.arrays)
    settings.snapshot = mesh_io.new_mesh(f".{ob.name} reference", surface.arrays.vertices, surface.arrays.triangles)
    settings.snapshot_kind = settings.reference_kind
    settings.snapshot_object = settings.reference_object if settings.reference_kind == "OBJECT" else None
    settings.snapshot_matrix = surface.matrix.ravel()
    settings.snapshot_fingerprint = surface.arrays.fingerprint()
    _boxes[settings.snapshot_fingerprint] = _box(surface.arrays)  # A damaged snapshot may have had this fingerprint.
    # Setting the percentage to itself makes it the object's own: a later change of the preferences does not change it.
    settings.tolerance_percent = settings.tolerance_percent
    notify()


def clear_reference(ob):
    kept = ob.tolvol.snapshot, ob.tolvol.original
    ob.tolvol.snapshot = ob.tolvol.original = None
    ob.tolvol.measurement.fingerprint = ""
    for mesh in kept:
        if mesh is not None and mesh.users == 0:
            bpy.data.meshes.remove(mesh)
    notify()


def notify():
    for listener in listeners:
        listener()
    redraw_views()


REMEDY = "Replace the reference, or choose the previous one again"


def stale_reason(ob):
    """Why the stored reference no longer fits the settings, or None. It is quick enough to be called while drawing."""
    settings = ob.tolvol
    if settings.snapshot is None:
        return None
    if is_damaged(ob):
        return "the snapshot in the file is damaged"
    if settings.snapshot_kind != settings.reference_kind:
        return "another kind of reference was chosen"
    if settings.snapshot_kind == "OBJECT" and settings.snapshot_object != settings.reference_object:
        return "another object was chosen"
    return None


def is_damaged(ob):
    """Whether the stored reference is no surface: nothing that was measured against it holds then."""
    return ob.tolvol.snapshot is not None and not sound(ob.tolvol.snapshot_size)


def reference_missing(ob):
    """Why there is no reference to compare `ob` with, or None. It is quick enough to be called while drawing."""
    if ob.tolvol.snapshot is None:
        return "Set the reference first"
    if reason := stale_reason(ob):
        return f"The reference is out of date: {reason}. {REMEDY}"
    return None


def sound(length):
    """Whether a stored number can be a length. A damaged file may hold any number."""
    return 0 < length < np.inf


def stored_matrix(values):
    return np.array(values, np.float64).reshape(4, 4)


def forget():
    _boxes.clear()
