# SPDX-License-Identifier: GPL-3.0-or-later
"""Guard Editing: vertices stop at the tolerance; an edit of the faces that would leave it is undone."""

import bmesh
import bpy
import numpy as np

from .. import mesh_io
from . import watch

watches = watch.Watches()
_corrections = watch.Corrections()  # fingerprint of coordinates and faces -> (indices, places)
_last_inside = {}  # object name -> the operator that was the last when its mesh was last inside


def wanted(ob):
    return ob.mode == "EDIT" and ob.tolvol.guard.editing


blocked = watch.blocked


def follow(ob, restored, _depsgraph):
    """Called after whatever happened to `ob`; restored: by "undo" or "redo", None for anything else."""
    ob.update_from_editmode()
    mesh = ob.data
    if not mesh.polygons:
        watches.drop(ob.name)
        return
    positions = mesh_io.column(watch.points_of(ob), "co", 3)
    topology = watch.topology(mesh)
    wish = topology + watch.fingerprint(positions)
    known = _corrections.get(wish) if restored else None
    if known:
        positions[known[0]] = known[1]
    current = watches.of(ob, topology, lambda followed: watch.Watch(ob, positions.copy(), followed))
    if restored:
        _accept_restored(ob, current, restored)
    if not current.settled() or not current.on:
        return
    changed = known[0] if known else np.empty(0, np.int32)
    wished = positions.copy() if restored else None
    held = current.hold(positions)
    if len(held) and not (restored and watches.restart(ob, wished)):
        changed = np.union1d(changed, held)
        _corrections[wish] = changed, positions[changed]
    if len(changed):
        _write(mesh, changed, positions[changed])
    _last_inside[ob.name] = _last_operator()


def rest(ob):
    """When the edit is over: Blender cuts the faces anew where the vertices are."""
    bmesh.update_edit_mesh(ob.data)


def outside(ob):
    """Whether an operator, which may go on, made faces that are outside of a mesh that was inside before it."""
    current = watches.shown(ob)
    return current is not None and not current.preparing and not current.on and current.followed


def has_ended(ob):
    """Whether that operator has ended: one that goes on has its hands in the mesh, and to undo would crash Blender."""
    if any(getattr(window, "modal_operators", ()) for window in bpy.context.window_manager.windows):
        return False
    return _last_operator() != _last_inside[ob.name]


def _accept_restored(ob, current, restored):
    """A step that was undone for leaving the tolerance is undone when it is done again. What lies before the guard was
    switched on is no step to undo; Adjust Last Operation, which keeps the operator, is."""
    if restored == "undo" and _last_operator() is None:
        current.followed = False
    else:
        _last_inside[ob.name] = "another"


def _last_operator():
    operators = bpy.context.window_manager.operators
    return operators[-1].as_pointer() if operators else None


def _write(mesh, indices, places):
    edited = bmesh.from_edit_mesh(mesh)
    edited.verts.ensure_lookup_table()
    for index, place in zip(indices.tolist(), places.tolist()):
        edited.verts[index].co = place
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
