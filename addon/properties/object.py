# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of an object, its reference, and what is known about its mesh: the properties at Object.tolvol."""

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

from .. import preferences
from ..operation_settings import bake_settings, decimate_settings, lod_settings, modifier_settings, smooth_settings
from ..redraw import redraw_views
from ..reference import measurements, snapshots, tolerances
from .choices import PLACEMENTS, automatic_placement, deform_mode_setting, placement_setting, tolerance_settings
from .measured import TOLVOL_PG_label, TOLVOL_PG_measurement
from .overlay import ShowDeviation, changed


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


class TOLVOL_PG_smooth(bpy.types.PropertyGroup):
    __annotations__ = smooth_settings()


class TOLVOL_PG_modifiers(bpy.types.PropertyGroup):
    __annotations__ = modifier_settings()


def _levels_unit_changed(settings, _context):
    size = measurements.shown_size(settings.id_data)
    if settings.in_length != settings.in_length_before and size:
        tolerances.convert_levels(settings, size, "LENGTH" if settings.in_length else "PERCENT")
    settings.in_length_before = settings.in_length


class TOLVOL_PG_lod(bpy.types.PropertyGroup):
    __annotations__ = lod_settings(in_length={"update": _levels_unit_changed})
    in_length_before: BoolProperty(description="Whether the tolerances were lengths before the last change of the unit")


class TOLVOL_PG_bake(bpy.types.PropertyGroup):
    __annotations__ = bake_settings()


class TOLVOL_PG_guard(bpy.types.PropertyGroup):
    """The settings that choose which of Blender's own tools are kept within the tolerance."""

    sculpting: BoolProperty(
        name="Sculpting",
        description="Stop vertices at the tolerance while a stroke goes on in Sculpt Mode",
    )
    editing: BoolProperty(
        name="Editing",
        description="Stop vertices at the tolerance in Edit Mode, and undo edits of the faces that leave the tolerance",
    )
    lattice: BoolProperty(
        name="Lattice",
        description="Stop the control points of a lattice where the mesh that its modifier deforms would leave the tolerance",
    )
    crossings: BoolProperty(
        name="Keep Crossings Out",
        description="Also stop vertices and control points where faces would cross that did not cross when the guard began, "
        "and undo edits that make more faces cross",
    )


class TOLVOL_PG_settings(ShowDeviation, bpy.types.PropertyGroup):
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
        update=changed,
    )
    reference_object: PointerProperty(
        name="Object",
        description="The object whose mesh is the reference",
        type=bpy.types.Object,
        poll=lambda settings, ob: ob.type == "MESH" and ob != settings.id_data,
        update=changed,
    )
    placement: placement_setting(get=_get_placement, set=_set_placement)
    placement_choice: IntProperty(default=-1, description="The placement that was chosen. It is -1 if none was chosen")
    lattice: PointerProperty(
        name="Lattice",
        description="The lattice that deforms the mesh",
        type=bpy.types.Object,
        poll=lambda _settings, ob: ob.type == "LATTICE",
    )
    deform_mode: deform_mode_setting()

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
    lod_of: PointerProperty(type=bpy.types.Object, description="The object of which this one is a level of detail")
    guard: PointerProperty(type=TOLVOL_PG_guard)

    measurement: PointerProperty(type=TOLVOL_PG_measurement)
    labels: CollectionProperty(type=TOLVOL_PG_label, description="The labels that the probe has left")
    label_index: IntProperty(name="Label", description="The chosen label", update=_label_chosen)
    warnings: StringProperty(description="The warnings of the last operation, as JSON")
    last_run: StringProperty(description="The report of the last operation, as JSON")
    last_run_of: StringProperty(description="The fingerprint of the mesh that the last operation left")
    last_run_matrix: FloatVectorProperty(size=16, description="The matrix of the object after the last operation")
