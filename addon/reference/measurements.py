# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the measurements of objects and tells whether they are still valid. Caches the numbers that panels show.

What an operator measures is stored with the object, so that the file has it. What was measured in this session is kept in
memory, too: an undo step that is older than a measurement does not hold it, and what is measured in Edit and Sculpt Mode
is not stored with the object at all, because that would need an undo step.
"""

import datetime
from dataclasses import dataclass, fields, replace

import numpy as np

from .. import native
from ..mesh import mesh_io
from ..redraw import redraw_views
from ..shared.proof.verdict import Interval
from . import snapshots, tolerances

# Cache of numbers that panels show: (object, "size" or "fingerprint", ...) -> value. It is cleared when any mesh changes.
_shown = {}


# An object counts as scaled if the lengths of its axes or the angles between them change by more than this, relatively.
# The rounding of float32 rotations adds up to half of it.
_RIGID = 1e-6

# A matrix with a larger condition number is not inverted. For others the map from one place to another is off by a smaller
# share than _MAP_ROUNDING, because its rounding grows by the square of the condition number.
_WELL_CONDITIONED, _MAP_ROUNDING = 2000, 1e-8
# An object counts as scaled by one factor if the factors of all directions differ by less than this share. The rounding of
# float32 rotations makes a difference of 3e-5 where one axis is a thousand times as long as another.
_ONE_FACTOR = 1e-4
# A coordinate in the world is a sum of four rounded products in double precision. This rounding changes the distance of two
# points by less than this share of the largest sum of the absolute values of these products.
_WORLD_ROUNDING = 2.0**-47


@dataclass(frozen=True)
class Measurement:
    """The certified distances of one state of a mesh, with the same names as those that are stored with an object."""

    fingerprint: str
    matrix: tuple
    tolerance: float
    size: float
    forward_lower: float = 0.0
    forward: float = 0.0
    backward_lower: float = 0.0
    backward: float = 0.0
    share_outside: float = 0.0
    statistics: str = ""
    time: str = ""


_MOST_KEPT = 256
_kept = {}  # the result of _key() -> Measurement, the last one at the end
# Name of an object -> (its pointer, the fingerprint of its mesh, which has not changed since in Edit or Sculpt Mode).
_present = {}


def remember(ob, surface, certified, tolerance, share_outside=0.0, statistics=""):
    """Stores the certified distances of `surface`, the object's mesh as it is now, and redraws the panels.

    statistics: as text; those of the same state that are known already stay, and so do its share outside and the ends of
    the intervals that are better than the new ones.
    """
    # An operator that has just written the mesh reports before Blender tells of the change: what is shown counts from now.
    _shown[_fingerprint_key(ob)] = surface.arrays.fingerprint()
    measured = _keep(ob, surface, certified, tolerance, share_outside, statistics)
    for field in fields(measured):
        setattr(ob.tolvol.measurement, field.name, getattr(measured, field.name))
    redraw_views()


def remember_passing(ob, surface, certified, tolerance):
    """Keeps the certified distances of the object's mesh as it is now in Edit or Sculpt Mode."""
    _present[ob.name] = ob.as_pointer(), _keep(ob, surface, certified, tolerance).fingerprint


def recognise(ob, surface, tolerance):
    """Takes what was measured of `surface`, the object's mesh as it is now in Edit or Sculpt Mode, since Blender began, for
    the present mesh. Returns whether it was measured at this place with this tolerance."""
    fingerprint = surface.arrays.fingerprint()
    known = _kept.get(_key(ob, fingerprint))
    if known is None or known.tolerance != tolerance:
        return False
    _present[ob.name] = ob.as_pointer(), fingerprint
    return measurement_of(ob) is not None


