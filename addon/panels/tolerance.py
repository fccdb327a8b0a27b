# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference and the tolerance, and how they stand."""

import bpy

from .. import native, volume
from ..operators import blocked
from ..units import length
from .layout import AMBER, GREEN, GREY, RED, Panel, right, text_lines


class TOLVOL_PT_tolerance(Panel, bpy.types.Panel):
    bl_label = "Tolerance"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        ob = context.active_object
        if native.module is None:
            text_lines(context, layout, native.reason, "ERROR")
            return
        if ob is None or ob.type != "MESH":
            layout.label(text="Select a mesh object", icon="INFO")
            return
        settings = ob.tolvol
        layout.prop(settings, "reference_kind")
        if settings.reference_kind == "OBJECT":
            layout.prop(settings, "reference_object")
        column = layout.column(align=True)
        column.prop(settings, "tolerance_percent" if settings.tolerance_mode == "PERCENT" else "tolerance_length")
        column.prop(settings, "tolerance_mode", text=" ")
        right(layout, self._other_form(context, ob))
        row = layout.row(align=True)
        row.operator("tolvol.set_reference", text="Update" if settings.snapshot else "Set Reference")
        if settings.snapshot:
            row.operator("tolvol.clear_reference", text="", icon="X")
        _status(context, layout, ob)
        on_top = ["modifiers"] * bool(ob.modifiers) + ["shape keys"] * bool(ob.data.shape_keys)
        if on_top:
            text_lines(context, layout, f"Holds for the base mesh, without its {' and '.join(on_top)}", "INFO")

    @staticmethod
    def _other_form(context, ob):
        size = volume.shown_size(ob)
        if not size:
            return ""
        tolerance = volume.tolerance_length(ob.tolvol, size)
        if ob.tolvol.tolerance_mode == "PERCENT":
            return f"= {length(context, tolerance)}"
        return f"= {100 * tolerance / size:.4g} % of size"


def _status(context, layout, ob):
    """How the reference stands, with a colour for it."""
    settings = ob.tolvol
    reason = blocked.object_blocked(ob)
    # A reference that is set holds in every mode; buttons that need Object Mode say so.
    if reason and (ob.mode == "OBJECT" or settings.snapshot is None):
        text_lines(context, layout, reason, RED)
    elif settings.snapshot is None:
        text_lines(context, layout, blocked.reference_blocked(ob) or "No reference set", GREY)
    elif reason := volume.stale_reason(ob):
        text_lines(context, layout, f"Out of date: {reason}", AMBER)
    else:
        triangles = len(settings.snapshot.polygons)
        tolerance = length(context, volume.tolerance_length(settings, settings.snapshot_size))
        ready = f", ready in {settings.snapshot_seconds:.2f} s" if settings.snapshot_seconds else ""
        text_lines(context, layout, f"{triangles:,} triangles, ±{tolerance}{ready}", GREEN)
