# SPDX-License-Identifier: GPL-3.0-or-later
"""Guard Editing: moved vertices stop at the tolerance, and an edit of the faces that leaves the tolerance, on either side, or
that makes faces cross where crossings are kept out, is undone."""

import bmesh
import bpy
import numpy as np

from ..mesh import mesh_io
from . import watch

watches = watch.Watches()
# Fingerprint of coordinates and faces -> (indices of vertices, their corrected positions).
_corrections = watch.Corrections()
_undoing = False


def wanted(ob):
    return ob.mode == "EDIT" and ob.tolvol.guard.editing


blocked = watch.blocked


def follow(ob, restored, _depsgraph):
    """Called after every change of `ob`. restored: "undo" or "redo" if one of these made the change, else None."""
    ob.update_from_editmode()
    mesh = ob.data
    positions = mesh_io.column(watch.points_of(ob), "co", 3)
    topology = watch.topology(mesh)
    wish = topology + watch.fingerprint(positions)
    known = _corrections.get(wish) if restored else None
    if known:
        positions[known[0]] = known[1]
    current = watches.of(ob, topology, lambda before: watch.Watch(ob, positions.copy(), before, edits_faces=True))
    # A mesh without faces has no point that is outside.
    if not mesh.polygons and ob.tolvol.keep != "BOTH":
        current.followed = False
    # An undo by the user leads to a mesh of before the guard, which the guard leaves as it is. Adjust Last Operation also
    # undoes, but it keeps its operator in the list of operators; it counts as an edit.
    if restored == "undo" and not _undoing and not bpy.context.window_manager.operators:
        current.followed = False
    if not current.settled() or not current.on:
        return
    changed = known[0] if known else np.empty(0, np.int32)
    wished = positions.copy() if restored else None
    held = current.hold(positions)
    if len(held) and not (restored and watches.restart(ob, wished, edits_faces=True)):
        changed = np.union1d(changed, held)
        _corrections[wish] = changed, positions[changed]
    if len(changed):
        _write(mesh, changed, positions[changed])


def rest(ob):
    """Called when the edit is over. Blender triangulates the faces anew for the corrected positions."""
    bmesh.update_edit_mesh(ob.data)


def outside():
    """Returns an object of which an edit of its faces broke what the guard keeps, or None. The operator may still be running."""
    for name, current in watches:
        if current.followed and not current.on and not current.preparing:
            return bpy.data.objects.get(name)
    return None


def undo():
    """Undoes one step. Unlike an undo by the user, the guard goes on undoing until the mesh is inside again."""
    global _undoing
    _undoing = True
    try:
        bpy.ops.ed.undo()
    finally:
        _undoing = False


def _write(mesh, indices, places):
    mesh_io.move_edited(mesh, indices, places)
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
