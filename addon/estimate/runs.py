# SPDX-License-Identifier: GPL-3.0-or-later
"""The decimations in the thread: which one is the next, and what becomes of it."""

import functools
import time

import bpy

from .. import job, native
from ..background import queue
from ..operators import blocked
from ..operators.decimate import targets
from ..redraw import redraw_sidebars
from ..reference import snapshots
from ..shared import volumes
from ..shared.errors import Refused
from . import known

# The most triangles of all meshes and references together that are estimated. Decimating so many at 0.2 % takes 8 s of the
# processor and 0.6 GB of memory.
MOST_TRIANGLES = 500_000

# The tasks: a decimation at the present tolerance, and one at another. The first is more urgent, and everything else in
# the queue is more urgent than both.
_HERE, _ELSEWHERE = ("estimate", "here"), ("estimate", "elsewhere")
_RANKS = {_HERE: 1, _ELSEWHERE: 2}
# The tolerance rests if it has not changed for so many seconds. So long after a change a mesh is read, too.
_REST = 0.3

_present = None  # the names and tolerances that were drawn last


def triangles(objects):
    """Returns the number of triangles of the objects and their references, from the numbers of corners and faces."""
    meshes = [ob.data for ob in objects]
    for ob in objects:
        source = ob.tolvol.snapshot or snapshots.source_object(ob).data
        if source != ob.data:
            meshes.append(source)
    return sum(len(mesh.loops) - 2 * len(mesh.polygons) for mesh in meshes)


def ask(objects, percents):
    """Asks for the decimations that are missing. percents: {name of an object: its tolerance in percent of the size}."""
    global _present
    settings = objects[0].tolvol
    if _present != percents:
        _present = percents
        queue.cancel(_HERE)  # If it only waits, it waits anew.
    found = [(known.current(ob, settings), percents[ob.name]) for ob in objects]
    if known.keep_only({ob.name for ob, (state, _) in zip(objects, found) if state}):
        cancel()
    if any(state and (state.curve is None or state.curve.too_large) for state, _ in found):
        return
    if not all(state and state.curve.good(percent) for state, percent in found):
        _later(_HERE, _REST)
    if all(state for state, _ in found) and any(state.curve.missing(percent) for state, percent in found):
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
    if triangles(objects) > MOST_TRIANGLES:
        return None
    settings = objects[0].tolvol
    for ob in objects:
        percent = known.percent(ob, settings)
        if not percent:
            return None
        try:
            state = known.current(ob, settings) or known.read(ob, settings)
        except (Refused, native.module.TolvolError):
            return None
        if (curve := state.curve) is None:
            return None
        wanted = None if curve.good(percent) else percent
        if about == _ELSEWHERE:
            wanted = curve.missing(percent)
        if wanted:
            return functools.partial(_run, state.task, curve, wanted)
    redraw_sidebars()  # The curve was known from before.
    return None


def _run(task, curve, percent, progress):
    """Runs a decimation in the thread. Returns what _finish() adds to the curve."""
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
        curve, *point = outcome
        curve.add(*point)
    redraw_sidebars()  # Drawing them asks for the next decimation.


def cancel():
    queue.cancel(_HERE)
    queue.cancel(_ELSEWHERE)
