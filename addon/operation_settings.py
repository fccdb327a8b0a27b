# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the operations, declared once for the operator that uses them and the panel that keeps them.

Each function returns name -> property; `options` are Blender's property options for all of them.
"""

from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

PROTECTED = (
    ("BOUNDARY", "Boundary", "Edges of one face", 1),
    ("SHARP", "Sharp", "Edges marked sharp", 2),
    ("SEAM", "Seams", "Edges marked as seam", 4),
    ("CREASE", "Creases", "Edges with a crease", 8),
    ("MATERIAL", "Materials", "Edges between faces of different materials", 16),
    ("UV", "UV Islands", "Edges where the islands of a UV map meet", 32),
)


def _vertex_group(description, options):
    return {
        "vertex_group": StringProperty(name="Vertex Group", description=description, options=set(options)),
        "invert_vertex_group": BoolProperty(
            name="Invert", description="Take the weights the other way around", options=set(options)
        ),
    }


def decimate_settings(options=frozenset()):
    """All but the placement, whose default depends on the mesh."""
    return {
        "keep": EnumProperty(
            name="Keep",
            description="Which way the tolerance holds",
            items=(
                (
                    "BOTH",
                    "Both Ways",
                    "The result stays within the tolerance of the reference, and the reference within the tolerance of "
                    "the result, so nothing is lost",
                ),
                (
                    "ONE",
                    "One Way",
                    "The result stays within the tolerance of the reference. Parts of the reference may vanish; its "
                    "borders and separate pieces stay",
                ),
            ),
            options=set(options),
        ),
        "use_target": BoolProperty(
            name="Stop At",
            description="Stop at a number of triangles, if the tolerance lets it get that far",
            options=set(options),
        ),
        "target_triangles": IntProperty(
            name="Triangles",
            description="The number of triangles to stop at; the tolerance holds, whichever comes first",
            default=5000,
            min=1,
            soft_max=1_000_000,
            options=set(options),
        ),
        "effort": EnumProperty(
            name="Effort",
            description="How much time to spend on fewer triangles",
            items=(
                ("FAST", "Fast", "One pass"),
                (
                    "THOROUGH",
                    "Thorough",
                    "Then moves vertices and flips edges to remove more, until that brings nothing: about a sixth fewer "
                    "triangles in two to four times the time",
                ),
            ),
            options=set(options),
        ),
        "max_seconds": FloatProperty(
            name="Time Limit",
            description="Seconds after which an object is left with what is proved by then; 0 for no limit",
            min=0,
            soft_max=600,
            step=100,
            precision=0,
            options=set(options),
        ),
        "only_selected": BoolProperty(
            name="Selected Faces Only",
            description="Decimate the faces that are selected in Edit Mode and leave all others exactly as they are",
            options=set(options),
        ),
        "protect": EnumProperty(
            name="Protect",
            description="Edges that stay exactly where they are, with all their vertices",
            items=PROTECTED,
            options={"ENUM_FLAG", *options},
        ),
        "symmetry": EnumProperty(
            name="Symmetry",
            description="Vertices on these planes through the object's origin stay exactly where they are",
            items=tuple((axis, axis, f"The plane where {axis} is 0, in the object's own axes") for axis in "XYZ"),
            options={"ENUM_FLAG", *options},
        ),
    } | _vertex_group(
        "How much of the tolerance may be used: vertices of weight 0 stay where they are, around those of "
        "weight 0.5 the result stays within half the tolerance of the reference",
        options,
    )


def smooth_settings(options=frozenset()):
    return {
        "iterations": IntProperty(
            name="Iterations",
            description="How often to smooth",
            default=10,
            min=1,
            soft_max=100,
            max=10_000,
            options=set(options),
        ),
        "method": EnumProperty(
            name="Method",
            description="What smoothing strives for",
            items=(
                ("BILAPLACIAN", "Bilaplacian", "Even curvature: smooths noise and keeps the large shape"),
                ("LAPLACIAN", "Laplacian", "Small area: smooths faster and shrinks what is thin"),
            ),
            options=set(options),
        ),
        "weights": EnumProperty(
            name="Weights",
            description="How much each neighbour of a vertex counts",
            items=(
                ("COTANGENT", "By Shape", "By the angles between them: triangles keep their proportions"),
                ("UNIFORM", "Alike", "All the same: triangles become even, too"),
            ),
            options=set(options),
        ),
        "boundary": EnumProperty(
            name="Boundary",
            description="What becomes of open borders",
            items=(
                ("FIXED", "Fixed", "Their vertices stay where they are"),
                ("ALONG", "Smooth", "They are smoothed, as lines"),
            ),
            options=set(options),
        ),
    } | _vertex_group(
        "Strength for each vertex: those of weight 0 stay where they are",
        options,
    )


def modifier_settings(options=frozenset()):
    return {
        "result": EnumProperty(
            name="Result",
            description="Where the result goes",
            items=(
                ("REPLACE", "Replace", "Into the mesh; the modifier is removed"),
                ("OBJECT", "New Object", "Into a copy of the object without the modifier; this one stays as it is"),
                (
                    "SHAPE_KEY",
                    "Shape Key",
                    "Into a new shape key, which is within the tolerance at its full value; the modifier is removed. "
                    "Not where the modifier changes the faces",
                ),
            ),
            options=set(options),
        ),
    }
