# SPDX-License-Identifier: GPL-3.0-or-later
"""Guard Sculpting: vertices that a dab moved beyond the tolerance are moved back before Blender draws them."""

import bpy

from ..mesh import mesh_io
from . import watch

watches = watch.Watches()


def wanted(ob):
    return ob.mode == "SCULPT" and ob.tolvol.guard.sculpting


def blocked(ob):
    """Why sculpting on `ob` cannot be guarded, or None."""
    if reason := watch.blocked(ob) or watch.without_faces(ob):
        return reason
    if ob.use_dynamic_topology_sculpting:
        return "Switch off Dyntopo: it makes new vertices under the brush"
    if any(modifier.type == "MULTIRES" for modifier in ob.modifiers):
        return "Apply the Multiresolution modifier first: sculpting moves the points of the modifier, not of the mesh"
    return None


def follow(ob, restored, _depsgraph):
    """Called after every change of `ob`. restored: "undo" or "redo" if one of these made the change, else None."""
    points = watch.points_of(ob)
    positions = mesh_io.column(points, "co", 3)
    current = watches.of(ob, _topology(ob.data), lambda before: watch.Watch(ob, positions.copy(), before))
    if not current.settled() or not current.on:
        return
    wished = positions.copy() if restored or ob.active_shape_key else None
    held = current.hold(positions)
    # Positions that an undo brings back were inside earlier: they are proved anew and kept if the proof succeeds.
    if len(held) and not (restored and watches.restart(ob, wished)):
        _write(ob, wished, positions)


def rest(ob):
    """Called when the stroke is over. Blender renews the data that it computed from the brush's uncorrected positions."""
    ob.data.update()


def _topology(mesh):
    # From 3.6 on a mesh shares arrays with its evaluated mesh, and reading them may move them in memory: addresses tell
    # nothing there.
    if bpy.app.version >= (3, 6):
        return watch.topology(mesh)
    # Before 3.6 a tool that changes the faces in Sculpt Mode makes new arrays at other addresses. Comparing addresses is
    # quicker than reading all faces after each dab.
    return (len(mesh.vertices), len(mesh.loops), mesh.loops[0].as_pointer(), mesh.polygons[0].as_pointer())


def _write(ob, wished, positions):
    mesh, key = ob.data, ob.active_shape_key
    if key and key == mesh.shape_keys.reference_key:
        mesh_io.move_vertices(mesh, wished, positions)
        return
    watch.points_of(ob).foreach_set("co", positions.ravel())
    # Blender draws a mesh without shape keys and modifiers as it is sculpted; any other has to be evaluated again.
    if key or ob.modifiers:
        mesh.update()
