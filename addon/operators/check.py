# SPDX-License-Identifier: GPL-3.0-or-later
"""Comparing an object with its reference: certified distances both ways, and the faces that are outside."""

import functools

import bpy
import numpy as np
from bpy.props import IntProperty

from .. import mesh_io, native, preferences, report, volume
from ..certify import INSIDE, certify, verdicts
from ..job import JobOperator
from .blocked import allowed, check_blocked


class Comparison(JobOperator):
    """Prepares both surfaces; what is compared is compare(surface, reference, tolerance, threads, progress), in the thread."""

    threads: IntProperty(options={"HIDDEN", "SKIP_SAVE"}, min=0)

    @classmethod
    def poll(cls, context):
        return allowed(cls, check_blocked(context.active_object))

    def prepare(self, context):
        context.view_layer.update()
        ob = self.ob
        surface, reference = volume.surface_of(ob), volume.reference_of(ob)
        tolerance = volume.tolerance_length(ob.tolvol, reference.size())
        threads = self.threads or preferences.threads(context)
        return functools.partial(self.compare, surface, reference, tolerance, threads)


class TOLVOL_OT_check(Comparison, bpy.types.Operator):
    """Measure how far the mesh lies from the reference and the reference from the mesh: the largest distance, proved, \
and how much of the mesh is beyond the tolerance"""

    bl_idname = "tolvol.check"
    bl_label = "Check"
    bl_options = {"REGISTER", "UNDO"}

    @staticmethod
    def compare(surface, reference, tolerance, threads, progress):
        certified = certify(surface, reference, tolerance, 0, threads, progress)
        beyond = 0.0
        if certified["forward"][1] > tolerance:
            own = surface.world(), surface.arrays.triangles
            other = reference.world(), reference.arrays.triangles
            found = native.module.deviation(*own, *other, bounds=(tolerance,), threads=threads, progress=progress)
            beyond = float(found.share_beyond[0])
        return surface, tolerance, certified, beyond

    def finish(self, context, outcome):
        surface, tolerance, certified, beyond = outcome
        volume.remember(self.ob, surface, certified, tolerance, beyond)
        largest = report.percent(max(certified["forward"][1], certified["backward"][1]), tolerance)
        if certified["forward"][1] > tolerance:
            self.report(
                {"WARNING"}, f"Beyond the tolerance: up to {largest} of it, {100 * beyond:.1f} % of the area outside"
            )
        elif certified["backward"][1] > tolerance:
            self.report({"WARNING"}, f"Within the tolerance, but the reference is up to {largest} of it from the mesh")
        else:
            self.report({"INFO"}, f"Within the tolerance both ways: at most {largest} of it, proved")


class TOLVOL_OT_select_outside(Comparison, bpy.types.Operator):
    """Select the faces that are not proved to be within the tolerance of the reference, in Edit Mode"""

    bl_idname = "tolvol.select_outside"
    bl_label = "Select Outside"
    bl_options = {"REGISTER", "UNDO"}

    @staticmethod
    def compare(surface, reference, tolerance, threads, progress):
        return surface, verdicts(surface, reference, tolerance, threads, progress)

    def finish(self, context, outcome):
        surface, verdict = outcome
        mesh = self.ob.data
        outside = np.zeros(len(mesh.polygons), bool)
        outside[surface.arrays.polygons[verdict < INSIDE]] = True
        if not outside.any():
            self.report({"INFO"}, "No face is outside")
            return
        mesh_io.select_faces(mesh, outside)
        context.tool_settings.mesh_select_mode = (False, False, True)
        bpy.ops.object.mode_set(mode="EDIT")
        self.report({"WARNING"}, f"{outside.sum():,} of {len(outside):,} faces are outside")
