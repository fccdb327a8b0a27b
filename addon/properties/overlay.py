# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of Show Deviation."""

from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ..reference import snapshots
from .choices import LENGTH

DEVIATION_SURFACES = (
    ("MESH", "Mesh", "Colour the mesh by its distance to the reference"),
    (
        "REFERENCE",
        "Reference",
        "Colour the reference by its distance to the mesh, over everything else: it shows what the mesh has lost, such as a "
        "part in which a hole was cut",
    ),
)


DEVIATION_PALETTES = (
    ("SAFE", "For All Eyes", "Colours that can be told apart by the colour-blind, too"),
    ("NOMINAL", "Green to Red", "Green where nothing deviates, red at the end; what is inside the reference is blue"),
)


DEVIATION_KINDS = (
    ("SIGNED", "Signed", "Show the distance with its side: blue is inside the reference, red is outside"),
    ("MAGNITUDE", "Magnitude", "Show the distance without its side"),
)


DEVIATION_RANGES = (
    ("TOLERANCE", "Tolerance", "The colours end at the tolerance"),
    ("AUTOMATIC", "Automatic", "The colours end at the largest distance of the mesh, or at the next round number"),
    ("FIXED", "Fixed", "The colours end at a length, so that the colours of several objects can be compared"),
)


def changed(_settings, _context):
    snapshots.notify()


class ShowDeviation:
    """A base class of the settings of an object."""

    show_deviation: BoolProperty(
        name="Show Deviation",
        description="Colour the mesh, or its reference, in the 3D view by the distance while it changes. Parts beyond the "
        "tolerance are striped. The colours prove nothing: use Check for a proof",
        default=True,
        update=changed,
    )
    deviation_surface: EnumProperty(
        name="Surface",
        description="The surface that is coloured",
        items=DEVIATION_SURFACES,
        update=changed,
    )
    deviation_palette: EnumProperty(
        name="Colours",
        description="The colours that stand for the distances",
        items=DEVIATION_PALETTES,
        update=changed,
    )
    deviation_kind: EnumProperty(
        name="Deviation",
        description="How the colours show the distance",
        items=DEVIATION_KINDS,
        update=changed,
    )
    deviation_opacity: FloatProperty(
        name="Opacity",
        description="The opacity of the colours over the mesh",
        default=0.8,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=changed,
    )

    deviation_range: EnumProperty(
        name="Range",
        description="The distance at which the colours end. Parts beyond the tolerance are striped in any case",
        items=DEVIATION_RANGES,
        update=changed,
    )
    deviation_limit: FloatProperty(
        name="Limit",
        description="The distance at which the colours end. Larger distances have the last colour",
        default=0.01,
        **LENGTH,
        update=changed,
    )
    use_bands: BoolProperty(
        name="Bands",
        description="Show the distance in bands of one colour each instead of a smooth change",
        update=changed,
    )
    band_count: IntProperty(
        name="Number of Bands",
        description="The number of bands between the first and the last colour. With an odd number, one of them is around 0",
        default=9,
        min=2,
        max=20,
        update=changed,
    )
