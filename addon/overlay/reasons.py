# SPDX-License-Identifier: GPL-3.0-or-later
"""Says why a deviation is not shown, or not as the settings demand, for the panel and the 3D view."""

import bpy

from .. import preferences
from ..reference import snapshots
from . import field

_MODES = {"OBJECT", "EDIT", "SCULPT"}

# The error of the graphics driver, if it refused to draw.
broken = []


def off():
    """Why nothing is drawn at all, or None."""
    if bpy.app.background:
        return "Blender runs without a window"
    if not preferences.use_gl(bpy.context):
        return "Drawing in 3D views is turned off in the add-on's preferences"
    return f"The graphics driver refuses to draw the deviation: {broken[0]}" if broken else None


def hidden(ob):
    """Why the deviation of `ob` is not shown although its settings demand it, or None."""
    if reason := off():
        return reason
    if reason := snapshots.reference_missing(ob):
        return reason
    if ob.mode not in _MODES:
        return "The deviation is shown only in Object, Edit and Sculpt Mode"
    if ob.mode == "SCULPT" and ob.use_dynamic_topology_sculpting:
        return "The deviation is not shown while Dyntopo is on in Sculpt Mode"
    if ob.mode == "SCULPT" and any(modifier.type == "MULTIRES" for modifier in ob.modifiers):
        return "The deviation is not shown while a mesh with Multiresolution is sculpted"
    return None


def unsigned(ob):
    """Why only the magnitude is shown although the settings demand the sign, or None."""
    if ob.tolvol.deviation_kind != "SIGNED":
        return None
    if ob.tolvol.deviation_surface == "REFERENCE":
        return "Only the magnitude is shown on the reference"
    found = field.at_hand(ob)
    if found is not None and not found.tree.closed:
        return "Only the magnitude is shown: the reference is open, so it has no inside"
    return None
