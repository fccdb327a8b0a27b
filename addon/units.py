# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts lengths between numbers and the text that the user reads or types, in the units of the scene."""

import re

import bpy
import numpy as np

from .shared.numbers import NO_BREAK, shortest

# Blender writes all digits of an area or a volume, and cuts the text off after 63.
_LARGEST = 1e15


def length(context, value):
    """Returns a world length as text in the scene's units, with at least one digit that is not 0."""
    units = context.scene.unit_settings
    if units.system != "NONE":
        text = bpy.utils.units.to_string(units.system, "LENGTH", value * units.scale_length, precision=3)
        if value == 0 or any(digit in "123456789" for digit in text):
            return text.replace(" ", NO_BREAK)
        # Blender rounds what is less than a micrometre or a millionth of a foot to 0.
        unit = _ADAPTIVE[units.system][-1]
        return f"{value * units.scale_length / _UNITS[unit][0]:.3g}{NO_BREAK}{_UNITS[unit][1]}"
    return f"{value:.3g}"


def area(context, value):
    """Returns an area of the world as text in the scene's units, with separators of thousands."""
    return _of_power(context, value, "AREA", 2)


def volume(context, value):
    """Returns a volume in the world as text in the scene's units, with separators of thousands."""
    return _of_power(context, value, "VOLUME", 3)


def _of_power(context, value, category, power):
    units = context.scene.unit_settings
    if units.system != "NONE" and abs(value) < _LARGEST:
        text = bpy.utils.units.to_string(units.system, category, value * units.scale_length**power, precision=3)
        if value == 0 or any(digit in "123456789" for digit in text):
            grouped = re.sub(r"\d+", lambda whole: f"{int(whole[0]):,}", text, count=1)
            return grouped.replace(" ", NO_BREAK)
    return f"{value:.3g}"


# The units, in metres, in which users type lengths: metre, foot and inch. Other metric units are decimal multiples of
# the metre, and other imperial units are hardly ever typed.
_TYPED_IN = {"NONE": (), "METRIC": (1.0,), "IMPERIAL": (0.3048, 0.0254)}
# The largest error of Blender's conversion of a typed length to the units of the file, in steps of float32: both the
# scale of the scene and the length are rounded.
_STEPS = 2
_DIGITS = 6  # number of decimal digits of a float32 that such an error leaves correct


def typed(value, units):
    """Returns the length that the user typed, in the units of the file, if Blender's property holds the float32 `value`.

    In a scene in millimetres "0.5 mm" arrives as 0.49999997. Among the lengths within such an error the function takes
    the one with the fewest digits in a unit of the scene. units: the scene's unit_settings.
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


# The metres of each unit that a scene can be set to, and its short name.
_UNITS = {
    "KILOMETERS": (1000.0, "km"),
    "METERS": (1.0, "m"),
    "CENTIMETERS": (0.01, "cm"),
    "MILLIMETERS": (0.001, "mm"),
    "MICROMETERS": (1e-6, "µm"),
    "MILES": (1609.344, "mi"),
    "FEET": (0.3048, "ft"),
    "INCHES": (0.0254, "in"),
    "THOU": (0.0000254, "thou"),
}
# Of these a scene with an adaptive unit takes the largest that the length reaches.
_ADAPTIVE = {
    "METRIC": ("KILOMETERS", "METERS", "MILLIMETERS", "MICROMETERS"),
    "IMPERIAL": ("MILES", "FEET", "INCHES", "THOU"),
}


def chosen_unit(context, length):
    """Returns the name of the scene's unit, and the factor from world lengths to it.

    length: in the world; an adaptive scene gets a unit that suits it. A scene without units has "units".
    """
    settings = context.scene.unit_settings
    if settings.system == "NONE":
        return "units", 1.0
    scale = shortest(settings.scale_length)
    named = [settings.length_unit] if settings.length_unit in _UNITS else _ADAPTIVE[settings.system]
    fitting = [name for name in named if length * scale >= _UNITS[name][0]]
    metres, name = _UNITS[fitting[0] if fitting else named[-1]]
    return name, scale / metres
