# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels that show how far the mesh is from its reference: proved numbers, and the settings of the overlay."""

import bpy

from .. import overlay
from ..overlay import reasons
from ..proof import report, verdict
from ..units import length
from .layout import AMBER, GREEN, GREY, RED, SubPanel, active, right, text_lines

_COLOURS = {verdict.WITHIN: GREEN, verdict.ONE_WAY: AMBER, verdict.UNDECIDED: AMBER, verdict.BEYOND: RED}


class TOLVOL_PT_deviation(SubPanel, bpy.types.Panel):
    bl_label = "Deviation"

    def draw(self, context):
        layout = self.layout
        ob = active(context)
        self._draw_measured(context, ob)
        row = layout.row(align=True)
        row.operator("tolvol.check")
        row.operator("tolvol.select_outside")
        layout.operator("tolvol.select_crossing")
        layout.operator("tolvol.save_report", text="Save Report...")
        if ob.tolvol.show_deviation and (reason := reasons.off()):
            text_lines(context, layout, f"The deviation is not shown: {reason}", "INFO")

    def _draw_measured(self, context, ob):
        """Draws the same rows with and without a measurement, so that the buttons below them stay where they are."""
        found = verdict.of(ob)
        column = self.layout.column(align=True)
        column.label(text="Largest Deviation")
        for text, side in (("Mesh", "forward"), ("Reference", "backward")):
            row = column.split(factor=0.4)
            row.label(text=text)
            value = getattr(found, side).upper if found else None
            right(row, f"{length(context, value)}  {report.percent(value, found.tolerance)}" if found else "\u2013")
        if found:
            text_lines(context, column, found.line(), _COLOURS[found.kind])
        elif ob.mode != "OBJECT":
            text_lines(context, column, "Measure in Object Mode", GREY)
        else:
            text_lines(context, column, "Not measured yet" if ob.tolvol.snapshot else "Set the reference first", GREY)


class TOLVOL_PT_show_deviation(SubPanel, bpy.types.Panel):
    """The settings of the overlay in the 3D view."""

    bl_label = "Show Deviation"
    bl_parent_id = "TOLVOL_PT_deviation"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        ob = active(context)
        self.layout.prop(ob.tolvol, "show_deviation", text="")
        # The overlay is not told of an object that was appended from another file.
        if ob.tolvol.show_deviation and not overlay.shows(ob) and not reasons.hidden(ob):
            bpy.app.timers.register(overlay.refresh, first_interval=0)

    def draw(self, context):
        ob = active(context)
        column = self.layout.column()
        column.active = ob.tolvol.show_deviation
        unsigned = reasons.unsigned(ob)
        row = column.row()
        row.enabled = not unsigned
        row.prop(ob.tolvol, "deviation_kind", expand=True)
        column.prop(ob.tolvol, "deviation_opacity")
        if reason := reasons.hidden(ob) or unsigned:
            text_lines(context, column, reason, "INFO")
