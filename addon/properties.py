# SPDX-License-Identifier: GPL-3.0-or-later
"""Declares the properties at Object.tolvol, which the panel shows and the .blend file keeps."""

import math

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import preferences
from .operation_settings import bake_settings, decimate_settings, lod_settings, modifier_settings, smooth_settings
from .redraw import redraw_views
from .reference import measurements, snapshots, tolerances

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
            description="How far the mesh may lie from the reference",
            default=0.01,
            min=1e-12,
            soft_max=1.0,
            step=1,
            precision=5,
            subtype="DISTANCE",
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
    ("BLOCKED", "Block", "Change nothing and report which share of the deformation the tolerance permits"),
    (
        "FARTHEST",
        "As Far as Permitted",
        "Move all vertices by the same share of the deformation, the largest that the tolerance permits",
    ),
    ("PULL_BACK", "Pull Back", "Move each vertex all the way, or as far as the tolerance permits at that vertex"),
)


def automatic_placement(mesh):
    """Returns the placement until one is chosen: the one that keeps UVs exactly, if the mesh has UV maps."""
    return "SUBSET" if isinstance(mesh, bpy.types.Mesh) and mesh.uv_layers else "OPTIMAL"


def _get_placement(settings):
    if settings.placement_choice >= 0:
        return settings.placement_choice
    return [name for name, *_ in PLACEMENTS].index(automatic_placement(settings.id_data.data))


def _set_placement(settings, value):
    settings.placement_choice = value


def _get_percent(settings):
    """Returns the chosen percentage, or the default of the preferences if none was chosen or if the file is damaged."""
    choice = settings.percent_choice
    return choice if snapshots.sound(choice) else preferences.tolerance(bpy.context)


def _set_percent(settings, value):
    settings.percent_choice = value


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


class TOLVOL_PG_smooth(bpy.types.PropertyGroup):
    __annotations__ = smooth_settings()


class TOLVOL_PG_modifiers(bpy.types.PropertyGroup):
    __annotations__ = modifier_settings()


class TOLVOL_PG_lod(bpy.types.PropertyGroup):
    __annotations__ = lod_settings()


class TOLVOL_PG_bake(bpy.types.PropertyGroup):
    __annotations__ = bake_settings()


def _changed(_settings, _context):
    snapshots.notify()


def _percent_changed(settings, _context):
    settings.tolerance_percent_converted = ""
    snapshots.notify()


def _length_changed(settings, _context):
    settings.tolerance_length_converted = ""
    snapshots.notify()


def _label_chosen(_settings, _context):
    redraw_views()


def _unit_changed(settings, _context):
    """Converts the tolerance to the chosen unit, so that it stays the same length."""
    mode, size = settings.tolerance_mode, measurements.shown_size(settings.id_data)
    if mode != (settings.tolerance_mode_before or "PERCENT") and size:
        tolerances.convert_tolerance(settings, size, mode)
    settings.tolerance_mode_before = mode
    snapshots.notify()


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
    ("SAFE", "Safe for All Eyes", "Colours that can be told apart by the colour-blind, too"),
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


class TOLVOL_PG_guard(bpy.types.PropertyGroup):
    """The settings that choose which of Blender's own tools are kept within the tolerance."""

    sculpting: BoolProperty(
        name="Sculpting",
        description="Stop vertices at the tolerance while a stroke goes on in Sculpt Mode. If a face has more than four corners, "
        "the tolerance is kept one way, and faces may turn over",
    )
    editing: BoolProperty(
        name="Editing",
        description="Stop vertices at the tolerance in Edit Mode, and undo edits of the faces that leave the tolerance. If a "
        "face has more than four corners, the tolerance is kept one way, and faces may turn over",
    )
    crossings: BoolProperty(
        name="Keep Crossings Out",
        description="While sculpting and editing, also stop vertices where faces would cross that did not cross when the "
        "guard began. Faces with more than four corners are not kept from crossing",
    )
    lattice: BoolProperty(
        name="Lattice",
        description="Stop the control points of a lattice where the mesh that its modifier deforms would leave the tolerance. "
        "This guard keeps the tolerance one way: parts of the reference may be farther from the mesh",
    )


