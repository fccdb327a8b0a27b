# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes the objects that File > Append makes of the meshes of references: Blender makes an object of each appended mesh that
no object has, and would show the reference and the original beside the object that refers to them."""

import bpy
from bpy.app.handlers import persistent

from .. import handlers

# A custom property of the object that Show Original shows, which has such a mesh, too.
SHOWN = "tolvol.shown"

_count = 0  # of all objects, when they were looked at last


def made_by_append():
    """Returns the objects that Blender has made of references and originals. It gives such an object the name of its mesh."""
    meshes = {ob.tolvol.snapshot for ob in bpy.data.objects} | {ob.tolvol.original for ob in bpy.data.objects}
    return [
        ob
        for ob in bpy.data.objects
        if ob.type == "MESH" and not ob.library and ob.data in meshes and ob.name == ob.data.name and SHOWN not in ob
    ]


def remove():
    for ob in made_by_append():
        bpy.data.objects.remove(ob)


@persistent
def _look(*_):
    global _count
    count = len(bpy.data.objects)
    # Objects cannot be removed while Blender evaluates the scene.
    if count > _count and made_by_append():
        bpy.app.timers.register(remove, first_interval=0)
    _count = count


_HANDLERS = (("depsgraph_update_post", _look),)


def register():
    if not bpy.app.background:  # Timers do not run there.
        handlers.add(_HANDLERS)


def unregister():
    if not bpy.app.background:
        handlers.remove(_HANDLERS)