def _keep(ob, surface, certified, tolerance, share_outside=0.0, statistics=""):
    fingerprint = surface.arrays.fingerprint()
    key = _key(ob, fingerprint)
    known = (_kept.pop(key, None), ob.tolvol.measurement)
    same = [each for each in known if each and each.fingerprint == fingerprint and _is_of_this_shape(ob, each)]
    if same and not statistics:
        statistics = same[0].statistics
    if same and not share_outside and same[0].tolerance == tolerance:
        share_outside = same[0].share_outside
    place = tuple(surface.matrix.ravel())
    forward, backward = Interval(*certified["forward"]), Interval(*certified["backward"])
    for each in same:
        if place == tuple(each.matrix):  # Turning the object changes distances by rounding.
            forward = forward.narrowed(Interval(each.forward_lower, each.forward))
            backward = backward.narrowed(Interval(each.backward_lower, each.backward))
    measured = Measurement(
        fingerprint,
        place,
        tolerance,
        snapshots.snapshot_size(ob),
        forward.lower,
        forward.upper,
        backward.lower,
        backward.upper,
        share_outside,
        statistics,
        datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
    )
    _kept[key] = measured
    if len(_kept) > _MOST_KEPT:
        del _kept[next(iter(_kept))]
    return measured


def _key(ob, fingerprint):
    """Returns a value that is equal for equal meshes of an object with equal references."""
    return ob.name, fingerprint, about_reference(ob)


def about_reference(ob):
    """Returns a text that is equal for equal references at the same place, or, if it moves with the object, at any place."""
    settings = ob.tolvol
    place = "" if settings.snapshot_kind == "SELF" else snapshots.reference_matrix(ob).tobytes().hex()
    return f"{settings.snapshot_kind} {settings.snapshot_fingerprint} {place}"


def outdate(name):
    """Notes that the mesh of an object has changed in Edit or Sculpt Mode."""
    _present.pop(name, None)


def _kept_of(ob):
    # In most modes the fingerprint tells whether it is still the same mesh. In Edit and Sculpt Mode Python does not see changes.
    if ob.mode not in {"EDIT", "SCULPT"}:
        return _kept.get(_key(ob, shown_fingerprint(ob)))
    pointer, fingerprint = _present.get(ob.name, (None, None))
    return _kept.get(_key(ob, fingerprint)) if pointer == ob.as_pointer() else None


def _stored_of(ob):
    found = ob.tolvol.measurement
    return found if ob.mode == "OBJECT" and found.complete and found.fingerprint == shown_fingerprint(ob) else None


def _unchanged_of(ob):
    """Returns the Measurement of a mesh that is its own reference, as it was when the reference was set: no distance."""
    settings = ob.tolvol
    if settings.snapshot_kind != "SELF" or ob.mode != "OBJECT":
        return None
    if shown_fingerprint(ob) != settings.snapshot_fingerprint:
        return None
    size = snapshots.snapshot_size(ob)
    place = tuple(mesh_io.matrix_array(ob.matrix_world).ravel())
    return Measurement(settings.snapshot_fingerprint, place, tolerances.tolerance_length(settings, size), size)


def measurement_of(ob):
    """Returns what is known of the mesh as it is now, or None if mesh, place or reference have changed since it was measured.

    A mesh that is its own reference may have been moved, turned or scaled by one factor since.
    """
    if ob.tolvol.snapshot is None or snapshots.stale_reason(ob):
        return None
    found = [each for find in (_kept_of, _stored_of, _unchanged_of) if (each := find(ob)) is not None]
    here = [_at_present_place(ob, each) for each in found]
    # The numbers of the present place itself are the best.
    measured_here = (each for each, original in zip(here, found) if each is original)
    return next(measured_here, None) or next(filter(None, here), None)


def _sound(measurement):
    """Whether no number of a measurement is damaged."""
    lengths = measurement.tolerance, measurement.size, 1 + measurement.forward, 1 + measurement.backward
    return all(map(snapshots.sound, lengths))


def _place_then_and_now(ob, measurement):
    return snapshots.stored_matrix(measurement.matrix), mesh_io.matrix_array(ob.matrix_world)


def _is_of_this_shape(ob, measurement):
    """Whether a measurement of this mesh and its reference is sound, and of the same place or of the same lengths."""
    if not _sound(measurement):
        return False
    before, now = _place_then_and_now(ob, measurement)
    return np.array_equal(before, now) or (ob.tolvol.snapshot_kind == "SELF" and same_shape(before, now))


