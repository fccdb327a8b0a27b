# SPDX-License-Identifier: GPL-3.0-or-later
"""What was measured of an object last and whether it still holds; and what panels show of a mesh."""

import numpy as np

from .. import native
from ..mesh import mesh_io
from ..redraw import redraw_views
from . import snapshots

# What panels show of a mesh (its size, its fingerprint), by object; forgotten whenever any mesh changes.
_shown = {}


# How far the lengths of an object's axes and the angles between them may stray before it counts as scaled: ten
# times what float32 rotations add up to.
_RIGID = 1e-5


def remember(ob, surface, certified, tolerance, share_outside=0.0):
    """Keeps what was certified of `surface`, the object's mesh as it is now, and shows it at once."""
    measurement = ob.tolvol.measurement
    measurement.fingerprint = surface.arrays.fingerprint()
    measurement.matrix = surface.matrix.ravel()
    measurement.tolerance, measurement.size = tolerance, snapshots.snapshot_size(ob)
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
    if not all(map(snapshots.sound, (measurement.tolerance, 1 + measurement.forward, 1 + measurement.backward))):
        return None  # a damaged file
    before, now = snapshots.stored_matrix(measurement.matrix), mesh_io.matrix_array(ob.matrix_world)
    moves_along = ob.tolvol.snapshot_kind == "SELF" and same_shape(before, now)
    return measurement if moves_along or np.array_equal(before, now) else None


def same_shape(matrix, other):
    """Whether two placements differ by a rigid motion only, so that lengths are the same."""
    metric, metric_other = (m[:3, :3].T @ m[:3, :3] for m in (matrix, other))
    return np.abs(metric - metric_other).max() <= _RIGID * np.abs(metric).max()


def on_top(ob):
    """What Blender shows the mesh of `ob` with that no proof covers."""
    return ["modifiers"] * bool(ob.modifiers) + ["shape keys"] * bool(ob.data.shape_keys)


def shown_size(ob):
    """What 100 % is, for drawing; None while it cannot be known."""
    if ob.tolvol.snapshot is not None:
        size = snapshots.snapshot_size(ob)
        return size if snapshots.sound(size) else None
    source = snapshots.source_object(ob)
    if source is None or source.type != "MESH" or not source.data.polygons or native.module is None:
        return None
    key = (source.as_pointer(), "size", mesh_io.matrix_array(source.matrix_world).tobytes())
    if key not in _shown:
        try:
            _shown[key] = snapshots.surface_of(source).size()
        except native.module.TolvolError:
            _shown[key] = None
    return _shown[key]


def shown_fingerprint(ob):
    """Tells one state of the object's mesh from another, for drawing."""
    key = (ob.as_pointer(), "fingerprint")
    if key not in _shown:
        _shown[key] = mesh_io.read_mesh(ob.data).fingerprint()
    return _shown[key]


def forget():
    _shown.clear()
