# SPDX-License-Identifier: GPL-3.0-or-later
"""Declares the settings of the operations once, for the operator that uses them and for the object that stores them.

Each function returns {name: property}. `options` are Blender's property options for all of these properties.
"""

import math

from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

PROTECTED = (
    ("BOUNDARY", "Boundary", "Edges that belong to only one face", 1),
    ("SHARP", "Sharp", "Edges that are marked as sharp", 2),
    ("SEAM", "Seams", "Edges that are marked as seams", 4),
    ("CREASE", "Creases", "Edges with a crease", 8),
    ("MATERIAL", "Materials", "Edges between faces of different materials", 16),
    ("UV", "UV Islands", "Edges where islands of a UV map meet", 32),
)


def _vertex_group(description, options):
    return {
        "vertex_group": StringProperty(name="Vertex Group", description=description, options=set(options)),
        "invert_vertex_group": BoolProperty(name="Invert", description="Use 1 minus each weight", options=set(options)),
    }


def decimate_settings(options=frozenset()):
    """Returns all settings except the placement: its default depends on the mesh, so it is declared elsewhere."""
    return {
        "keep": EnumProperty(
            name="Keep",
            description="The directions in which the tolerance has to hold, for every operation except Fit, the lattice guard "
            "and guards of meshes with faces of more than four corners",
            items=(
                (
                    "BOTH",
                    "Both Ways",
                    "Every point of the result stays within the tolerance of the reference, and every point of the "
                    "reference within the tolerance of the result",
                ),
                (
                    "ONE",
                    "One Way",
                    "Every point of the result stays within the tolerance of the reference. Parts of the reference, such "
                    "as thin spikes, may vanish. Decimation still keeps borders and separate pieces",
                ),
            ),
            options=set(options),
        ),
        "use_target": BoolProperty(
            name="Stop At",
            description="Stop at a number of triangles. More remain if the tolerance does not permit so few",
            options=set(options),
        ),
        "target_triangles": IntProperty(
            name="Triangles",
            description="The number of triangles to stop at. More remain if the tolerance does not permit so few",
            default=5000,
            min=1,
            soft_max=1_000_000,
            options=set(options),
        ),
        "effort": EnumProperty(
            name="Effort",
            description="How much time the decimation may spend to leave fewer triangles",
            items=(
                ("FAST", "Fast", "Remove triangles in one pass"),
                (
                    "THOROUGH",
                    "Thorough",
                    "After the pass of Fast, move the vertices around each further collapse together. This leaves a "
                    "third fewer triangles in 4 to 16 times the processor time, at a tolerance of 0.1 % in 10 to 30 "
                    "times",
                ),
            ),
            options=set(options),
        ),
        "crossings": EnumProperty(
            name="Crossings",
            description="Whether faces may come to cross each other, for every operation except Fit and the guards",
            items=(
                (
                    "KEEP_OUT",
                    "Keep Out",
                    "No faces cross in the result that did not cross before. Thin walls keep more triangles",
                ),
                ("ALLOW", "Allow", "Faces may come to cross, as the two sides of a thin wall do"),
            ),
            options=set(options),
        ),
        "max_normal_angle": FloatProperty(
            name="Normals",
            description="The largest angle between a face of the result and the faces of the reference that it stands for. "
            "90 turns no face over, and 180 permits any angle",
            default=math.pi / 2,
            min=math.radians(1),
            max=math.pi,
            subtype="ANGLE",
            options=set(options),
        ),
        "max_seconds": FloatProperty(
            name="Time Limit",
            description="Seconds after which the decimation of an object ends with the result that is proved by then. 0 "
            "means no limit",
            min=0,
            soft_max=600,
            step=100,
            precision=0,
            options=set(options),
        ),
        "close_holes": BoolProperty(
            name="Close Holes",
            description="First fill the holes that can be filled within the tolerance, such as the pinholes of a scan. "
            "Far fewer triangles are left then. The ends of a tube thinner than the tolerance are holes, too",
            options=set(options),
        ),
        "largest_perimeter": FloatProperty(
            name="Largest Perimeter",
            description="Leave holes open whose rim is longer than this length. 0 means no limit",
            min=0,
            soft_max=10,
            step=1,
            precision=5,
            subtype="DISTANCE",
            options=set(options),
        ),
        "only_selected": BoolProperty(
            name="Selected Faces Only",
            description="Decimate the faces that are selected in Edit Mode, and leave all other faces exactly as they are",
            options=set(options),
        ),
        "protect": EnumProperty(
            name="Protect",
            description="Edges of these kinds stay exactly where they are, with all their vertices",
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
        "Weights that scale the tolerance: vertices of weight 0 stay where they are, and around vertices of weight 0.5 "
        "the result stays within half the tolerance of the reference",
        options,
    )


def smooth_settings(options=frozenset()):
    return {
        "iterations": IntProperty(
            name="Iterations",
            description="The number of smoothing steps",
            default=10,
            min=1,
            soft_max=100,
            max=10_000,
            options=set(options),
        ),
        "method": EnumProperty(
            name="Method",
            description="The property of the surface that smoothing improves",
            items=(
                (
                    "BILAPLACIAN",
                    "Bilaplacian",
                    "Make the curvature even, which removes noise and keeps the large shape",
                ),
                ("LAPLACIAN", "Laplacian", "Make the area small, which smooths faster and shrinks thin parts"),
            ),
            options=set(options),
        ),
        "weights": EnumProperty(
            name="Weights",
            description="How much each neighbour of a vertex counts",
            items=(
                (
                    "COTANGENT",
                    "By Shape",
                    "Weigh neighbours by the angles of the triangles, which keep their proportions",
                ),
                ("UNIFORM", "Alike", "Weigh all neighbours equally, which makes the triangles even as well"),
            ),
            options=set(options),
        ),
        "boundary": EnumProperty(
            name="Boundary",
            description="How vertices on open borders move",
            items=(
                ("FIXED", "Fixed", "Vertices on open borders stay where they are"),
                ("ALONG", "Smooth", "Open borders are smoothed as lines"),
            ),
            options=set(options),
        ),
    } | _vertex_group(
        "Weights that scale the smoothing of each vertex: vertices of weight 0 stay where they are",
        options,
    )


def modifier_settings(options=frozenset()):
    return {
        "result": EnumProperty(
            name="Result",
            description="Where the result is stored",
            items=(
                ("REPLACE", "Replace", "Store the result in the mesh and remove the modifier"),
                (
                    "OBJECT",
                    "New Object",
                    "Store the result in a copy of the object without the modifier. This object stays as it is",
                ),
                (
                    "SHAPE_KEY",
                    "Shape Key",
                    "Store the result in a new shape key, which is within the tolerance at its full value, and remove the "
                    "modifier. This is not possible for a modifier that changes the faces",
                ),
            ),
            options=set(options),
        ),
    }
