# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that chooses which of Blender's tools are guarded and shows the state of each guard."""

import bpy

from .. import guard
from .layout import AMBER, GREEN, GREY, SubPanel, active, text_lines

_WHERE = {
    "sculpting": "The guard takes effect in Sculpt Mode",
    "editing": "The guard takes effect in Edit Mode",
    "lattice": "The guard takes effect while the mesh is in Object Mode",
}


class TOLVOL_PT_guard(SubPanel, bpy.types.Panel):
    bl_label = "Guard"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        ob = active(context)
        settings = ob.tolvol.guard
        states = {setting: state for setting, *state in guard.states(ob)}
        for setting in guard.MODULES:
            layout.prop(settings, setting)
            if setting == "editing":
                row = layout.row()
                row.active = settings.sculpting or settings.editing
                row.prop(settings, "crossings")
            if setting in states:
                text, on = states[setting]
                icon = GREEN if on else GREY if on is None else AMBER
                text_lines(context, layout, text or _WHERE[setting], icon)
