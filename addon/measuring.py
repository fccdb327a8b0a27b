# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a mesh by itself while it is edited or sculpted, so that the verdict is always that of the present mesh.

*Check* is an operator, which would change the undo steps of Edit and Sculpt Mode. There the mesh is measured in a thread as
soon as it rests, as long as its deviation is shown or it is guarded.
"""

import functools
import time

import bpy
from bpy.app.handlers import persistent

from . import native, preferences
from .background import queue
from .redraw import redraw_views
from .reference import measurements, snapshots, tolerances
from .shared.errors import Refused
from .shared.proof import measure

_MODES = {"EDIT", "SCULPT"}
# A mesh rests if it has not changed for so many seconds.
_REST = 0.25

_read_now = None  # the mesh that is read, which Blender counts as a change of its geometry
_changes = {}  # name of an object -> (how often it changed, the time of the last change)
_failures = {}  # name of an object -> why its mesh cannot be measured as it is now


def wanted(ob):
    """Whether `ob` is measured by itself as it is now."""
    settings = ob.tolvol
    if native.module is None or ob.type != "MESH" or ob.mode not in _MODES or snapshots.reference_missing(ob):
        return False
    # What is sculpted with these two is not in the stored mesh.
    if ob.mode == "SCULPT" and (ob.use_dynamic_topology_sculpting or any(m.type == "MULTIRES" for m in ob.modifiers)):
        return False
    return settings.show_deviation or (settings.guard.editing if ob.mode == "EDIT" else settings.guard.sculpting)


def failure(ob):
    """Returns why the mesh of `ob` could not be measured as it is now, or None. It is quick enough to be called while drawing."""
    return _failures.get(ob.name)


def note(ob):
    """Notes that the mesh of `ob` may have changed: it is measured once it rests."""
    name = ob.name
    measurements.outdate(name)
    _failures.pop(name, None)
    _changes[name] = _changes.get(name, (0, 0))[0] + 1, time.monotonic()
    queue.cancel(("measuring", name))
    _request(name)


def _request(name):
    queue.later(
        ("measuring", name), _REST, functools.partial(_prepare, name), functools.partial(_finish, name, _changes[name])
    )


def _prepare(name):
    ob = bpy.data.objects.get(name)
    if ob is None or not wanted(ob):
        return None
    if time.monotonic() < _changes[name][1] + _REST:
        _request(name)
        return None
    _read(ob)
    if not ob.data.polygons:
        return _fail(name, f"{name} has no faces")
    try:
        surface, reference = snapshots.surface_of(ob), snapshots.reference_of(ob)
        tolerance = tolerances.required(ob, reference.size())
    except Refused as error:
        return _fail(name, str(error))
    if measurements.recognise(ob, surface, tolerance):  # The same mesh was measured in another mode, for example.
        redraw_views()
        return None
    threads = preferences.threads(bpy.context)

    def compare(progress):
        own, other = ((each.world(), each.arrays.triangles) for each in (surface, reference))
        forward, backward = measure.both_ways(own, other, tolerance, threads, progress)
        certified = {"forward": (forward.lower, forward.upper), "backward": (backward.lower, backward.upper)}
        return surface, certified, tolerance

    return compare


def _fail(name, reason):
    """Keeps why the mesh of an object cannot be measured, for the panel."""
    _failures[name] = reason
    redraw_views()


def _read(ob):
    """Brings the stored mesh up to date with the edited one."""
    global _read_now
    if ob.mode != "EDIT":
        return
    bpy.context.view_layer.update()  # what has changed before counts
    _read_now = ob.data
    try:
        ob.update_from_editmode()
        bpy.context.view_layer.update()
    finally:
        _read_now = None


def _finish(name, at, outcome, error):
    ob = bpy.data.objects.get(name)
    if ob is None or not wanted(ob):
        return
    if _changes[name] != at:
        _request(name)
    elif error is not None:
        _fail(name, native.said(error) or "The memory is not enough to measure the mesh")
    else:
        measurements.remember_passing(ob, *outcome)
    redraw_views()


@persistent
def _note_changes(_scene, depsgraph):
    for update in depsgraph.updates:
        ob = update.id.original
        # A sculpt stroke is not counted as a change of the geometry, a change of the selection in Edit Mode neither.
        if not isinstance(ob, bpy.types.Object) or not (update.is_updated_geometry or ob.mode == "SCULPT"):
            continue
        if ob.data == _read_now:
            continue
        measurements.outdate(ob.name)
        if wanted(ob):
            note(ob)


def refresh():
    """Measures the active object if that is wanted now and has not been done: a setting may have changed."""
    ob = bpy.context.view_layer.objects.active if bpy.context.view_layer else None
    if ob is not None and not bpy.app.background and wanted(ob) and measurements.measurement_of(ob) is None:
        note(ob)


@persistent
def _forget(*_):
    measurements.forget_kept()
    _changes.clear()
    _failures.clear()


def register():
    snapshots.listeners.append(refresh)
    if not bpy.app.background:
        bpy.app.handlers.depsgraph_update_post.append(_note_changes)
    bpy.app.handlers.load_pre.append(_forget)


def unregister():
    snapshots.listeners.remove(refresh)
    if not bpy.app.background:
        bpy.app.handlers.depsgraph_update_post.remove(_note_changes)
    bpy.app.handlers.load_pre.remove(_forget)
    _forget()
