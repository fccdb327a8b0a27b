# SPDX-License-Identifier: GPL-3.0-or-later
"""Undoes an edit as soon as no operator is running.

An undo while a modal operator works on the mesh crashes Blender, and Blender 3.4 does not tell whether one is running.
But a running modal operator takes every mouse move: a mouse move that arrives at the keymap of the window shows that no
operator is running. The user need not move the mouse for this, because Blender is made to send a move to the place
where the mouse rests.
"""

import bpy

from .. import status_bar
from ..job import refusals
from . import edit

# The user sees the edit vanish, and has to have time to read why.
_SECONDS = 15.0

_item = None  # (keymap, its item) while there is an edit to undo
_sent_for = None  # (watch, last operator) for which the last mouse move was sent


class TOLVOL_OT_guard_undo(bpy.types.Operator):
    """Undo an edit that broke what the guard keeps"""

    bl_idname = "tolvol.guard_undo"
    bl_label = "Undo Guarded Edit"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        return edit.outside() is not None and bpy.ops.ed.undo.poll()

    def invoke(self, context, _event):
        ob, operators = edit.outside(), context.window_manager.operators
        label = operators[-1].name if operators else "The last step"
        name, why = ob.name, f"{ob.name} would {edit.watches.shown(ob).would}"
        edit.undo()  # After it there may be another watch, and another object in Blender's memory.
        status_bar.say(f"{label} was undone: {why}", _SECONDS)
        refusals.keep([name], label, why)
        return {"FINISHED", "PASS_THROUGH"}


def expect():
    """Waits for a mouse move while there is an edit to undo. Returns whether there is one."""
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
    # A running operator takes the mouse move that was sent. When that operator has ended, another move is sent.
    operators = bpy.context.window_manager.operators
    wanted = ob and (edit.watches.shown(ob), operators[-1].as_pointer() if operators else None)
    if wanted != _sent_for:
        _sent_for = wanted
        if wanted:
            _send_move()
    return ob is not None


def _send_move():
    """Makes Blender send a mouse move: a pan of a header by zero pixels does so.

    A modal operator takes the mouse moves of its own window only. With several windows this function does nothing,
    because Python cannot tell which window holds the mouse; a move by the user is needed there.
    """
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
