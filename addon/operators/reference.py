# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets, replaces and clears the reference of an object."""

import bpy
import numpy as np
from bpy.props import BoolProperty

from .. import preferences
from ..job import JobOperator, breathe
from ..mesh import mesh_io
from ..operation_settings import threads_setting
from ..reference import originals, snapshots, tolerances
from ..shared import volumes
from .asking import ask
from .blocked import allowed, reference_blocked, settings_blocked


def replace_label(ob):
    """Returns the label of the menu entry that replaces the reference: it names the object whose mesh is taken."""
    source = snapshots.source_object(ob)
    if source is None or source == ob:
        return "Replace Reference by This Mesh"
    return f"Replace Reference by {source.name}"


def loses_something(ob):
    """Whether the reference, or the original with its data, is no longer what setting the reference would keep."""
    if ob.tolvol.snapshot is None:
        return False
    source = snapshots.source_object(ob)
    if source is None or source.type != "MESH":
        return True
    places = mesh_io.matrix_array(source.matrix_world), snapshots.reference_matrix(ob)
    if not np.array_equal(*(place.astype(np.float32) for place in places)):
        return True
    source.update_from_editmode()
    if mesh_io.read_mesh(source.data).fingerprint() != ob.tolvol.snapshot_fingerprint:
        return True
    original = ob.tolvol.original
    return original is not None and not originals.same_data(source.data, original)


def _lost(ob):
    """Returns sentences about what is discarded with the reference."""
    settings = ob.tolvol
    lines = [f"The present reference of {len(settings.snapshot.polygons):,} triangles is discarded."]
    if settings.original is not None:
        lines.append(f"The original is discarded, too{originals.with_its_data(settings.original)}.")
    return lines


class TOLVOL_OT_set_reference(JobOperator, bpy.types.Operator):
    """Take a snapshot of the reference, to which the tolerance refers from now on. It replaces a reference that is set, and \
the original with its UV maps, materials and other data. If these differ from the new ones, a menu asks first"""

    bl_idname = "tolvol.set_reference"
    bl_label = "Set Reference"
    bl_options = {"REGISTER", "UNDO"}

    threads: threads_setting()
    replace: BoolProperty(
        name="Replace",
        description="Replace the present reference without asking",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        return allowed(cls, reference_blocked(context.active_object))

    def invoke(self, context, event):
        ob = context.active_object
        if self.replace or not loses_something(ob):
            return super().invoke(context, event)

        def draw_entry(layout):
            layout.operator(self.bl_idname, text=replace_label(ob), icon="ERROR").replace = True

        lines = [*_lost(ob), "The deviation is then measured from the new reference only."]
        ask(context, f"Replace the reference of {ob.name}?", lines, draw_entry)
        return {"CANCELLED"}

    def prepare(self, context):
        context.view_layer.update()
        ob = self.ob
        surface = snapshots.surface_of(snapshots.source_object(ob))
        yield breathe
        tolerance = tolerances.tolerance_length(ob.tolvol, surface.size())
        threads = self.threads or preferences.threads(context)

        def work(progress):
            return surface, volumes.native_volume(surface, tolerance, threads, progress)

        return work

    def finish(self, context, outcome):
        surface, built = outcome
        snapshots.set_reference(self.ob, surface)
        self.say({"INFO"}, f"Reference set: {built.triangle_count:,} triangles")


class TOLVOL_OT_clear_reference(bpy.types.Operator):
    """Remove the reference, and the original with its UV maps, materials and other data. A menu asks first if the object \
that the reference was taken from no longer has the same. The mesh stays as it is"""

    bl_idname = "tolvol.clear_reference"
    bl_label = "Clear Reference"
    bl_options = {"REGISTER", "UNDO"}

    sure: BoolProperty(
        name="Sure",
        description="Remove the reference and the original without asking",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        return allowed(cls, settings_blocked(ob) or (None if ob.tolvol.snapshot else "No reference is set"))

    def invoke(self, context, _event):
        ob = context.active_object
        if self.sure or not loses_something(ob):
            return self.execute(context)

        def draw_entry(layout):
            layout.operator(self.bl_idname, text="Remove the Reference", icon="ERROR").sure = True

        ask(context, f"Remove the reference of {ob.name}?", _lost(ob), draw_entry)
        return {"CANCELLED"}

    def execute(self, context):
        snapshots.clear_reference(context.active_object)
        return {"FINISHED"}
