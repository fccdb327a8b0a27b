# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets, replaces and clears the reference of an object."""

import bpy
import numpy as np
from bpy.props import BoolProperty

from .. import preferences
from ..job import JobOperator
from ..operation_settings import threads_setting
from ..reference import snapshots, tolerances
from ..shared import volumes
from .blocked import allowed, reference_blocked, settings_blocked


def replace_label(ob):
    """Returns the label of the menu entry that replaces the reference: it names the object whose mesh is taken."""
    source = snapshots.source_object(ob)
    if source is None or source == ob:
        return "Replace Reference by This Mesh"
    return f"Replace Reference by {source.name}"


def loses_something(ob):
    """Whether setting the reference discards a snapshot that differs from the new one."""
    if ob.tolvol.snapshot is None:
        return False
    surface = snapshots.surface_of(snapshots.source_object(ob))
    same_place = (
        surface.matrix.astype(np.float32).tobytes() == snapshots.reference_matrix(ob).astype(np.float32).tobytes()
    )
    return not same_place or surface.arrays.fingerprint() != ob.tolvol.snapshot_fingerprint


def _ask(context, operator, ob):
    """Opens a menu that says what would be lost. Only the entry of this menu replaces the reference."""

    def draw(menu, _context):
        count = len(ob.tolvol.snapshot.polygons)
        menu.layout.label(text=f"The present reference of {count:,} triangles is discarded.")
        menu.layout.label(text="The deviation is then measured from the new reference only.")
        menu.layout.separator()
        menu.layout.operator_context = "INVOKE_DEFAULT"
        menu.layout.operator(operator.bl_idname, text=replace_label(ob), icon="ERROR").replace = True

    context.window_manager.popup_menu(draw, title=f"Replace the reference of {ob.name}?", icon="QUESTION")


class TOLVOL_OT_set_reference(JobOperator, bpy.types.Operator):
    """Take a snapshot of the reference, to which the tolerance refers from now on, and build the tolerance volume. If \
another reference is set, a menu asks whether to replace it"""

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

        _ask(context, self, ob)
        return {"CANCELLED"}

    def prepare(self, context):
        context.view_layer.update()
        ob = self.ob
        surface = snapshots.surface_of(snapshots.source_object(ob))
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
    """Remove the reference. The mesh stays as it is"""

    bl_idname = "tolvol.clear_reference"
    bl_label = "Clear Reference"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        return allowed(cls, settings_blocked(ob) or (None if ob.tolvol.snapshot else "No reference is set"))

    def execute(self, context):
        snapshots.clear_reference(context.active_object)
        return {"FINISHED"}
