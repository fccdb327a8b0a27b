# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the last measurement of an object and tells whether it is still valid. Caches the numbers that panels show.

What an operator measures is stored with the object. What is measured in Edit and Sculpt Mode, without an operator and thus
without an undo step, is kept in memory alone.
"""

from dataclasses import dataclass

import numpy as np

from .. import native
from ..mesh import mesh_io
from ..redraw import redraw_views
from . import snapshots

# Cache of numbers that panels show: (object, "size" or "fingerprint", ...) -> value. It is cleared when any mesh changes.
_shown = {}


# An object counts as scaled if the lengths of its axes or the angles between them change by more than this, relatively.
# The rounding of float32 rotations adds up to a tenth of it.
_RIGID = 1e-5


def remember(ob, surface, certified, tolerance, share_outside=0.0):
    """Stores the certified distances of `surface`, the object's mesh as it is now, and redraws the panels."""
    measurement = ob.tolvol.measurement
    # An operator that has just written the mesh reports before Blender tells of the change: what is shown counts from now.
    measurement.fingerprint = _shown[_fingerprint_key(ob)] = surface.arrays.fingerprint()
    measurement.matrix = surface.matrix.ravel()
    measurement.tolerance, measurement.size = tolerance, snapshots.snapshot_size(ob)
    measurement.forward_lower, measurement.forward = certified["forward"]
    measurement.backward_lower, measurement.backward = certified["backward"]
    measurement.share_outside = share_outside
    measurement.statistics = ""
    redraw_views()


@dataclass(frozen=True)
class Passing:
    """A measurement that is kept in memory, with the same names as the one that is stored with an object."""

    fingerprint: str
    matrix: tuple
    tolerance: float
    size: float
    forward_lower: float
    forward: float
    backward_lower: float
    backward: float
    reference: tuple  # about_reference() of the object
    complete: bool = True
    share_outside: float = 0.0
    statistics: str = ""


_passing = {}  # name of an object -> Passing
_present = set()  # the names of those whose mesh has not changed since it was measured


def remember_passing(ob, surface, certified, tolerance):
    """Keeps the certified distances of the object's mesh as it is now in Edit or Sculpt Mode."""
    lengths = *certified["forward"], *certified["backward"]
    place = tuple(surface.matrix.ravel())
    about = surface.arrays.fingerprint(), place, tolerance, snapshots.snapshot_size(ob), *lengths
    _passing[ob.name] = Passing(*about, about_reference(ob))
    _present.add(ob.name)


def outdate(name):
    """Notes that the mesh of an object has changed in Edit or Sculpt Mode."""
    _present.discard(name)


def is_present(ob):
    """Whether the mesh has been measured as it is now in Edit or Sculpt Mode."""
    return ob.name in _present


def about_reference(ob):
    """Returns a value that is equal for equal references at the same place."""
    return ob.tolvol.snapshot_fingerprint, tuple(ob.tolvol.snapshot_matrix)


def _passing_of(ob):
    found = _passing.get(ob.name)
    if found is None or ob.tolvol.snapshot is None or found.reference != about_reference(ob):
        return None
    # In Object Mode the fingerprint tells whether it is still the same mesh. In the other modes Python does not see changes.
    true = found.fingerprint == shown_fingerprint(ob) if ob.mode == "OBJECT" else is_present(ob)
    return found if true else None


def _stored_of(ob):
    found = ob.tolvol.measurement
    return found if ob.mode == "OBJECT" and found.complete and found.fingerprint == shown_fingerprint(ob) else None


def measurement_of(ob):
    """Returns the last measurement, or None if the mesh, its place or the reference has changed since then."""
    measurement = _stored_of(ob) or _passing_of(ob)
    if measurement is None or snapshots.is_damaged(ob):
        return None
    lengths = measurement.tolerance, measurement.size, 1 + measurement.forward, 1 + measurement.backward
    if not all(map(snapshots.sound, lengths)):
        return None  # The file is damaged.
    before, now = snapshots.stored_matrix(measurement.matrix), mesh_io.matrix_array(ob.matrix_world)
    moves_along = ob.tolvol.snapshot_kind == "SELF" and same_shape(before, now)
    return measurement if moves_along or np.array_equal(before, now) else None


def same_shape(matrix, other):
    """Whether two matrices to the world differ only by a rigid motion, so that lengths are the same."""
    metric, metric_other = (m[:3, :3].T @ m[:3, :3] for m in (matrix, other))
    return np.abs(metric - metric_other).max() <= _RIGID * np.abs(metric).max()


def on_top(ob):
    """Returns names of the things that change the shown mesh of `ob` after the base mesh: no proof covers them."""
    return ["modifiers"] * bool(ob.modifiers) + ["shape keys"] * bool(ob.data.shape_keys)


def shown_size(ob):
    """Returns the length that is 100 %, for drawing, or None if it is not known."""
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
    """Returns the fingerprint of the object's mesh, for drawing: it is computed only after a change."""
    key = _fingerprint_key(ob)
    if key not in _shown:
        _shown[key] = mesh_io.read_mesh(ob.data).fingerprint()
    return _shown[key]


def _fingerprint_key(ob):
    return ob.as_pointer(), "fingerprint"


def forget():
    _shown.clear()


def forget_passing():
    _passing.clear()
    _present.clear()
