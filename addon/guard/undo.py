# SPDX-License-Identifier: GPL-3.0-or-later
"""Undoing an edit as soon as no operator is under way.

To undo while one has its hands in the mesh crashes Blender, and 3.4 does not tell whether one has. But it takes every
move of the mouse then: one that arrives at the keymap of the window says that there is none.
"""

import bpy

from . import edit, status_bar

_item = None  # (keymap, its item) while there is something to undo


class TOLVOL_OT_guard_undo(bpy.types.Operator):
    """Undo an edit that left the tolerance"""

    bl_idname = "tolvol.guard_undo"
    bl_label = "Undo What Left the Tolerance"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        return edit.outside() is not None and bpy.ops.ed.undo.poll()

    def invoke(self, context, _event):
        name, operators = edit.outside().name, context.window_manager.operators
        label = operators[-1].name if operators else "The last step"
        edit.undo()
        status_bar.say(f"{label} was undone: {name} would leave the tolerance")
        return {"FINISHED", "PASS_THROUGH"}


def expect():
    """Listens to the mouse while there is something to undo."""
    global _item
    wanted = edit.outside() is not None
    keyconfig = bpy.context.window_manager.keyconfigs.addon
    if wanted and _item is None and keyconfig is not None:
        keymap = keyconfig.keymaps.new("Window")
        _item = keymap, keymap.keymap_items.new(TOLVOL_OT_guard_undo.bl_idname, "MOUSEMOVE", "ANY")
    elif not wanted and _item is not None:
        keymap, item = _item
        keymap.keymap_items.remove(item)
        _item = None
    return wanted


def register():
    bpy.utils.register_class(TOLVOL_OT_guard_undo)


def unregister():
    expect()
    bpy.utils.unregister_class(TOLVOL_OT_guard_undo)
