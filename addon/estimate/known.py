# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known about each object, and whether it is still about the object as it is now."""

import hashlib
import math
from collections import Counter, OrderedDict
from dataclasses import dataclass

import numpy as np

from ..mesh import mesh_io
from ..operation_settings import decimate_settings
from ..operators import decimation
from ..properties import automatic_placement
from ..reference import measurements, snapshots, tolerances
from ..shared.decimation import Task
from .curve import Curve

# The settings of Decimate that do not change the curve.
_BESIDE = {"effort", "use_target", "target_triangles", "max_seconds"}
_SETTINGS = sorted(decimate_settings().keys() - _BESIDE)
_MOST_CURVES = 16


@dataclass(frozen=True)
class Known:
    """What is known about an object as it was when it had this token."""

    token: tuple
    task: Task | None  # None if Decimate would refuse the settings
    curve: Curve | None


_known = {}  # name of an object -> Known
_curves = OrderedDict()  # the content that decimate() gets -> Curve, the last used one at the end
_edits = Counter()  # name of a mesh -> how often it was changed
_generation = 0  # grows when a step is undone or a file opened: pointers and names are of other data then


def percent(ob, settings):
    """Returns the tolerance in percent of the size, or None if the size is not known or a damaged file holds no tolerance."""
    size = measurements.shown_size(ob)
    tolerance = tolerances.tolerance_length(settings, size) if size else 0.0
    return 100 * tolerance / size if snapshots.sound(tolerance) else None


def _token(ob, settings):
    """Returns a value that changes with everything that the curve depends on. It is quick enough for drawing."""
    values = (getattr(settings, name) for name in _SETTINGS)
    chosen = tuple(frozenset(value) if isinstance(value, set) else value for value in values)
    about = [settings.placement_choice, chosen, _generation, len(ob.data.uv_layers)]
    source = None if ob.tolvol.snapshot else snapshots.source_object(ob)
    for each in {ob, source or ob}:
        about += [each.name, each.data.as_pointer(), _edits[each.data.name]]
    about += [ob.tolvol.snapshot_fingerprint, ob.tolvol.snapshot_kind if ob.tolvol.snapshot else ""]
    return *about, _place(ob)


def _place(ob):
    """Returns a value that changes with the places of the mesh and its reference, unless both move and turn together."""
    matrix, source = mesh_io.matrix_array(ob.matrix_world), snapshots.source_object(ob)
    is_own = ob.tolvol.snapshot_kind == "SELF" if ob.tolvol.snapshot else source == ob
    if not is_own:
        of_reference = ob.tolvol.snapshot_matrix if ob.tolvol.snapshot else mesh_io.matrix_array(source.matrix_world)
        return (*matrix.ravel(), *np.ravel(of_reference))
    metric = matrix[:3, :3].T @ matrix[:3, :3]
    # Rounding changes the last digits when the object is turned.
    return tuple(f"{value:.4e}" for value in (metric + np.abs(metric).max()).ravel())


def current(ob, settings):
    """Returns what is known about `ob`, or None if it is about another state."""
    known = _known.get(ob.name)
    return known if known and known.token == _token(ob, settings) else None


def read(ob, settings):
    """Reads the mesh and the reference of `ob` and returns what is known about them. Raises Refused and TolvolError."""
    chosen = settings.placement_choice >= 0
    placement = settings.placement if chosen else automatic_placement(ob.data)
    asked = decimation.options(settings, placement, threads=1)
    asked |= {"effort": "fast", "target_triangles": None, "max_seconds": None}
    _known[ob.name] = Known(_token(ob, settings), None, None)
    # The tolerance is that of each run.
    surface = snapshots.surface_of(ob)
    task = decimation.task(ob, surface, snapshots.reference_of(ob, surface), math.nan, settings, asked)
    digest = _digest(task, _place(ob))
    curve = _curves.pop(digest, None) or Curve(len(task.surface.arrays.triangles))
    _curves[digest] = curve
    while len(_curves) > _MOST_CURVES:
        _curves.popitem(last=False)
    _known[ob.name] = Known(_token(ob, settings), task, curve)
    return _known[ob.name]


def _digest(task, place):
    """Returns a value that is equal for equal decimations but for the tolerance."""
    digest = hashlib.blake2b(f"{task.options} {task.close_holes} {place}".encode(), digest_size=16)
    for surface in (task.surface, task.reference):
        digest.update(surface.arrays.fingerprint().encode())
    for array in (task.locked, task.shares, task.uvs, task.selected if task.close_holes else None):
        digest.update(b"none" if array is None else np.ascontiguousarray(array).tobytes())
    return digest.digest()


def keep_only(names):
    """Forgets what is known about all objects except those with these names. Returns whether anything was forgotten."""
    gone = _known.keys() - names
    for name in gone:
        del _known[name]
    return bool(gone)


def changed(mesh):
    """Notes that a mesh has changed."""
    _edits[mesh.name] += 1


def other_data():
    """Notes that pointers and names will be of other data."""
    global _generation
    _generation += 1


def forget():
    _known.clear()
    _curves.clear()
    _edits.clear()
