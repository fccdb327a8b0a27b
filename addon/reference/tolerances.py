# SPDX-License-Identifier: GPL-3.0-or-later
"""The tolerance that is set, as a length, in double precision, whatever unit it was typed in."""

import math

import bpy
import numpy as np

from ..units import shortest, typed


def tolerance_length(settings, size):
    """The tolerance in world units, in double; `settings` has what properties.tolerance_settings() declares."""
    if settings.tolerance_mode == "LENGTH":
        return _chosen(settings, "tolerance_length")
    return _chosen(settings, "tolerance_percent") / 100 * size


def _chosen(settings, name):
    """What is chosen, in double: what was converted from the other unit, or the decimal that a person typed."""
    value = getattr(settings, name)
    try:
        converted = float(getattr(settings, f"{name}_converted"))
    except ValueError:
        converted = math.nan
    if np.float32(converted) == np.float32(value):
        return converted
    return typed(value, bpy.context.scene.unit_settings) if name == "tolerance_length" else shortest(value)


def convert_tolerance(settings, size, mode):
    """Makes the tolerance in unit `mode` equal to that in the other unit, in double."""
    if mode == "LENGTH":
        name, value = "tolerance_length", _chosen(settings, "tolerance_percent") / 100 * size
    else:
        name, value = "tolerance_percent", 100 * _chosen(settings, "tolerance_length") / size
        # There and back again is the number that was typed.
        if math.isclose(shortest(value), value, rel_tol=1e-15):
            value = shortest(value)
    setattr(settings, name, value)
    setattr(settings, f"{name}_converted", repr(value))
