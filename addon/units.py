# SPDX-License-Identifier: GPL-3.0-or-later
"""Lengths as a person reads them, in the scene's units."""

import bpy
import numpy as np

NO_BREAK = "\u00a0"  # between a number and its unit


def length(context, value):
    """A world length in the scene's units, with enough digits to mean something."""
    units = context.scene.unit_settings
    if units.system != "NONE":
        text = bpy.utils.units.to_string(units.system, "LENGTH", value * units.scale_length, precision=3)
        if value == 0 or any(digit in "123456789" for digit in text):
            return text.replace(" ", NO_BREAK)
    return f"{value:.3g}"


def shortest(value):
    """The shortest decimal that Blender's float32 property stands for: the number that a person typed."""
    return float(str(np.float32(value)))


# Metres. Smaller and larger ones of each system are decimal parts of these, or hardly ever typed.
_TYPED_IN = {"NONE": (), "METRIC": (1.0,), "IMPERIAL": (0.3048, 0.0254)}
# What Blender's conversion of a typed length to the units of the file may be off by, in steps of float32: the scale of
# the scene and the length are both rounded.
_STEPS = 2
_DIGITS = 6  # of float32, those that such an error leaves


def typed(value, units):
    """The length, in the units of the file, that a person typed, where Blender's property holds float32 `value`.

    In a scene in millimetres "0.5 mm" arrives as 0.49999997: of the lengths that are that near, the one with the fewest
    digits in a unit of the scene was meant. units: the scene's unit_settings.
    """
    value = np.float32(value)
    length = shortest(value)
    digits = len(f"{length:.8e}".split("e")[0].rstrip("0").replace(".", ""))
    scale, reach = shortest(units.scale_length), _STEPS * float(np.spacing(np.abs(value)))
    for metres in _TYPED_IN[units.system]:
        for count in range(1, min(_DIGITS + 1, digits)):
            wanted = float(f"{float(value) * scale / metres:.{count - 1}e}") * metres / scale
            if abs(wanted - float(value)) <= reach:
                digits, length = count, wanted
                break
    return length
