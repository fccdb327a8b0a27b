# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel shows and a file keeps, at Object.tolvol. Settings that an operator shares are declared once, here."""

import math

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import preferences
from .operation_settings import decimate_settings, modifier_settings, smooth_settings
from .reference import measurements, snapshots, tolerances

TOLERANCE_UNITS = (
    ("PERCENT", "% of Size", "Percent of the longest diagonal of the reference's bounding box"),
    ("LENGTH", "Length", "A length in the world, whatever the size of the reference"),
)


def tolerance_settings(options=frozenset(), unit=None, percent=None, length=None):
    """name -> property of the tolerance; `options` for all, what `unit`, `percent` and `length` have for one each."""
    return {
        "tolerance_mode": EnumProperty(
            name="Tolerance Unit",
            description="What the tolerance is given in",
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
        # Blender's FloatProperty is float32.
        "tolerance_percent_converted": StringProperty(
            description="All digits of the percentage, where it was converted from a length",
            options={"HIDDEN", *options},
        ),
        "tolerance_length_converted": StringProperty(
            description="All digits of the length, where it was converted from a percentage",
            options={"HIDDEN", *options},
        ),
    }


PLACEMENTS = (
    (
        "OPTIMAL",
        "Fewest Triangles",
        "Vertices move to where they save most triangles. UV maps and attributes are carried over",
    ),
    (
        "SUBSET",
        "Original Vertices",
        "Every remaining vertex is an original one, with its UVs and attributes exactly as they are",
    ),
)


DEFORM_MODES = (
    ("BLOCKED", "Block", "Change nothing and say how far it may go"),
    (
        "FARTHEST",
        "As Far as Permitted",
        "Carry every vertex the same share of its way, as far as the tolerance permits",
    ),
    ("PULL_BACK", "Pull Back", "Carry every vertex as far as the tolerance permits there, and all others all the way"),
)


def automatic_placement(mesh):
    """The placement until somebody chooses one: exact UVs for a mesh that has any."""
    return "SUBSET" if isinstance(mesh, bpy.types.Mesh) and mesh.uv_layers else "OPTIMAL"


def _get_placement(settings):
    if settings.placement_choice >= 0:
        return settings.placement_choice
    return [name for name, *_ in PLACEMENTS].index(automatic_placement(settings.id_data.data))


def _set_placement(settings, value):
    settings.placement_choice = value


def _get_percent(settings):
    """What was chosen; until something is, the default of the preferences."""
    return settings.percent_choice or preferences.tolerance(bpy.context)


def _set_percent(settings, value):
    settings.percent_choice = value


def _double(name):
    """A number in double precision, kept as the text `name`: what decides is not rounded to Blender's float32.

    Not a number (nan) where none is kept, or none that can be read.
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
    "tolerance": "That it was compared with",
    "size": "What was 100 % then",
    "forward_lower": "The mesh is somewhere at least this far from the reference",
    "forward": "The mesh is nowhere farther from the reference than this",
    "backward_lower": "The reference is somewhere at least this far from the mesh",
    "backward": "The reference is nowhere farther from the mesh than this",
}


class TOLVOL_PG_measurement(bpy.types.PropertyGroup):
    """The certified distances of one state of a mesh, in world units."""

    __annotations__ = {
        "fingerprint": StringProperty(description="Of the mesh that was measured; empty: none was"),
        "matrix": FloatVectorProperty(size=16, description="Of the object then"),
        "share_outside": FloatProperty(description="Share of the mesh's area that is beyond the tolerance"),
    } | {f"{name}_digits": StringProperty(description=text) for name, text in _LENGTHS.items()}

    tolerance, size = _double("tolerance_digits"), _double("size_digits")
    forward_lower, forward = _double("forward_lower_digits"), _double("forward_digits")
    backward_lower, backward = _double("backward_lower_digits"), _double("backward_digits")

    @property
    def complete(self):
        """Whether something was measured, and all of it can be read."""
        return bool(self.fingerprint) and not any(math.isnan(getattr(self, name)) for name in _LENGTHS)


class TOLVOL_PG_smooth(bpy.types.PropertyGroup):
    __annotations__ = smooth_settings()


class TOLVOL_PG_modifiers(bpy.types.PropertyGroup):
    __annotations__ = modifier_settings()


def _changed(_settings, _context):
    snapshots.notify()


def _percent_changed(settings, _context):
    settings.tolerance_percent_converted = ""
    snapshots.notify()


def _length_changed(settings, _context):
    settings.tolerance_length_converted = ""
    snapshots.notify()


def _unit_changed(settings, _context):
    """The tolerance stays what it is, in the other unit."""
    mode, size = settings.tolerance_mode, measurements.shown_size(settings.id_data)
    if mode != (settings.tolerance_mode_before or "PERCENT") and size:
        tolerances.convert_tolerance(settings, size, mode)
    settings.tolerance_mode_before = mode
    snapshots.notify()


DEVIATION_KINDS = (
    ("SIGNED", "Signed", "With its side: blue inside the reference, red outside"),
    ("MAGNITUDE", "Magnitude", "How far, on whichever side"),
)


class TOLVOL_PG_guard(bpy.types.PropertyGroup):
    """Which of Blender's own tools are kept within the tolerance."""

    sculpting: BoolProperty(
        name="Sculpting",
        description="Hold vertices back at the tolerance while a stroke goes on in Sculpt Mode",
    )
    editing: BoolProperty(
        name="Editing",
        description="Hold vertices back at the tolerance in Edit Mode, and undo edits of the faces that would leave it",
    )
    lattice: BoolProperty(
        name="Lattice",
        description="Stop the points of a lattice where the mesh that its modifier deforms would leave the tolerance",
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
    tolerance_mode_before: StringProperty(description="The unit until it was last changed; empty: percent")
    percent_choice: FloatProperty(description="The percentage that was chosen; 0: none was")

    show_deviation: BoolProperty(
        name="Show Deviation",
        description="Colour the mesh in the 3D view by its distance to the reference, live; what is beyond the "
        "tolerance is striped. The colours prove nothing, Check does",
        default=True,
        update=_changed,
    )
    deviation_kind: EnumProperty(
        name="Deviation",
        description="What the colours show",
        items=DEVIATION_KINDS,
        update=_changed,
    )
    deviation_opacity: FloatProperty(
        name="Opacity",
        description="How much the colours cover what is below them",
        default=0.8,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_changed,
    )

    reference_kind: EnumProperty(
        name="Reference",
        description="The surface that the tolerance refers to",
        items=(
            ("SELF", "This Mesh", "This mesh as it is when the reference is set. It moves along with the object"),
            (
                "OBJECT",
                "Object",
                "Another object's mesh as it is when the reference is set. It stays where it is in the world",
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
        description="Where the remaining vertices go",
        items=PLACEMENTS,
        get=_get_placement,
        set=_set_placement,
    )
    placement_choice: IntProperty(default=-1, description="The placement that was chosen; -1: none was")
    lattice: PointerProperty(
        name="Lattice",
        description="The lattice that carries the mesh along",
        type=bpy.types.Object,
        poll=lambda _settings, ob: ob.type == "LATTICE",
    )
    deform_mode: EnumProperty(
        name="Beyond",
        description="What becomes of a deformation that would leave the tolerance",
        items=DEFORM_MODES,
    )

    snapshot: PointerProperty(type=bpy.types.Mesh, description="The reference as it was set; never changed")
    snapshot_kind: StringProperty(description="The kind of reference that was chosen then")
    snapshot_object: PointerProperty(type=bpy.types.Object, description="The object that was chosen then")
    snapshot_matrix: FloatVectorProperty(size=16, description="The place of the snapshot in the world then")
    snapshot_fingerprint: StringProperty(description="Tells the snapshot from others")

    @property
    def snapshot_size(self):
        """The length that is 100 %, in double, as the object is scaled now."""
        return snapshots.snapshot_size(self.id_data)

    smooth: PointerProperty(type=TOLVOL_PG_smooth)
    modifiers: PointerProperty(type=TOLVOL_PG_modifiers)
    guard: PointerProperty(type=TOLVOL_PG_guard)

    measurement: PointerProperty(type=TOLVOL_PG_measurement)
    last_run: StringProperty(description="The report of the last decimation, JSON")
    last_run_of: StringProperty(description="Fingerprint of the mesh it left")


_CLASSES = (TOLVOL_PG_measurement, TOLVOL_PG_smooth, TOLVOL_PG_modifiers, TOLVOL_PG_guard, TOLVOL_PG_settings)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.tolvol = PointerProperty(type=TOLVOL_PG_settings)


def unregister():
    del bpy.types.Object.tolvol
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
