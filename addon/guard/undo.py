# SPDX-License-Identifier: GPL-3.0-or-later
"""Undoing an edit as soon as no operator is under way.

To undo while one has its hands in the mesh crashes Blender, and 3.4 does not tell whether one has. But it takes every
move of the mouse then: one that arrives at the keymap of the window says that there is none. So that nobody has to move
the mouse for it, Blender is made to send a move to where the mouse rests.
"""

import bpy

from .. import status_bar
from . import edit

_item = None  # (keymap, its item) while there is something to undo
_sent_for = None  # what the last move of a resting mouse was sent for


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
    global _item, _sent_for
    ob = edit.outside()
    keyconfig = bpy.context.window_manager.keyconfigs.addon
    if ob is not None and _item is None and keyconfig is not None:
        keymap = keyconfig.keymaps.new("Window")
        _item = keymap, keymap.keymap_items.new(TOLVOL_OT_guard_undo.bl_idname, "MOUSEMOVE", "ANY")
    elif ob is None and _item is not None:
        keymap, item = _item
        keymap.keymap_items.remove(item)
        _item = None
    # One that an operator takes is lost: when the operator has ended there is another one.
    operators = bpy.context.window_manager.operators
    wanted = ob and (edit.watches.shown(ob), operators[-1].as_pointer() if operators else None)
    if wanted != _sent_for:
        _sent_for = wanted
        if wanted:
            _send_move()
    return ob is not None


def _send_move():
    """A pan by nothing makes Blender send one. An operator takes those of its own window alone: with several windows the
    mouse has to say which one it is in."""
    windows = bpy.context.window_manager.windows
    if len(windows) > 1 or bpy.app.background:
        return
    area = windows[0].screen.areas[0]
    header = next(region for region in area.regions if region.type == "HEADER")
    with bpy.context.temp_override(window=windows[0], area=area, region=header):
        if bpy.ops.view2d.pan.poll():
            bpy.ops.view2d.pan(deltax=0, deltay=0)


def register():
    bpy.utils.register_class(TOLVOL_OT_guard_undo)


def unregister():
    expect()
    bpy.utils.unregister_class(TOLVOL_OT_guard_undo)
