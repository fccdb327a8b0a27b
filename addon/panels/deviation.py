# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the mesh is from its reference, proved."""

import bpy
import numpy as np

from .. import overlay, report, volume
from ..overlay import reasons
from ..units import NO_BREAK, length
from .layout import AMBER, GREEN, GREY, RED, SubPanel, right, text_lines


class TOLVOL_PT_deviation(SubPanel, bpy.types.Panel):
    bl_label = "Deviation"

    def draw(self, context):
        layout = self.layout
        ob = context.active_object
        self._draw_measured(context, ob)
        row = layout.row(align=True)
        row.operator("tolvol.check")
        row.operator("tolvol.select_outside")
        layout.operator("tolvol.save_report", text="Save Report...")
        self._draw_shown(context, ob)

    def _draw_shown(self, context, ob):
        """The overlay in the 3D view."""
        settings = ob.tolvol
        column = self.layout.column()
        column.prop(settings, "show_deviation")
        if not settings.show_deviation:
            return
        row = column.row()
        row.enabled = not reasons.unsigned(ob)
        row.prop(settings, "deviation_kind", expand=True)
        column.prop(settings, "deviation_opacity")
        if reason := reasons.hidden(ob) or reasons.unsigned(ob):
            text_lines(context, column, reason, "INFO")
        elif not overlay.shows(ob):  # appended, for example
            bpy.app.timers.register(overlay.refresh, first_interval=0)

    def _draw_measured(self, context, ob):
        """The same rows whether there is a measurement or not: buttons below do not jump."""
        measured = volume.measurement_of(ob)
        tolerance = volume.tolerance_length(ob.tolvol, volume.shown_size(ob) or 0.0)
        column = self.layout.column(align=True)
        column.label(text="Largest Deviation")
        for text, side in (("Mesh", "forward"), ("Reference", "backward")):
            row = column.split(factor=0.4)
            row.label(text=text)
            value = getattr(measured, side) if measured else None
            right(row, f"{length(context, value)}  {report.percent(value, tolerance)}" if measured else "\u2013")
        if not measured:
            text = "Not measured yet" if ob.tolvol.snapshot else "Set the reference first"
            text_lines(context, column, text, GREY)
            return
        # A tolerance that was changed since is compared with what was measured.
        same = np.float32(tolerance) == np.float32(measured.tolerance)
        forward, backward = (
            getattr(measured, side + "_within") if same else getattr(measured, side) < tolerance * (1 - 1e-6)
            for side in ("forward", "backward")
        )
        if forward and backward:
            text_lines(context, column, "Within the tolerance both ways, proved", GREEN)
        elif forward:
            text_lines(
                context, column, "Within the tolerance one way, proved: parts of the reference are farther", AMBER
            )
        else:
            share = (
                f": {100 * measured.share_outside:.1f}{NO_BREAK}% of the mesh"
                if same and measured.share_outside
                else ""
            )
            text_lines(context, column, f"Beyond the tolerance{share}", RED)
