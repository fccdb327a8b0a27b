# SPDX-License-Identifier: GPL-3.0-or-later
"""What an operator and an object both let the user choose, declared once: tolerance, placement, ways to deform."""

import bpy
from bpy.props import EnumProperty, FloatProperty, StringProperty

from .. import preferences

# How a length above 0 is entered. Dragging stops at the soft ends, and typing does not.
# Blender 3.4 makes of this step one of a millimetre: for a pixel of dragging, or a click on an arrow.
LENGTH = {"min": 1e-12, "soft_min": 1e-5, "soft_max": 1.0, "step": 0.01, "precision": 4, "subtype": "DISTANCE"}

TOLERANCE_UNITS = (
    ("PERCENT", "% of Size", "Percent of the longest diagonal of the reference's bounding box"),
    ("LENGTH", "Length", "A length in the world, which does not depend on the size of the reference"),
)


def tolerance_settings(options=frozenset(), unit=None, percent=None, length=None):
    """Returns {name: property} of the tolerance.

    options: Blender's property options for all of them. unit, percent, length: further arguments for one property each.
    """
    return {
        "tolerance_mode": EnumProperty(
            name="Tolerance Unit",
            description="The unit of the tolerance",
            items=TOLERANCE_UNITS,
            options=set(options),
            **(unit or {}),
        ),
        "tolerance_percent": FloatProperty(
            name="Tolerance",
            description="How far the mesh may lie from the reference, in percent of the reference's size",
            default=preferences.TOLERANCE,
            **preferences.PERCENT,
            options=set(options),
            **(percent or {}),
        ),
        "tolerance_length": FloatProperty(
            name="Tolerance",
            description="How far the mesh may lie from the reference. Hold Shift to drag in fine steps",
            default=0.01,
            **LENGTH,
            options=set(options),
            **(length or {}),
        ),
        # Blender's FloatProperty is float32, which is too coarse for a converted value: these keep it in double.
        "tolerance_percent_converted": StringProperty(
            description="All digits of the percentage if it was converted from a length",
            options={"HIDDEN", *options},
        ),
        "tolerance_length_converted": StringProperty(
            description="All digits of the length if it was converted from a percentage",
            options={"HIDDEN", *options},
        ),
    }


PLACEMENTS = (
    (
        "OPTIMAL",
        "Fewest Triangles",
        "Vertices move to the places that save most triangles. UV maps and attributes are interpolated",
    ),
    (
        "SUBSET",
        "Original Vertices",
        "Every remaining vertex is a vertex of the original mesh, with its UVs and attributes exactly as they are",
    ),
)


DEFORM_MODES = (
    ("BLOCKED", "Stop", "Change nothing and report which share of the deformation the tolerance permits"),
    (
        "FARTHEST",
        "As Far as Permitted",
        "Move all vertices by the same share of the deformation, the largest that the tolerance permits",
    ),
    ("PULL_BACK", "Pull Back", "Move each vertex all the way, or as far as the tolerance permits at that vertex"),
)


def placement_setting(**more):
    """Returns the property of the placement. more: further arguments of EnumProperty."""
    return EnumProperty(
        name="Placement",
        description="How the positions of the remaining vertices are chosen",
        items=PLACEMENTS,
        **more,
    )


def deform_mode_setting(**more):
    """Returns the property of what happens beyond the tolerance. more: further arguments of EnumProperty."""
    return EnumProperty(
        name="Beyond",
        description="How to treat a deformation that would leave the tolerance",
        items=DEFORM_MODES,
        **more,
    )


def automatic_placement(mesh):
    """Returns the placement until one is chosen: the one that keeps UVs exactly, if the mesh has UV maps."""
    return "SUBSET" if isinstance(mesh, bpy.types.Mesh) and mesh.uv_layers else "OPTIMAL"
