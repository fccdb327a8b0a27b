# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a deviation is not shown, or not as it was asked for, as text for the panel and the view."""

import bpy

from .. import preferences
from ..reference import snapshots
from . import field

_MODES = {"OBJECT", "EDIT", "SCULPT"}

# What the graphics driver refused, once it did.
broken = []


def off():
    """Why nothing is drawn at all, or None."""
    if bpy.app.background:
        return "Blender runs without a window"
    if not preferences.use_gl(bpy.context):
        return "Drawing in 3D views is turned off in the add-on's preferences"
    return f"The graphics driver refuses it: {broken[0]}" if broken else None


def hidden(ob):
    """Why the deviation of `ob` is not shown where it should be, or None."""
    if reason := off():
        return reason
    if reason := snapshots.reference_missing(ob):
        return reason
    if ob.mode not in _MODES:
        return "Shown in Object, Edit and Sculpt Mode"
    if ob.mode == "SCULPT" and ob.use_dynamic_topology_sculpting:
        return "Not shown while sculpting with Dyntopo"
    if ob.mode == "SCULPT" and any(modifier.type == "MULTIRES" for modifier in ob.modifiers):
        return "Not shown while sculpting with Multiresolution"
    return None


def unsigned(ob):
    """Why only the magnitude is shown although the sign was asked for, or None."""
    found = field.at_hand(ob)
    if ob.tolvol.deviation_kind == "SIGNED" and found is not None and not found.tree.closed:
        return "Magnitude only: the reference is open, so it has no inside"
    return None
