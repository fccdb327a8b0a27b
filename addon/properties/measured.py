# SPDX-License-Identifier: GPL-3.0-or-later
"""What the .blend file keeps of measurements: the certified distances of a mesh, and the labels of the probe."""

import math

import bpy
from bpy.props import BoolProperty, FloatProperty, FloatVectorProperty, StringProperty


def _double(name):
    """Returns a property that holds a number in double precision in the text property `name`.

    Blender's own numbers are float32, and rounding could change the verdict. The property is nan if the text is not a
    number.
    """

    def read(group):
        try:
            return float(getattr(group, name))
        except ValueError:
            return math.nan

    def write(group, value):
        setattr(group, name, repr(float(value)))

    return property(read, write)


_LENGTHS = {
    "tolerance": "The tolerance that the distances were compared with",
    "size": "The size of the reference when the mesh was measured",
    "forward_lower": "Some point of the mesh is at least this far from the reference",
    "forward": "No point of the mesh is farther from the reference than this",
    "backward_lower": "Some point of the reference is at least this far from the mesh",
    "backward": "No point of the reference is farther from the mesh than this",
}


class TOLVOL_PG_measurement(bpy.types.PropertyGroup):
    """The certified distances of one state of a mesh, in world units."""

    __annotations__ = {
        "fingerprint": StringProperty(
            description="The fingerprint of the measured mesh. It is empty if none was measured"
        ),
        "matrix": FloatVectorProperty(size=16, description="The matrix of the object when the mesh was measured"),
        "share_outside": FloatProperty(description="Share of the mesh's area that is beyond the tolerance"),
        "statistics": StringProperty(
            description="Mean and the like of this state, as JSON. It is empty if not measured"
        ),
        "time": StringProperty(description="When the mesh was measured: local time with its offset, ISO 8601"),
    } | {f"{name}_digits": StringProperty(description=text) for name, text in _LENGTHS.items()}

    tolerance, size = _double("tolerance_digits"), _double("size_digits")
    forward_lower, forward = _double("forward_lower_digits"), _double("forward_digits")
    backward_lower, backward = _double("backward_lower_digits"), _double("backward_digits")

    @property
    def complete(self):
        """Whether a mesh was measured and all its distances can be read."""
        return bool(self.fingerprint) and not any(math.isnan(getattr(self, name)) for name in _LENGTHS)


class TOLVOL_PG_label(bpy.types.PropertyGroup):
    """The distance at one point of the mesh or of its reference, and the state in which it was read."""

    place: FloatVectorProperty(size=3, description="The point, in the space of the object")
    on_reference: BoolProperty(description="Whether it is a point of the reference and not of the mesh")
    side: StringProperty(
        description="The side of the other surface on which the point lies. It is empty if none is known"
    )
    share: FloatProperty(default=1, description="Share of the tolerance that Decimate may use there")
    distance_digits: StringProperty(description="The distance of the point from the other surface")
    fingerprint: StringProperty(description="The fingerprint of the mesh that was read")
    matrix: FloatVectorProperty(size=16, description="The matrix of the object when the distance was read")
    reference: StringProperty(description="The reference from which the distance was read, and its place")

    distance = _double("distance_digits")
