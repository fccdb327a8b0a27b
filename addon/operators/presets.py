# SPDX-License-Identifier: GPL-3.0-or-later
"""A menu of common tolerances, each shown as a length and as a share of the size."""

import bpy
from bpy.props import EnumProperty, FloatProperty

from ..properties import TOLERANCE_UNITS
from ..reference import measurements
from ..units import length
from .blocked import allowed, object_blocked

# (unit, value)
_PRESETS = (("LENGTH", 0.05), ("LENGTH", 0.1), ("PERCENT", 0.1), ("PERCENT", 0.5), ("PERCENT", 1.0))


class TOLVOL_OT_set_tolerance(bpy.types.Operator):
    """Set this tolerance. Blender imports each unit of a file as one metre. In a file in millimetres, such as most STL \
files, a tolerance of 0.05 in file units is 0.05 mm, which Blender shows as 5 cm"""

    bl_idname = "tolvol.set_tolerance"
    bl_label = "Set Tolerance"
    bl_options = {"REGISTER", "UNDO"}

    mode: EnumProperty(name="Unit", description="The unit of the tolerance", items=TOLERANCE_UNITS)
    value: FloatProperty(
        name="Tolerance",
        description="The tolerance, in percent of the size or in the units of the file",
        default=0.1,
        min=1e-12,
        precision=5,
    )

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        return allowed(cls, object_blocked(ob) if ob is None or ob.mode == "OBJECT" else None)

    def execute(self, context):
        settings = context.active_object.tolvol
        settings.tolerance_mode = self.mode
        setattr(settings, "tolerance_percent" if self.mode == "PERCENT" else "tolerance_length", self.value)
        return {"FINISHED"}


class TOLVOL_MT_tolerances(bpy.types.Menu):
    bl_label = "Tolerance Presets"
    bl_description = "Choose a common tolerance. Each is shown as a length and as a share of the size"

    def draw(self, context):
        size = measurements.shown_size(context.active_object)
        for mode, value in _PRESETS:
            choice = self.layout.operator("tolvol.set_tolerance", text=label(context, mode, value, size))
            choice.mode, choice.value = mode, value


def label(context, mode, value, size):
    """Returns the text of a preset: the value in its own unit, then as a length, a share of the size or both."""
    if mode == "LENGTH":
        share = [f"{100 * value / size:.3g} % of size"] if size else []
        return f"{value:g} in file units:  " + ",  ".join([length(context, value), *share])
    return f"{value:g} % of size" + (f":  {length(context, value / 100 * size)}" if size else "")
