# SPDX-License-Identifier: GPL-3.0-or-later
"""Setting the reference of an object, and letting go of it."""

import bpy
from bpy.props import IntProperty

from .. import preferences, volume
from ..job import JobOperator
from .blocked import allowed, reference_blocked


class TOLVOL_OT_set_reference(JobOperator, bpy.types.Operator):
    """Take a snapshot of the reference, which the tolerance refers to from now on, and build the tolerance volume"""

    bl_idname = "tolvol.set_reference"
    bl_label = "Set Reference"
    bl_options = {"REGISTER", "UNDO"}

    threads: IntProperty(options={"HIDDEN", "SKIP_SAVE"}, min=0)

    @classmethod
    def poll(cls, context):
        return allowed(cls, reference_blocked(context.active_object))

    def prepare(self, context):
        context.view_layer.update()
        ob = self.ob
        surface = volume.surface_of(volume.source_object(ob))
        tolerance = volume.tolerance_length(ob.tolvol, surface.size())
        threads = self.threads or preferences.threads(context)

        def work(progress):
            return surface, volume.native_volume(surface, tolerance, threads, progress)

        return work

    def finish(self, context, outcome):
        surface, built = outcome
        volume.set_reference(self.ob, surface)
        self.report({"INFO"}, f"Reference set: {built.triangle_count:,} triangles, ready in {built.seconds:.2f} s")


class TOLVOL_OT_clear_reference(bpy.types.Operator):
    """Let go of the reference"""

    bl_idname = "tolvol.clear_reference"
    bl_label = "Clear Reference"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        return ob is not None and ob.type == "MESH" and ob.library is None and ob.tolvol.snapshot is not None

    def execute(self, context):
        volume.clear_reference(context.active_object)
        return {"FINISHED"}
