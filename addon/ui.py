# SPDX-License-Identifier: GPL-3.0-or-later
"""3D View > Sidebar > Tolerance."""

import json

import blf
import bpy
import numpy as np

from . import native, report, volume
from .operators import blocked
from .operators.decimate import draw_decimate_settings

_FONT = 0  # Blender's own
# Pixels of the sidebar that a label with an icon leaves to others: tabs, margins, the icon.
_BESIDE_TEXT = 85

_NO_BREAK = "\u00a0"  # between a number and its unit

_GREY = "RADIOBUT_OFF"
# Blender's coloured squares, which newer versions name anew.
_ICONS = bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
_COLOR = "SEQUENCE_COLOR" if "SEQUENCE_COLOR_01" in _ICONS else "STRIP_COLOR"
_RED, _AMBER, _GREEN = f"{_COLOR}_01", f"{_COLOR}_02", f"{_COLOR}_04"


def length(context, value):
    """A world length in the scene's units, with enough digits to mean something."""
    units = context.scene.unit_settings
    if units.system != "NONE":
        text = bpy.utils.units.to_string(units.system, "LENGTH", value * units.scale_length, precision=3)
        if value == 0 or any(digit in "123456789" for digit in text):
            return text.replace(" ", _NO_BREAK)
    return f"{value:.3g}"


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Tolerance"


class _SubPanel(_Panel):
    bl_parent_id = "TOLVOL_PT_tolerance"

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        return native.module is not None and ob is not None and ob.type == "MESH"


class TOLVOL_PT_tolerance(_Panel, bpy.types.Panel):
    bl_label = "Tolerance"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        ob = context.active_object
        if native.module is None:
            _text(context, layout, native.reason, "ERROR")
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
        _right(layout, self._other_form(context, ob))
        row = layout.row(align=True)
        row.operator("tolvol.set_reference", text="Update" if settings.snapshot else "Set Reference")
        if settings.snapshot:
            row.operator("tolvol.clear_reference", text="", icon="X")
        _status(context, layout, ob)
        on_top = ["modifiers"] * bool(ob.modifiers) + ["shape keys"] * bool(ob.data.shape_keys)
        if on_top:
            _text(context, layout, f"Holds for the base mesh, without its {' and '.join(on_top)}", "INFO")

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
    if reason := blocked.object_blocked(ob):
        _text(context, layout, reason, _RED)
    elif settings.snapshot is None:
        _text(context, layout, blocked.reference_blocked(ob) or "No reference set", _GREY)
    elif reason := volume.stale_reason(ob):
        _text(context, layout, f"Out of date: {reason}", _AMBER)
    else:
        triangles = len(settings.snapshot.polygons)
        tolerance = length(context, volume.tolerance_length(settings, settings.snapshot_size))
        ready = f", ready in {settings.snapshot_seconds:.2f} s" if settings.snapshot_seconds else ""
        _text(context, layout, f"{triangles:,} triangles, ±{tolerance}{ready}", _GREEN)


class TOLVOL_PT_deviation(_SubPanel, bpy.types.Panel):
    bl_label = "Deviation"

    def draw(self, context):
        layout = self.layout
        ob = context.active_object
        self._draw_measured(context, ob)
        row = layout.row(align=True)
        row.operator("tolvol.check")
        row.operator("tolvol.select_outside")
        layout.operator("tolvol.save_report", text="Save Report...")

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
            _right(row, f"{length(context, value)}  {report.percent(value, tolerance)}" if measured else "\u2013")
        if not measured:
            text = "Not measured yet" if ob.tolvol.snapshot else "Set the reference first"
            _text(context, column, text, _GREY)
            return
        # A tolerance that was changed since is compared with what was measured.
        same = np.float32(tolerance) == np.float32(measured.tolerance)
        forward, backward = (
            getattr(measured, side + "_within") if same else getattr(measured, side) < tolerance * (1 - 1e-6)
            for side in ("forward", "backward")
        )
        if forward and backward:
            _text(context, column, "Within the tolerance both ways, proved", _GREEN)
        elif forward:
            _text(context, column, "Within the tolerance one way, proved: parts of the reference are farther", _AMBER)
        else:
            share = (
                f": {100 * measured.share_outside:.1f}{_NO_BREAK}% of the mesh"
                if same and measured.share_outside
                else ""
            )
            _text(context, column, f"Beyond the tolerance{share}", _RED)


class TOLVOL_PT_decimate(_SubPanel, bpy.types.Panel):
    bl_label = "Decimate"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        ob = context.active_object
        draw_decimate_settings(layout, ob.tolvol)
        layout.operator("tolvol.decimate", text="Decimate")
        if ob.tolvol.last_run and ob.tolvol.last_run_of == volume.shown_fingerprint(ob):
            _text(context, layout, report.counts(json.loads(ob.tolvol.last_run)), "CHECKMARK")
        reason = blocked.decimate_blocked(ob)
        # The panel above says what is wrong with the reference.
        if reason and reason not in (
            blocked.object_blocked(ob),
            blocked.reference_blocked(ob),
            blocked.check_blocked(ob),
        ):
            _text(context, layout, reason, "ERROR")


class TOLVOL_PT_deform(_SubPanel, bpy.types.Panel):
    bl_label = "Deform"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.active_object.tolvol
        layout.prop(settings, "lattice")
        layout.prop(settings, "deform_mode")
        layout.operator("tolvol.deform", text="Deform")


def _right(layout, text):
    row = layout.row()
    row.alignment = "RIGHT"
    row.label(text=text)


def _text(context, layout, text, icon):
    """A label broken into lines that fit the sidebar."""
    scale = context.preferences.system.ui_scale
    blf.size(_FONT, context.preferences.ui_styles[0].widget.points * scale)
    room = max(context.region.width, 100) - _BESIDE_TEXT * scale
    lines, column = [""], layout.column(align=True)
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and blf.dimensions(_FONT, longer)[0] > room:
            lines.append(word)
        else:
            lines[-1] = longer
    for i, line in enumerate(lines):
        column.label(text=line, icon="BLANK1" if i else icon)


_CLASSES = (TOLVOL_PT_tolerance, TOLVOL_PT_deviation, TOLVOL_PT_decimate, TOLVOL_PT_deform)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