def _at_present_place(ob, measurement):
    """Returns what a measurement of this mesh and its reference says at the present place, or None if it does not hold there.

    A mesh that is its own reference may have been moved, turned or scaled by one factor since. Each distance in the world is
    then multiplied by a factor between the least and the largest singular value of the map from the place of the measurement
    to the present one. So are the largest distances of the two surfaces, whose coordinates in the world are rounded at either
    place. If what is known then does not decide about the tolerance, the result is None, too.
    """
    if not _sound(measurement):
        return None
    before, now = _place_then_and_now(ob, measurement)
    if np.array_equal(before, now):
        return measurement
    if ob.tolvol.snapshot_kind != "SELF":
        return None
    factors = _factors(before[:3, :3], now[:3, :3])
    if factors is None:
        return None
    least, most = factors
    # The coordinates of the mesh exceed those of the reference at most by the distance that was measured. The numbers of whose
    # sum they consist may exceed them by the condition number.
    was_off, is_off = (
        _WORLD_ROUNDING * (snapshots.farthest(ob, matrix) + _condition(matrix[:3, :3]) * factor * measurement.forward)
        for matrix, factor in ((before, 1), (now, most))
    )
    if not np.isfinite((was_off, is_off)).all():
        return None

    def carried(lower, upper):
        return Interval(max(least * (lower - was_off) - is_off, 0.0), most * (upper + was_off) + is_off)

    forward = carried(measurement.forward_lower, measurement.forward)
    backward = carried(measurement.backward_lower, measurement.backward)
    size = snapshots.snapshot_size(ob)
    tolerance = tolerances.tolerance_length(ob.tolvol, size)
    if forward.undecided(tolerance) or backward.undecided(tolerance):
        return None
    found = Measurement(
        measurement.fingerprint,
        tuple(now.ravel()),
        tolerance,
        size,
        forward.lower,
        forward.upper,
        backward.lower,
        backward.upper,
        time=measurement.time,
    )
    if not same_shape(before, now):
        return found
    return replace(
        found,
        tolerance=measurement.tolerance,
        share_outside=measurement.share_outside,
        statistics=measurement.statistics,
    )


def _condition(linear):
    try:
        return float(np.linalg.cond(linear))
    except np.linalg.LinAlgError:  # The file is damaged.
        return np.inf


def _factors(before, now):
    """Returns the least and the largest factor of lengths from one place to another, by the linear parts of the maps from there
    to the world, or None if they are not known well enough, or differ by more than _ONE_FACTOR."""
    if np.array_equal(before, now):
        return 1.0, 1.0
    try:
        if not _condition(before) < _WELL_CONDITIONED:
            return None
        factors = np.linalg.svd(now @ np.linalg.inv(before), compute_uv=False)
    except np.linalg.LinAlgError:  # The file is damaged.
        return None
    least, most = (1 - _MAP_ROUNDING) * factors.min(), (1 + _MAP_ROUNDING) * factors.max()
    return (least, most) if 0 < most <= (1 + _ONE_FACTOR) * least else None


def same_shape(matrix, other):
    """Whether two matrices to the world differ only by a rigid motion, so that lengths are the same."""
    metric, metric_other = (m[:3, :3].T @ m[:3, :3] for m in (matrix, other))
    lengths = np.sqrt(metric.diagonal())
    return bool((np.abs(metric - metric_other) <= _RIGID * np.outer(lengths, lengths)).all())


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
    """Returns the fingerprint of the object's mesh, for drawing: it is computed only after a change. Blender does not tell of
    changes of an object that no view shows."""
    key = _fingerprint_key(ob)
    if key not in _shown or not ob.visible_get():
        _shown[key] = mesh_io.read_mesh(ob.data).fingerprint()
    return _shown[key]


def _fingerprint_key(ob):
    return ob.as_pointer(), "fingerprint"


def forget():
    _shown.clear()


def forget_kept():
    _kept.clear()
    _present.clear()
