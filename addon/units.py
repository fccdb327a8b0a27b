# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths as a person reads them, in the scene's units."""

import bpy

NO_BREAK = "\u00a0"  # between a number and its unit


def length(context, value):
    """A world length in the scene's units, with enough digits to mean something."""
    units = context.scene.unit_settings
    if units.system != "NONE":
        text = bpy.utils.units.to_string(units.system, "LENGTH", value * units.scale_length, precision=3)
        if value == 0 or any(digit in "123456789" for digit in text):
            return text.replace(" ", NO_BREAK)
    return f"{value:.3g}"
