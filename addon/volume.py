# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference of an object: a snapshot of a mesh and its place, and the native tolerance volumes built of it.

The snapshot is a Mesh datablock that Object.tolvol points to, so that it is saved with the file and followed by undo; it
is never written to. An object that is its own reference carries it along, moved, turned or scaled: snapshot and mesh are
mapped to the world by the object's present matrix. Another object's reference stays where it was in the world when it was
set.
"""

import math
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.handlers import persistent

from . import mesh_io, native
from .errors import Refused
from .redraw import redraw_views
from .units import shortest, typed
from .volume_cache import VolumeCache

_volumes = VolumeCache(most_bytes=600_000_000)

# What panels show of a mesh (its size, its fingerprint), by object; forgotten whenever any mesh changes.
_shown = {}

# fingerprint of a snapshot -> the box of its used vertices, (2, 3) float32; a snapshot never changes.
_boxes = {}

# Called whenever the reference of an object may have become another one: set, let go of, undone, loaded.
listeners = []

# How far the lengths of an object's axes and the angles between them may stray before it counts as scaled: ten
# times what float32 rotations add up to.
_RIGID = 1e-5


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
    return mesh_io.matrix_array(ob.matrix_world) if own else _stored_matrix(settings.snapshot_matrix)


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
    if not _sound(settings.snapshot_size):
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


def remember(ob, surface, certified, tolerance, share_outside=0.0):
    """Keeps what was certified of `surface`, the object's mesh as it is now, and shows it at once."""
    measurement = ob.tolvol.measurement
    measurement.fingerprint = surface.arrays.fingerprint()
    measurement.matrix = surface.matrix.ravel()
    measurement.tolerance, measurement.size = tolerance, snapshot_size(ob)
    measurement.forward_lower, measurement.forward = certified["forward"]
    measurement.backward_lower, measurement.backward = certified["backward"]
    measurement.share_outside = share_outside
    redraw_views()


def measurement_of(ob):
    """What was measured last, or None when the mesh, its place or the reference has changed since.

    In other modes than Object Mode the mesh is being changed by Blender, out of sight: nothing is known of it there.
    """
    measurement = ob.tolvol.measurement
    if ob.mode != "OBJECT" or not measurement.complete or measurement.fingerprint != shown_fingerprint(ob):
        return None
    if not all(map(_sound, (measurement.tolerance, 1 + measurement.forward, 1 + measurement.backward))):
        return None  # a damaged file
    before, now = _stored_matrix(measurement.matrix), mesh_io.matrix_array(ob.matrix_world)
    moves_along = ob.tolvol.snapshot_kind == "SELF" and same_shape(before, now)
    return measurement if moves_along or np.array_equal(before, now) else None


def same_shape(matrix, other):
    """Whether two placements differ by a rigid motion only, so that lengths are the same."""
    metric, metric_other = (m[:3, :3].T @ m[:3, :3] for m in (matrix, other))
    return np.abs(metric - metric_other).max() <= _RIGID * np.abs(metric).max()


def _sound(length):
    """Whether a stored length can be one: what a damaged file holds may be anything."""
    return 0 < length < np.inf


def _stored_matrix(values):
    return np.array(values, np.float64).reshape(4, 4)


def built_of(ob):
    """The tolerance volume of the reference that is set, if it is in memory; cheap enough to draw."""
    tolerance = tolerance_length(ob.tolvol, snapshot_size(ob))
    return _volumes.built((ob.tolvol.snapshot_fingerprint, reference_matrix(ob).tobytes(), tolerance))


def on_top(ob):
    """What Blender shows the mesh of `ob` with that no proof covers."""
    return ["modifiers"] * bool(ob.modifiers) + ["shape keys"] * bool(ob.data.shape_keys)


def native_volume(surface, tolerance, threads=0, progress=None):
    """The tolerance volume of a surface: built, or the one that was built of the same content before."""
    key = (surface.arrays.fingerprint(), surface.matrix.tobytes(), tolerance)

    def build():
        return native.module.ToleranceVolume(
            surface.arrays.vertices,
            surface.arrays.triangles,
            tolerance,
            to_world=surface.matrix,
            threads=threads,
            progress=progress,
        )

    return _volumes.get(key, build, progress)


def tolerance_length(settings, size):
    """The tolerance in world units, in double; `settings` has what properties.tolerance_settings() declares."""
    if settings.tolerance_mode == "LENGTH":
        return _chosen(settings, "tolerance_length")
    return _chosen(settings, "tolerance_percent") / 100 * size


def _chosen(settings, name):
    """What is chosen, in double: what was converted from the other unit, or the decimal that a person typed."""
    value = getattr(settings, name)
    try:
        converted = float(getattr(settings, f"{name}_converted"))
    except ValueError:
        converted = math.nan
    if np.float32(converted) == np.float32(value):
        return converted
    return typed(value, bpy.context.scene.unit_settings) if name == "tolerance_length" else shortest(value)


def convert_tolerance(settings, size, mode):
    """Makes the tolerance in unit `mode` equal to that in the other unit, in double."""
    if mode == "LENGTH":
        name, value = "tolerance_length", _chosen(settings, "tolerance_percent") / 100 * size
    else:
        name, value = "tolerance_percent", 100 * _chosen(settings, "tolerance_length") / size
        # There and back again is the number that was typed.
        if math.isclose(shortest(value), value, rel_tol=1e-15):
            value = shortest(value)
    setattr(settings, name, value)
    setattr(settings, f"{name}_converted", repr(value))


def shown_size(ob):
    """What 100 % is, for drawing; None while it cannot be known."""
    if ob.tolvol.snapshot is not None:
        size = snapshot_size(ob)
        return size if _sound(size) else None
    source = source_object(ob)
    if source is None or source.type != "MESH" or not source.data.polygons or native.module is None:
        return None
    key = (source.as_pointer(), "size", mesh_io.matrix_array(source.matrix_world).tobytes())
    if key not in _shown:
        try:
            _shown[key] = surface_of(source).size()
        except native.module.TolvolError:
            _shown[key] = None
    return _shown[key]


def shown_fingerprint(ob):
    """Tells one state of the object's mesh from another, for drawing."""
    key = (ob.as_pointer(), "fingerprint")
    if key not in _shown:
        _shown[key] = mesh_io.read_mesh(ob.data).fingerprint()
    return _shown[key]


@persistent
def _forget_shown(*_):
    _shown.clear()
    notify()


@persistent
def _forget_changed(_scene, depsgraph):
    if any(update.is_updated_geometry for update in depsgraph.updates):
        _shown.clear()


@persistent
def _forget_all(*_):
    _shown.clear()
    _boxes.clear()
    _volumes.clear()
    notify()


def register():
    bpy.app.handlers.depsgraph_update_post.append(_forget_changed)
    bpy.app.handlers.undo_post.append(_forget_shown)
    bpy.app.handlers.redo_post.append(_forget_shown)
    bpy.app.handlers.load_post.append(_forget_all)


def unregister():
    bpy.app.handlers.load_post.remove(_forget_all)
    bpy.app.handlers.redo_post.remove(_forget_shown)
    bpy.app.handlers.undo_post.remove(_forget_shown)
    bpy.app.handlers.depsgraph_update_post.remove(_forget_changed)
    _forget_all()
