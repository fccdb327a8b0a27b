# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that chooses which of Blender's tools are guarded and shows the state of each guard."""

import bpy

from .. import guard
from ..wrapping import text_lines
from .layout import AMBER, GREEN, GREY, SubPanel, active, keep_height

_WHERE = {
    "sculpting": "The guard of sculpting takes effect in Sculpt Mode",
    "editing": "The guard of editing takes effect in Edit Mode",
    "lattice": "The guard of the lattice takes effect while the mesh is in Object Mode",
}


class TOLVOL_PT_guard(SubPanel, bpy.types.Panel):
    bl_label = "Guard"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        ob = active(context)
        settings = ob.tolvol.guard
        for setting in guard.MODULES:
            layout.prop(settings, setting)
        row = layout.row()
        row.active = any(getattr(settings, setting) for setting in guard.MODULES)
        row.prop(settings, "crossings")
        # The sentences are below all buttons, so that they move none.
        column, rows = layout.column(align=True), 0
        for setting, text, on in guard.states(ob):
            icon = GREEN if on else GREY if on is None else AMBER
            name = settings.bl_rna.properties[setting].name
            rows += text_lines(context, column, f"{name}: {text}" if text else _WHERE[setting], icon)
        keep_height(context, column, "Guard", rows)
