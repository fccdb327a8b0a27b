# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares an object with its reference: certified distances both ways, and the faces that are outside."""

import functools
from dataclasses import replace

import bpy
import numpy as np

from .. import native, preferences
from ..job import JobOperator
from ..mesh import mesh_io
from ..operation_settings import threads_setting
from ..proof import statistics, verdict
from ..reference import measurements, tolerances
from ..shared.proof import measure, report
from ..shared.proof.certify import outside
from ..shared.proof.verdict import BEYOND, ONE_WAY, WITHIN, Verdict
from .blocked import allowed, check_blocked
from .mesh_and_reference import mesh_and_reference
from .staying import show_selected


class Comparison(JobOperator):
    """Prepares both surfaces. The thread calls compare(surface, reference, tolerance, threads, progress)."""

    threads: threads_setting()
    measures_again = False  # whether it measures even what was measured before in this session

    @classmethod
    def poll(cls, context):
        return allowed(cls, check_blocked(context.active_object))

    def prepare(self, context):
        context.view_layer.update()
        ob = self.ob
        surface, reference = yield from mesh_and_reference(ob)
        tolerance = tolerances.required(ob, reference.size())
        threads = self.threads or preferences.threads(context)
        self.two_sided = ob.tolvol.keep == "BOTH"
        return functools.partial(self.compare, surface, reference, tolerance, threads)

    def judge(self, surface, reference, tolerance, threads, progress):
        """Returns the Verdict on a Surface, with the share of its area that is outside."""
        own = surface.world(), surface.arrays.triangles
        other = reference.world(), reference.arrays.triangles
        ways = measure.both_ways(own, other, tolerance, threads, progress, self.measures_again)
        found = Verdict(tolerance, *ways, two_sided=self.two_sided)
        if not found.forward_within:
            spread = native.module.deviation(*own, *other, bounds=(tolerance,), threads=threads, progress=progress)
            found = replace(found, share_outside=float(spread.share_beyond[0]))
        return found

    def remember(self, surface, found, measured=""):
        """Stores the Verdict. Returns the one that every part of the interface then shows, because more may have been known
        of the same mesh; the Verdict itself if the settings are others now. measured: statistics as text."""
        certified = {
            name: (way.lower, way.upper) for name, way in (("forward", found.forward), ("backward", found.backward))
        }
        measurements.remember(self.ob, surface, certified, found.tolerance, found.share_outside, measured)
        shown = verdict.of(self.ob)
        asked = found.tolerance, found.two_sided
        return shown if shown and (shown.tolerance, shown.two_sided) == asked else found


class TOLVOL_OT_check(Comparison, bpy.types.Operator):
    """Measure the largest distance of the mesh from the reference and of the reference from the mesh, both proved, and \
the share of the mesh that is beyond the tolerance"""

    bl_idname = "tolvol.check"
    bl_label = "Check"
    bl_options = {"REGISTER"}

    measures_again = True

    def compare(self, surface, reference, tolerance, threads, progress):
        return surface, self.judge(surface, reference, tolerance, threads, progress)

    def finish(self, context, outcome):
        surface, found = outcome
        found = self.remember(surface, found)
        level = "INFO" if found.kind == WITHIN else "WARNING"
        self.say({level}, said(found))


class TOLVOL_OT_measure_statistics(Comparison, bpy.types.Operator):
    """Measure as Check does, and estimate mean, root mean square and 95th percentile of the distance over the area, \
from the mesh to the reference and from the reference to the mesh"""

    bl_idname = "tolvol.measure_statistics"
    bl_label = "Measure Statistics"
    bl_options = {"REGISTER"}

    def compare(self, surface, reference, tolerance, threads, progress):
        found = self.judge(surface, reference, tolerance, threads, progress)
        return surface, found, statistics.measure(surface, reference, threads, progress)

    def finish(self, context, outcome):
        surface, found, measured = outcome
        found = self.remember(surface, found, statistics.as_text(measured))
        self.say({"INFO" if found.passed else "WARNING"}, said(found))


def said(found):
    """Returns a Verdict as the message of Check."""
    largest = report.percent(found.largest, found.tolerance)
    if found.passed:
        ways = "both ways" if found.two_sided else "one way"
        return f"{found.word}: within the tolerance {ways}, at most {largest} of the tolerance, proved"
    if found.kind == ONE_WAY:
        return f"{found.word}: the mesh is within the tolerance, but the reference is up to {largest} of the tolerance from it"
    if found.kind == BEYOND:
        share = f"about {found.about_outside()} of the area is outside"
        return f"{found.word}: beyond the tolerance, up to {largest} of the tolerance, {share}"
    return f"{found.word}: {found.line()}"


class TOLVOL_OT_select_outside(Comparison, bpy.types.Operator):
    """Measure as Check does, switch to Edit Mode, select the faces that are not proved to be within the tolerance of the \
reference, and bring them into view"""

    bl_idname = "tolvol.select_outside"
    bl_label = "Select Outside"
    bl_options = {"REGISTER", "UNDO"}

    def compare(self, surface, reference, tolerance, threads, progress):
        found = self.judge(surface, reference, tolerance, threads, progress)
        return surface, found, outside(surface, reference, found.forward, tolerance, threads, progress)

    def finish(self, context, outcome):
        surface, found, triangles = outcome
        found = self.remember(surface, found)
        mesh = self.ob.data
        faces = np.zeros(len(mesh.polygons), bool)
        if not found.forward_within:  # It may have been known to be within, where the search found no proof.
            faces[surface.arrays.polygons[triangles]] = True
        if not faces.any():
            self.say({"INFO" if found.passed else "WARNING"}, f"No face of the mesh is outside. {said(found)}")
            return {"CANCELLED"}
        mesh_io.select_faces(mesh, faces)
        show_selected(context, self.ob, (False, False, True))
        self.say({"WARNING"}, f"{found.word}: {faces.sum():,} of {len(faces):,} faces are outside")
        return {"FINISHED"}
