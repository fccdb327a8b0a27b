# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the tolerance as a length in double precision, whether it was typed in percent or as a length."""

import math

import bpy
import numpy as np

from ..shared.errors import Refused
from ..shared.numbers import shortest
from ..units import typed
from . import snapshots

# A converted number with at most so many digits but for this relative rounding error is meant to be the number of these
# digits.
_DIGITS, _ROUNDING = 12, 1e-15
# The same for a number that was rounded to float32.
_SINGLE_DIGITS, _SINGLE_ROUNDING = 6, 1.5e-7


def tolerance_length(settings, size):
    """Returns the tolerance in world units. `settings` has the properties of properties.tolerance_settings().

    size: of the reference, in world units. A damaged file may hold any number: see required().
    """
    if settings.tolerance_mode == "LENGTH":
        return _chosen(settings, "tolerance_length")
    return _chosen(settings, "tolerance_percent") / 100 * size


def required(ob, size):
    """Returns the tolerance of an object in world units. Raises Refused if a damaged file holds no length."""
    tolerance = tolerance_length(ob.tolvol, size)
    if not snapshots.sound(tolerance):
        raise Refused(f"The tolerance of {ob.name} in the file is damaged: enter it again")
    return tolerance


def set_length(settings, length):
    """Sets the tolerance to a length in double precision."""
    settings.tolerance_mode = "LENGTH"
    settings.tolerance_length = length
    settings.tolerance_length_converted = repr(length)


def _chosen(settings, name):
    """Returns a property in double precision: the value converted from the other unit, or the decimal that was typed."""
    value = getattr(settings, name)
    try:
        converted = float(getattr(settings, f"{name}_converted"))
    except ValueError:
        converted = math.nan
    if np.float32(converted) == np.float32(value):
        return converted
    return typed(value, bpy.context.scene.unit_settings) if name == "tolerance_length" else shortest(value)


def converted(value, size, mode):
    """Returns the value of a tolerance in the unit `mode` that is the same length as `value`, a float32, in the other unit."""
    units = bpy.context.scene.unit_settings
    found = shortest(value) / 100 * size if mode == "LENGTH" else 100 * typed(value, units) / size
    # A number that is converted to the other unit and back has to be the typed number again, without rounding errors.
    decimal = float(f"{found:.{_SINGLE_DIGITS}g}")
    return decimal if math.isclose(decimal, found, rel_tol=_SINGLE_ROUNDING) else found


def convert_levels(settings, size, mode):
    """Sets the tolerances of levels of detail in the unit `mode` to the same lengths as in the other unit."""
    names = ("percentages", "lengths") if mode == "LENGTH" else ("lengths", "percentages")
    setattr(settings, names[1], [converted(value, size, mode) for value in getattr(settings, names[0])])


def convert_tolerance(settings, size, mode):
    """Sets the tolerance in the unit `mode` to the same length as in the other unit, in double precision."""
    if mode == "LENGTH":
        name, value = "tolerance_length", _chosen(settings, "tolerance_percent") / 100 * size
    else:
        name, value = "tolerance_percent", 100 * _chosen(settings, "tolerance_length") / size
    # A number that is converted to the other unit and back has to be the typed number again, without rounding errors.
    decimal = float(f"{value:.{_DIGITS}g}")
    if math.isclose(decimal, value, rel_tol=_ROUNDING):
        value = decimal
    setattr(settings, name, value)
    setattr(settings, f"{name}_converted", repr(value))
