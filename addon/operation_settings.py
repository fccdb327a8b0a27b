# SPDX-License-Identifier: GPL-3.0-or-later
"""Declares the settings of the operations once, for the operator that uses them and for the object that stores them.

Each function returns {name: property}. `options` are Blender's property options for all of these properties.
"""

import math

from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    IntVectorProperty,
    StringProperty,
)

from .shared.decimation import FEWEST_LEVELS, MOST_LEVELS

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


def threads_setting():
    """Returns the property of every operator that runs jobs: the number of threads, or 0 for that of the preferences."""
    return IntProperty(options={"HIDDEN", "SKIP_SAVE"}, min=0)


def decimate_settings(options=frozenset()):
    """Returns all settings except the placement (properties/choices.py), whose default depends on the mesh."""
    return {
        "keep": EnumProperty(
            name="Keep",
            description="The directions in which the tolerance has to hold, for every operation except Fit",
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
                ("FAST", "Fast", "Remove triangles by collapsing edges, each by itself"),
                (
                    "THOROUGH",
                    "Thorough",
                    "After Fast, move vertices around each further collapse together. This leaves a "
                    "third fewer triangles in 5 to 25 times the processor time. Some hundred triangles may take 75 "
                    "times as long, and 20 seconds",
                ),
            ),
            options=set(options),
        ),
        "crossings": EnumProperty(
            name="Crossings",
            description="Whether faces may come to cross each other, for every operation except the guards",
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
        "outside": EnumProperty(
            name="Outside",
            description="How Decimate treats faces that are not within the tolerance of the reference before it begins",
            items=(
                ("ERROR", "Stop", "Change nothing and report the number of such faces"),
                ("KEEP", "Keep", "Leave such faces as they are and decimate the rest"),
            ),
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
            description="Leave holes open whose rim is longer than this length. 0 means no limit. It takes effect while "
            "Holes: Close is ticked under Decimate",
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


def lod_settings(options=frozenset(), in_length=None):
    """Returns the settings of a chain of levels of detail. Each vector has a number for each of the most levels.

    in_length: further arguments for this property.
    """
    return {
        "by": EnumProperty(
            name="By",
            description="What is given for each level",
            items=(
                (
                    "TOLERANCE",
                    "Tolerance",
                    "A tolerance for each level, within which it has as few triangles as possible",
                ),
                (
                    "COUNT",
                    "Count",
                    "A number of triangles for each level. How far it deviates is found out. No level may deviate by more "
                    "than 10 % of the size",
                ),
                (
                    "PIXELS",
                    "Pixels",
                    "A number of pixels for each level, which its deviation may cover in a picture from a distance",
                ),
            ),
            options=set(options),
        ),
        "levels": IntProperty(
            name="Levels",
            description="The number of levels",
            default=3,
            min=FEWEST_LEVELS,
            max=MOST_LEVELS,
            options=set(options),
        ),
        "in_length": BoolProperty(
            name="As Lengths",
            description="Give the tolerances as lengths in the world, and not in percent of the reference's size",
            options=set(options),
            **(in_length or {}),
        ),
        "percentages": FloatVectorProperty(
            name="Tolerances",
            description="The tolerance of each level, in percent of the reference's size",
            size=MOST_LEVELS,
            default=(0.1, 0.5, 2, 4, 8, 16),
            min=1e-5,
            max=100,
            precision=3,
            options=set(options),
        ),
        "lengths": FloatVectorProperty(
            name="Tolerances",
            description="The tolerance of each level",
            size=MOST_LEVELS,
            default=(0.001, 0.005, 0.02, 0.04, 0.08, 0.16),
            min=1e-12,
            precision=4,
            unit="LENGTH",
            options=set(options),
        ),
        "counts": IntVectorProperty(
            name="Triangles",
            description="The number of triangles of each level",
            size=MOST_LEVELS,
            default=(10_000, 3000, 1000, 300, 100, 30),
            min=1,
            options=set(options),
        ),
        "pixels": FloatVectorProperty(
            name="Pixels",
            description="The number of pixels that the deviation of each level may cover",
            size=MOST_LEVELS,
            default=(1, 2, 4, 8, 16, 32),
            min=0.001,
            precision=2,
            options=set(options),
        ),
        "distance": FloatProperty(
            name="Distance",
            description="The distance from the camera at which the pixels are counted",
            default=10,
            min=1e-6,
            subtype="DISTANCE",
            options=set(options),
        ),
        "fov": FloatProperty(
            name="Field of View",
            description="The vertical angle of view of the camera",
            default=math.radians(50),
            min=math.radians(1),
            max=math.radians(179),
            subtype="ANGLE",
            options=set(options),
        ),
        "height": IntProperty(
            name="Height",
            description="The height of the picture in pixels",
            default=1080,
            min=1,
            subtype="PIXEL",
            options=set(options),
        ),
    }


def bake_settings(options=frozenset()):
    return {
        "image_size": IntProperty(
            name="Image Size",
            description="Width and height of the normal map",
            default=2048,
            min=64,
            max=16384,
            subtype="PIXEL",
            options=set(options),
        ),
        "shade": BoolProperty(
            name="Shade First",
            description="First shade the mesh smooth by the reference's normals. The normal map then holds only the details "
            "that this shading lacks. Without Shade First, the map belongs to the present shading",
            default=True,
            options=set(options),
        ),
    }