class TOLVOL_PG_settings(bpy.types.PropertyGroup):
    __annotations__ = (
        tolerance_settings(
            unit={"update": _unit_changed},
            percent={"get": _get_percent, "set": _set_percent, "update": _percent_changed},
            length={"update": _length_changed},
        )
        | decimate_settings()
    )
    tolerance_mode_before: StringProperty(description="The unit before its last change. It is empty for percent")
    percent_choice: FloatProperty(description="The percentage that was chosen. It is 0 if none was chosen")

    show_deviation: BoolProperty(
        name="Show Deviation",
        description="Colour the mesh, or its reference, in the 3D view by the distance while it changes. Parts beyond the "
        "tolerance are striped. The colours prove nothing: use Check for a proof",
        default=True,
        update=_changed,
    )
    deviation_surface: EnumProperty(
        name="Surface",
        description="The surface that is coloured",
        items=DEVIATION_SURFACES,
        update=_changed,
    )
    deviation_palette: EnumProperty(
        name="Colours",
        description="The colours that stand for the distances",
        items=DEVIATION_PALETTES,
        update=_changed,
    )
    deviation_kind: EnumProperty(
        name="Deviation",
        description="How the colours show the distance",
        items=DEVIATION_KINDS,
        update=_changed,
    )
    deviation_opacity: FloatProperty(
        name="Opacity",
        description="The opacity of the colours over the mesh",
        default=0.8,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_changed,
    )

    deviation_range: EnumProperty(
        name="Range",
        description="The distance at which the colours end. Parts beyond the tolerance are striped in any case",
        items=DEVIATION_RANGES,
        update=_changed,
    )
    deviation_limit: FloatProperty(
        name="Limit",
        description="The distance at which the colours end. Larger distances have the last colour",
        default=0.01,
        min=1e-12,
        soft_max=1.0,
        step=1,
        precision=5,
        subtype="DISTANCE",
        update=_changed,
    )
    use_bands: BoolProperty(
        name="Bands",
        description="Show the distance in bands of one colour each instead of a smooth change",
        update=_changed,
    )
    band_count: IntProperty(
        name="Number of Bands",
        description="The number of bands between the first and the last colour. With an odd number, one of them is around 0",
        default=9,
        min=2,
        max=20,
        update=_changed,
    )

    reference_kind: EnumProperty(
        name="Reference",
        description="The surface that the tolerance refers to",
        items=(
            (
                "SELF",
                "This Mesh",
                "The reference is this mesh as it is when the reference is set. It moves along with the object",
            ),
            (
                "OBJECT",
                "Object",
                "The reference is another object's mesh as it is when the reference is set. It stays where it is in the "
                "world",
            ),
        ),
        update=_changed,
    )
    reference_object: PointerProperty(
        name="Object",
        description="The object whose mesh is the reference",
        type=bpy.types.Object,
        poll=lambda settings, ob: ob.type == "MESH" and ob != settings.id_data,
        update=_changed,
    )
    placement: EnumProperty(
        name="Placement",
        description="How the positions of the remaining vertices are chosen",
        items=PLACEMENTS,
        get=_get_placement,
        set=_set_placement,
    )
    placement_choice: IntProperty(default=-1, description="The placement that was chosen. It is -1 if none was chosen")
    lattice: PointerProperty(
        name="Lattice",
        description="The lattice that deforms the mesh",
        type=bpy.types.Object,
        poll=lambda _settings, ob: ob.type == "LATTICE",
    )
    deform_mode: EnumProperty(
        name="Beyond",
        description="How to treat a deformation that would leave the tolerance",
        items=DEFORM_MODES,
    )

    snapshot: PointerProperty(type=bpy.types.Mesh, description="The reference as it was set. It is never changed")
    original: PointerProperty(
        type=bpy.types.Mesh,
        description="The mesh of the reference as it was set, with its UV maps, materials and all other data. A file of an "
        "earlier version has none",
    )
    snapshot_kind: StringProperty(description="The kind of reference that was chosen when the reference was set")
    snapshot_object: PointerProperty(
        type=bpy.types.Object, description="The object that was chosen when the reference was set"
    )
    snapshot_matrix: FloatVectorProperty(
        size=16, description="The matrix of the snapshot to the world when the reference was set"
    )
    snapshot_fingerprint: StringProperty(
        description="The fingerprint of the snapshot, which differs from those of others"
    )

    @property
    def snapshot_size(self):
        """The length that is 100 %, in double precision, at the present scale of the object."""
        return snapshots.snapshot_size(self.id_data)

    smooth: PointerProperty(type=TOLVOL_PG_smooth)
    modifiers: PointerProperty(type=TOLVOL_PG_modifiers)
    lod: PointerProperty(type=TOLVOL_PG_lod)
    bake: PointerProperty(type=TOLVOL_PG_bake)
    lods: PointerProperty(type=bpy.types.Collection, description="The collection of the levels that were made last")
    guard: PointerProperty(type=TOLVOL_PG_guard)

    measurement: PointerProperty(type=TOLVOL_PG_measurement)
    labels: CollectionProperty(type=TOLVOL_PG_label, description="The labels that the probe has left")
    label_index: IntProperty(name="Label", description="The chosen label", update=_label_chosen)
    warnings: StringProperty(description="The warnings of the last operation, as JSON")
    last_run: StringProperty(description="The report of the last operation, as JSON")
    last_run_of: StringProperty(description="The fingerprint of the mesh that the last operation left")
    last_run_matrix: FloatVectorProperty(size=16, description="The matrix of the object after the last operation")


_CLASSES = (
    TOLVOL_PG_measurement,
    TOLVOL_PG_label,
    TOLVOL_PG_smooth,
    TOLVOL_PG_modifiers,
    TOLVOL_PG_lod,
    TOLVOL_PG_bake,
    TOLVOL_PG_guard,
    TOLVOL_PG_settings,
)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.tolvol = PointerProperty(type=TOLVOL_PG_settings)


def unregister():
    del bpy.types.Object.tolvol
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
