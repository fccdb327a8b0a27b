# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates how many triangles Decimate would leave, for the panel, before Decimate is pressed.

While the panel is drawn, decimations run in a thread, one at a time and without a proof: one at the present tolerance once
it rests, and some at others, so that the number is known at once while the tolerance is dragged (curve.py). They end when
an operator is at work, and when the mesh, its mode or a setting changes. None begins that the panel does not ask for.
"""

import functools
import hashlib
import json
import math
import time
from collections import Counter, OrderedDict
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.handlers import persistent

from .. import handlers, job, native
from ..background import queue
from ..errors import Refused
from ..mesh import mesh_io
from ..operation_settings import decimate_settings
from ..operators import blocked, decimation
from ..operators.decimate import targets
from ..proof import last_run, report
from ..properties import automatic_placement
from ..redraw import redraw_sidebars
from ..reference import measurements, snapshots, tolerances, volumes
from .curve import Curve

# The most triangles of all meshes and references together that are estimated. Decimating so many at 0.2 % takes 8 s of the
# processor and 0.6 GB of memory.
MOST_TRIANGLES = 500_000

# The tasks: a decimation at the present tolerance, and one at another. The first is more urgent, and everything else that
# runs in a thread is more urgent than both.
_HERE, _ELSEWHERE = ("estimate", "here"), ("estimate", "elsewhere")
_RANKS = {_HERE: 1, _ELSEWHERE: 2}
# The tolerance rests if it has not changed for so many seconds. So long after a change a mesh is read, too.
_REST = 0.3

# *Thorough* leaves about this share of the triangles that *Fast* leaves, if Fast removes this share of them or more.
_THOROUGH, _MANY = 0.63, 0.25

# The settings of Decimate that do not change the curve.
_BESIDE = {"effort", "use_target", "target_triangles", "max_seconds"}
_SETTINGS = sorted(decimate_settings().keys() - _BESIDE)
_MOST_CURVES = 16
_AT_WORK, _TOO_LARGE = "Estimating", "Too large to estimate"
# A float32 tolerance in percent differs from that of the run by a smaller share.
_SAME = 1e-6


@dataclass(frozen=True)
class _Known:
    """What is known about an object: as it was when it had this token."""

    token: tuple
    task: decimation.Task | None  # None if Decimate would refuse the settings
    curve: Curve | None


_known = {}  # name of an object -> _Known
_curves = OrderedDict()  # the content that decimate() gets -> Curve, the last used one at the end
_edits = Counter()  # name of a mesh -> how often it was changed
_generation = 0  # grows when a step is undone or a file opened: pointers and names are of other data then
_present = None  # the names and tolerances that were drawn last


@dataclass(frozen=True)
class Estimate:
    before: int
    after: int
    known: bool  # whether Decimate has left this number


def shown(context):
    """Returns the Estimate for the objects that Decimate would work on, or a text that says why there is none.

    The text is empty where the panel says the reason itself. Panels call the function while they are drawn: it reads what is
    known, and asks for what is not.
    """
    objects = targets(context)
    if job.under_way() or any(blocked.decimate_blocked(ob) for ob in objects):
        _cancel()
        return ""
    settings = objects[0].tolvol
    done = [_decimated(ob, settings) for ob in objects]
    if all(done):
        _cancel()
        return Estimate(sum(before for before, _ in done), sum(after for _, after in done), True)
    if _triangles(objects) > MOST_TRIANGLES:
        _cancel()
        return _TOO_LARGE
    percents = {ob.name: _percent(ob, settings) for ob in objects}
    if not all(percents.values()):
        return ""
    _ask(objects, percents)
    return _sum(objects, percents, settings)


def _sum(objects, percents, settings):
    before = after = 0
    for ob in objects:
        known = _current(ob, settings)
        if known is None:
            return _AT_WORK
        if known.curve is None:
            return ""
        if known.curve.too_large:
            return _TOO_LARGE
        if known.curve.refused(percents[ob.name]):
            return "Beyond this tolerance"
        count = known.curve.count(percents[ob.name])
        if not count:
            return _AT_WORK
        before += known.curve.triangles
        after += _limited(count, known.curve.triangles, settings)
    return Estimate(before, round(after), False)


def _limited(count, triangles, settings):
    """Returns the number of triangles with the settings that do not change the curve. count: what *Fast* leaves."""
    if settings.effort == "THOROUGH":
        # Where the tolerance permits hardly any change, Thorough hardly helps.
        count *= 1 - (1 - _THOROUGH) * min(max((1 - count / triangles) / _MANY, 0), 1)
    return max(count, min(settings.target_triangles, triangles)) if settings.use_target else count


def _triangles(objects):
    """Returns the number of triangles of the objects and their references, from the numbers of corners and faces."""
    meshes = [ob.data for ob in objects]
    for ob in objects:
        source = ob.tolvol.snapshot or snapshots.source_object(ob).data
        if source != ob.data:
            meshes.append(source)
    return sum(len(mesh.loops) - 2 * len(mesh.polygons) for mesh in meshes)


def _percent(ob, settings):
    """Returns the tolerance in percent of the size, or None if the size is not known."""
    size = measurements.shown_size(ob)
    return 100 * tolerances.tolerance_length(settings, size) / size if size else None


def _decimated(ob, settings):
    """Returns the numbers of triangles before and after the last operation on `ob`, or None unless it was Decimate with the
    tolerance, the directions, the effort and the target of the settings."""
    run = _counted(last_run.shown(ob))
    percent = _percent(ob, settings)
    if (
        run is None
        or not percent
        or not math.isclose(run[0], percent, rel_tol=_SAME)
        or run[1] != _choices(ob, settings)
    ):
        return None
    return run[2:]


def _choices(ob, settings):
    target = settings.target_triangles if settings.use_target else None
    placement = settings.placement if settings.placement_choice >= 0 else automatic_placement(ob.data)
    return settings.keep == "BOTH", settings.effort.lower(), placement.lower(), target


@functools.lru_cache(maxsize=16)
def _counted(run):
    """Returns (tolerance in percent, choices, triangles before, after) of a run as JSON, or None if it is no decimation."""
    try:
        told = json.loads(run)
        choices = tuple(told[name] for name in ("two_sided", "effort", "placement", "target_triangles"))
        counts = int(told["input"]["triangles"]), int(told["output"]["triangles"])
        return float(told["tolerance"]["percent"]), choices, *counts
    except report.DAMAGED:
        return None


# What is known, and whether it still holds ----------------------------------------------------------------------------


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


def _current(ob, settings):
    """Returns what is known about `ob`, or None if it is about another state."""
    known = _known.get(ob.name)
    return known if known and known.token == _token(ob, settings) else None


def _read(ob, settings):
    """Reads the mesh and the reference of `ob` and returns what is known about them."""
    chosen = settings.placement_choice >= 0
    placement = settings.placement if chosen else automatic_placement(ob.data)
    asked = decimation.options(settings, placement, threads=1)
    asked |= {"effort": "fast", "target_triangles": None, "max_seconds": None}
    _known[ob.name] = _Known(_token(ob, settings), None, None)
    # The tolerance is that of each run.
    task = decimation.task(ob, snapshots.reference_of(ob), math.nan, settings, asked)
    digest = _digest(task, _place(ob))
    curve = _curves.pop(digest, None) or Curve(len(task.surface.arrays.triangles))
    _curves[digest] = curve
    while len(_curves) > _MOST_CURVES:
        _curves.popitem(last=False)
    _known[ob.name] = _Known(_token(ob, settings), task, curve)
    return _known[ob.name]


def _digest(task, place):
    """Returns a value that is equal for equal decimations but for the tolerance."""
    digest = hashlib.blake2b(f"{task.options} {task.close_holes} {place}".encode(), digest_size=16)
    for surface in (task.surface, task.reference):
        digest.update(surface.arrays.fingerprint().encode())
    for array in (task.locked, task.shares, task.uvs, task.selected if task.close_holes else None):
        digest.update(b"none" if array is None else np.ascontiguousarray(array).tobytes())
    return digest.digest()


# The decimations in the thread ----------------------------------------------------------------------------------------


def _ask(objects, percents):
    """Has the decimations run that are missing."""
    global _present
    settings = objects[0].tolvol
    if _present != percents:
        _present = percents
        queue.cancel(_HERE)  # If it only waits, it waits anew.
    found = [(_current(ob, settings), percents[ob.name]) for ob in objects]
    current = {ob.name for ob, (known, _) in zip(objects, found) if known}
    for name in _known.keys() - current:
        del _known[name]
        _cancel()
    if any(known and (known.curve is None or known.curve.too_large) for known, _ in found):
        return
    if not all(known and known.curve.good(percent) for known, percent in found):
        _later(_HERE, _REST)
    if all(known for known, _ in found) and any(known.curve.missing(percent) for known, percent in found):
        _later(_ELSEWHERE, 0.0)


def _later(about, seconds):
    queue.later(about, seconds, functools.partial(_prepare, about), _finish, _RANKS[about])


def _prepare(about):
    """Returns the work of the next decimation, or None if there is none."""
    context = bpy.context
    playing = any(window.screen.is_animation_playing for window in context.window_manager.windows)
    objects = targets(context)
    if playing or job.under_way() or any(blocked.decimate_blocked(ob) for ob in objects):
        return None
    if _triangles(objects) > MOST_TRIANGLES:
        return None
    settings = objects[0].tolvol
    for ob in objects:
        percent = _percent(ob, settings)
        if not percent:
            return None
        try:
            known = _current(ob, settings) or _read(ob, settings)
        except (Refused, native.module.TolvolError):
            return None
        if (curve := known.curve) is None:
            return None
        wanted = None if curve.good(percent) else percent
        if about == _ELSEWHERE:
            wanted = curve.missing(percent)
        if wanted:
            return functools.partial(_run, known.task, curve, wanted)
    redraw_sidebars()  # The curve was known from before.
    return None


def _run(task, curve, percent, progress):
    """Runs a decimation in the thread. Returns what finish() adds to the curve."""
    began = time.monotonic()
    tolerance = percent / 100 * task.reference.size()
    try:
        volume = volumes.passing_volume(task.reference, tolerance, 1, progress)
        count = task.count(progress, volume)
    except native.module.Cancelled:
        raise
    except native.module.TolvolError:  # Decimate would refuse the mesh, too.
        count = None
    except MemoryError:
        curve.too_large, count = True, None
    return curve, percent, count, time.monotonic() - began


def _finish(outcome, error):
    if error is None:
        curve, *known = outcome
        curve.add(*known)
    redraw_sidebars()  # Drawing them asks for the next decimation.


def _cancel():
    queue.cancel(_HERE)
    queue.cancel(_ELSEWHERE)


@persistent
def _note_changes(_scene, depsgraph):
    for update in depsgraph.updates:
        if update.is_updated_geometry and isinstance(update.id, bpy.types.Mesh):
            _edits[update.id.name] += 1
            _cancel()


@persistent
def _before_other_data(*_):
    """Called before a file is opened and a step is undone."""
    global _generation
    _generation += 1
    _cancel()


@persistent
def _after_load(*_):
    _known.clear()
    _curves.clear()
    _edits.clear()


_HANDLERS = (
    ("depsgraph_update_post", _note_changes),
    ("load_pre", _before_other_data),
    ("undo_pre", _before_other_data),
    ("redo_pre", _before_other_data),
    ("load_post", _after_load),
)


def register():
    handlers.add(_HANDLERS)


def unregister():
    handlers.remove(_HANDLERS)
    _cancel()
    _after_load()
