# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of the reference and the tolerance, and of the state that they are in."""

import bpy

from .. import estimate, job, native
from ..operators import blocked
from ..reference import measurements, tolerances
from ..shared.numbers import NO_BREAK
from ..units import length
from ..wrapping import fitting, property_fields, text_lines, wrapped
from .layout import AMBER, GREEN, GREY, RED, Panel, active, is_narrow, right
from .notes import in_the_way
from .progress import in_a_row

_DIGITS = 3  # of an estimated number of triangles
_BESIDE_UNIT = 0.4  # share of the width that Blender gives to the name of a property


class TOLVOL_PT_tolerance(Panel, bpy.types.Panel):
    bl_label = "Tolerance"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        ob = active(context)
        if native.module is None:
            text_lines(context, layout, native.reason, "ERROR")
            return
        if ob is None or ob.type != "MESH":
            # A box that selects makes no object active, and deleting the active one leaves none.
            selected = any(other.type == "MESH" for other in context.selected_objects)
            other_active = "Shift-click a selected mesh to make it the active object"
            text_lines(context, layout, other_active if selected else "Select a mesh object", "INFO")
            return
        settings = ob.tolvol
        property_fields(context, layout, settings, "reference_kind")
        if settings.reference_kind == "OBJECT":
            layout.prop(settings, "reference_object")
        column = layout.column(align=True)
        row, narrow = column.row(align=True), is_narrow(context)
        # A narrow panel has no room for a name beside a field with a number and its unit. The name is also the panel's title.
        row.use_property_split = not narrow
        name = "tolerance_percent" if settings.tolerance_mode == "PERCENT" else "tolerance_length"
        row.prop(settings, name, **({"text": ""} if narrow else {}))
        row.menu("TOLVOL_MT_tolerances", text="", icon="PRESET")
        other = self._other_form(context, ob)
        # Beside the unit the other form takes no room from the verdict, which has to be on the first screen.
        beside = fitting(context, other, other.removeprefix("= "), share=_BESIDE_UNIT)
        column.prop(settings, "tolerance_mode", text=" " if narrow else beside or " ")
        if narrow:
            right(layout, other)
        right(layout, _estimated(context))
        layout.prop(settings, "keep")
        row = layout.row(align=True)
        replace = "Replace..." if narrow else "Replace Reference..."
        row.operator("tolvol.set_reference", text=replace if settings.snapshot else "Set Reference")
        if settings.snapshot:
            row.operator("tolvol.clear_reference", text="", icon="X")
        _status(context, layout, ob)

    @staticmethod
    def _other_form(context, ob):
        size = measurements.shown_size(ob)
        if not size:
            return ""
        tolerance = tolerances.tolerance_length(ob.tolvol, size)
        if ob.tolvol.tolerance_mode == "PERCENT":
            return f"= {length(context, tolerance)}"
        return f"= {100 * tolerance / size:.4g}{NO_BREAK}%"


def _estimated(context):
    """Returns how many triangles Decimate would leave, or has left, as text of one line. While a job runs, the text says so."""
    found = estimate.shown(context)  # It ends the estimates when a job begins.
    if run := job.under_way():
        return in_a_row(context, run.told())
    if isinstance(found, str):
        return found
    rounded = found.after
    if not found.known:  # An estimate with all digits would look like a fact.
        digits = max(len(str(found.after)) - _DIGITS, 0)
        rounded = round(found.after, -digits)
    text = f"{'' if found.known else '~'}{rounded:,}{'' if is_narrow(context) else ' triangles'}"
    share = min(100 * (1 - found.after / found.before), 99.9)  # 100 % would leave no triangle.
    if share < 0.05:
        return text
    return f"{text}, \u2212{share:.{0 if 1 <= share < 99 else 1}f}{NO_BREAK}%"


def _status(context, layout, ob):
    """Shows in one line what is in the way, or the reference, so that no panel below moves. Notes has the whole sentence."""
    snapshot = ob.tolvol.snapshot
    if reason := in_the_way(ob):
        icon = RED if blocked.object_blocked(ob, {ob.mode}) else AMBER
        layout.label(text=wrapped(context, reason, most=1)[0], icon=icon)
    elif snapshot is None:
        layout.label(text="No reference set", icon=GREY)
    else:
        layout.label(text=f"{len(snapshot.polygons):,} triangles", icon=GREEN)
