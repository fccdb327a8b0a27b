# SPDX-License-Identifier: GPL-3.0-or-later
"""A menu of common tolerances, each shown as a length and as a share of the size."""

import math

import bpy
from bpy.props import EnumProperty, FloatProperty, StringProperty

from ..properties import TOLERANCE_UNITS
from ..reference import measurements, tolerances
from ..shared.numbers import shortest
from ..units import length
from .blocked import allowed, object_blocked

# A preset counts as the present tolerance if it differs by less than this share, which is more than float32 rounds away.
_SAME = 1e-6
# (name, percent of the size)
BY_SIZE = (("Coarse", 1.0), ("Normal", 0.2), ("Fine", 0.05))
# In millimetres: the layers of printers are about as high.
FOR_PRINTERS = (0.1, 0.05)


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
    # Adjust Last Operation changes one property at a time: after another unit was chosen, the value is still in this one.
    mode_before: StringProperty(
        description="The unit of the value. It is empty until the tolerance was set", options={"HIDDEN", "SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        return allowed(cls, object_blocked(ob) if ob is None or ob.mode == "OBJECT" else None)

    def execute(self, context):
        ob = context.active_object
        settings, size = ob.tolvol, measurements.shown_size(ob)
        if self.mode_before not in ("", self.mode) and size:
            self.value = tolerances.converted(self.value, size, self.mode)
        self.mode_before = self.mode
        settings.tolerance_mode = self.mode
        setattr(settings, "tolerance_percent" if self.mode == "PERCENT" else "tolerance_length", self.value)
        return {"FINISHED"}


class TOLVOL_MT_tolerances(bpy.types.Menu):
    bl_label = "Tolerance Presets"
    bl_description = "Choose a common tolerance. Each is shown as a length and as a share of the size"

    def draw(self, context):
        ob = context.active_object
        size = measurements.shown_size(ob)
        present = tolerances.tolerance_length(ob.tolvol, size) if size else None
        for title, choices in offered(context, size):
            self.layout.label(text=title)
            for mode, value, text in choices:
                length_of = value if mode == "LENGTH" else value / 100 * (size or 0)
                chosen = present is not None and math.isclose(length_of, present, rel_tol=_SAME)
                choice = self.layout.operator(
                    "tolvol.set_tolerance", text=text, icon="CHECKMARK" if chosen else "BLANK1"
                )
                choice.mode, choice.value = mode, value


def offered(context, size):
    """Returns the presets as [(title, [(unit, value, text)])].

    size: the length that is 100 %, or None if it is not known. The value of a length is in the units of the file. A
    printer's millimetre is one of the scene, or a unit of the file if the file is in millimetres: Blender takes each unit of
    such a file for a metre.
    """

    def text(name, *facts):
        facts = [fact for fact in facts if fact]
        return f"{name}:  {',  '.join(facts)}" if facts else name

    def share(value):
        return size and f"{100 * value / size:.3g} % of size"

    groups = {
        "By Size": [
            ("PERCENT", percent, text(name, f"{percent:g} % of size", size and length(context, percent / 100 * size)))
            for name, percent in BY_SIZE
        ]
    }
    units = context.scene.unit_settings
    millimetre = 1 if units.system == "NONE" else 0.001 / shortest(units.scale_length)
    if not math.isclose(millimetre, 1):
        groups["For a Printer"] = [
            ("LENGTH", mm * millimetre, text(f"{mm:g} mm", share(mm * millimetre))) for mm in FOR_PRINTERS
        ]
    groups["For a Printer, File in Millimetres"] = [
        ("LENGTH", mm, text(f"{mm:g} mm", f"shown as {length(context, mm)}", share(mm))) for mm in FOR_PRINTERS
    ]
    return list(groups.items())
