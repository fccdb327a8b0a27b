# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares an object with its reference: certified distances both ways, and the faces that are outside."""

import functools
from dataclasses import replace

import bpy
import numpy as np
from bpy.props import IntProperty

from .. import native, preferences
from ..job import JobOperator
from ..mesh import mesh_io
from ..proof import report
from ..proof.certify import certify, outside
from ..proof.measure import Interval
from ..proof.verdict import BEYOND, ONE_WAY, WITHIN, Verdict
from ..reference import measurements, snapshots, tolerances
from .blocked import allowed, check_blocked


class Comparison(JobOperator):
    """Prepares both surfaces. The thread calls compare(surface, reference, tolerance, threads, progress)."""

    threads: IntProperty(options={"HIDDEN", "SKIP_SAVE"}, min=0)

    @classmethod
    def poll(cls, context):
        return allowed(cls, check_blocked(context.active_object))

    def prepare(self, context):
        context.view_layer.update()
        ob = self.ob
        surface, reference = snapshots.surface_of(ob), snapshots.reference_of(ob)
        tolerance = tolerances.tolerance_length(ob.tolvol, reference.size())
        threads = self.threads or preferences.threads(context)
        return functools.partial(self.compare, surface, reference, tolerance, threads)


class TOLVOL_OT_check(Comparison, bpy.types.Operator):
    """Measure the largest distance of the mesh from the reference and of the reference from the mesh, both proved, and \
the share of the mesh that is beyond the tolerance"""

    bl_idname = "tolvol.check"
    bl_label = "Check"
    bl_options = {"REGISTER", "UNDO"}

    @staticmethod
    def compare(surface, reference, tolerance, threads, progress):
        certified = certify(surface, reference, tolerance, 0, threads, progress)
        found = Verdict(tolerance, Interval(*certified["forward"]), Interval(*certified["backward"]))
        if not found.forward_within:
            own = surface.world(), surface.arrays.triangles
            other = reference.world(), reference.arrays.triangles
            spread = native.module.deviation(*own, *other, bounds=(tolerance,), threads=threads, progress=progress)
            found = replace(found, share_outside=float(spread.share_beyond[0]))
        return surface, certified, found

    def finish(self, context, outcome):
        surface, certified, found = outcome
        measurements.remember(self.ob, surface, certified, found.tolerance, found.share_outside)
        largest = report.percent(max(found.forward.upper, found.backward.upper), found.tolerance)
        if found.kind == WITHIN:
            self.report({"INFO"}, f"Within the tolerance both ways: at most {largest} of the tolerance, proved")
        elif found.kind == ONE_WAY:
            self.report(
                {"WARNING"},
                f"Within the tolerance one way: the reference is up to {largest} of the tolerance from the mesh",
            )
        elif found.kind == BEYOND:
            share = f"{100 * found.share_outside:.1f} % of the area is outside"
            self.report({"WARNING"}, f"Beyond the tolerance: up to {largest} of the tolerance, {share}")
        else:
            self.report({"WARNING"}, found.line())


class TOLVOL_OT_select_outside(Comparison, bpy.types.Operator):
    """Switch to Edit Mode and select the faces that are not proved to be within the tolerance of the reference"""

    bl_idname = "tolvol.select_outside"
    bl_label = "Select Outside"
    bl_options = {"REGISTER", "UNDO"}

    @staticmethod
    def compare(surface, reference, tolerance, threads, progress):
        return surface, outside(surface, reference, tolerance, threads, progress)

    def finish(self, context, outcome):
        surface, triangles = outcome
        mesh = self.ob.data
        faces = np.zeros(len(mesh.polygons), bool)
        faces[surface.arrays.polygons[triangles]] = True
        if not faces.any():
            self.report({"INFO"}, "No face is outside")
            return
        mesh_io.select_faces(mesh, faces)
        context.tool_settings.mesh_select_mode = (False, False, True)
        bpy.ops.object.mode_set(mode="EDIT")
        self.report({"WARNING"}, f"{faces.sum():,} of {len(faces):,} faces are outside")
