# SPDX-License-Identifier: GPL-3.0-or-later
"""Guard Sculpting: what a dab moved beyond the tolerance goes back before it is drawn."""

import bpy

from ..mesh import mesh_io
from . import watch

watches = watch.Watches()


def wanted(ob):
    return ob.mode == "SCULPT" and ob.tolvol.guard.sculpting


def blocked(ob):
    """Why sculpting on `ob` cannot be guarded, or None."""
    if reason := watch.blocked(ob):
        return reason
    if ob.use_dynamic_topology_sculpting:
        return "Switch off Dyntopo: it makes new vertices under the brush"
    if any(modifier.type == "MULTIRES" for modifier in ob.modifiers):
        return "Apply the Multiresolution modifier first: its own points are sculpted, not the mesh"
    return None


def follow(ob, restored, _depsgraph):
    """Called after whatever happened to `ob`; restored: by undo or redo, None for anything else."""
    points = watch.points_of(ob)
    positions = mesh_io.column(points, "co", 3)
    current = watches.of(ob, _topology(ob.data), lambda followed: watch.Watch(ob, positions.copy(), followed))
    if not current.settled() or not current.on:
        return
    wished = positions.copy() if restored or ob.active_shape_key else None
    held = current.hold(positions)
    # What undo brings back was certified in its time: it is proved anew rather than changed.
    if len(held) and not (restored and watches.restart(ob, wished)):
        _write(ob, wished, positions)


def rest(ob):
    """When the stroke is over: Blender renews what it keeps of places that the brush meant for the vertices."""
    ob.data.update()


def _topology(mesh):
    if bpy.app.version >= (3, 6):  # arrays that are shared with the evaluated mesh move when they are read
        return watch.topology(mesh)
    # Sculpting changes the faces only by tools that make them anew, elsewhere in memory.
    return (len(mesh.vertices), len(mesh.loops), mesh.loops[0].as_pointer(), mesh.polygons[0].as_pointer())


def _write(ob, wished, positions):
    mesh, key = ob.data, ob.active_shape_key
    if key and key == mesh.shape_keys.reference_key:
        mesh_io.move_vertices(mesh, wished, positions)
        return
    watch.points_of(ob).foreach_set("co", positions.ravel())
    # A bare mesh is drawn as it is sculpted; one that is evaluated has to be told.
    if key or ob.modifiers:
        mesh.update()
