# SPDX-License-Identifier: GPL-3.0-or-later
"""Fewest triangles within the tolerance: computed and certified on arrays, then written to the mesh in one go."""

import json
import time

import bpy
import numpy as np
from bpy.props import EnumProperty, IntProperty

from .. import measure, mesh_io, native, preferences, report, transfer, volume
from ..certify import certify
from ..errors import NotProved
from ..job import JobOperator
from ..properties import PLACEMENTS, decimate_settings, tolerance_settings
from .blocked import allowed, decimate_blocked


def draw_decimate_settings(layout, settings):
    """The same rows in the panel and in Adjust Last Operation."""
    layout.prop(settings, "keep")
    column = layout.column(align=True)
    column.use_property_split = False  # the names need the width
    column.label(text="Placement")
    column.prop(settings, "placement", expand=True)
    row = layout.row(heading="Stop At", align=True)
    row.prop(settings, "use_target", text="")
    sub = row.row()
    sub.active = settings.use_target
    sub.prop(settings, "target_triangles", text="")


class TOLVOL_OT_decimate(JobOperator, bpy.types.Operator):
    """Reduce the mesh to the fewest triangles that stay within the tolerance of the reference. Without a reference \
this mesh becomes it"""

    bl_idname = "tolvol.decimate"
    bl_label = "Decimate in Tolerance"
    bl_options = {"REGISTER", "UNDO"}

    # Those not given are the object's own. SKIP_SAVE: never those of the last run, which may have been another object's.
    __annotations__ = tolerance_settings(options={"SKIP_SAVE"}) | decimate_settings(options={"SKIP_SAVE"})
    placement: EnumProperty(
        name="Placement", description="Where the remaining vertices go", items=PLACEMENTS, options={"SKIP_SAVE"}
    )
    outside: EnumProperty(
        name="Outside",
        description="What to do with faces that are not within the tolerance of the reference",
        items=(
            ("ERROR", "Stop", "Change nothing and say how many there are"),
            ("KEEP", "Keep", "Leave those faces as they are and decimate the rest"),
        ),
        options={"SKIP_SAVE"},
    )
    threads: IntProperty(options={"HIDDEN", "SKIP_SAVE"}, min=0)

    @classmethod
    def poll(cls, context):
        return allowed(cls, decimate_blocked(context.active_object))

    def draw(self, _context):
        layout = self.layout
        layout.use_property_split = True
        column = layout.column(align=True)
        column.prop(self, "tolerance_percent" if self.tolerance_mode == "PERCENT" else "tolerance_length")
        column.prop(self, "tolerance_mode", text=" ")
        draw_decimate_settings(layout, self)
        layout.prop(self, "outside")

    def prepare(self, context):
        context.view_layer.update()
        ob = self.ob
        self._take_settings(ob.tolvol)
        surface, reference = volume.surface_of(ob), volume.reference_of(ob)
        task = _Task(surface, reference, volume.tolerance_length(self, reference.size()), self._options(context))
        task.locked = np.zeros(len(surface.arrays.vertices), bool)
        task.locked[mesh_io.loose_edges(ob.data)] = True
        task.uvs = mesh_io.corner_uvs(ob.data)
        return task.run

    def finish(self, context, outcome):
        surface, reference, result, run = outcome
        ob = self.ob
        transfer.write_decimated(ob.data, surface.arrays, result)
        if ob.tolvol.snapshot is None:
            volume.set_reference(ob, reference)
            ob.tolvol.snapshot_seconds = run["seconds"]["field"]
        self._give_settings(ob.tolvol)
        volume.remember(ob, volume.surface_of(ob), run, run["tolerance"]["absolute"])
        ob.tolvol.last_run_of = ob.tolvol.measurement.fingerprint
        ob.tolvol.last_run = json.dumps(run)
        for warning in run["warnings"]:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, report.line(run))

    def _take_settings(self, settings):
        given = {name for name in _SHARED if self.properties.is_property_set(name)}
        for mode, name in (("PERCENT", "tolerance_percent"), ("LENGTH", "tolerance_length")):
            if name in given and "tolerance_mode" not in given:
                self.tolerance_mode = mode
                given.add("tolerance_mode")
        if "target_triangles" in given and "use_target" not in given:
            self.use_target = True
            given.add("use_target")
        for name in _SHARED - given:
            setattr(self, name, getattr(settings, name))

    def _give_settings(self, settings):
        for name in _SHARED:
            setattr(settings, name, getattr(self, name))

    def _options(self, context):
        return {
            "placement": self.placement.lower(),
            "two_sided": self.keep == "BOTH",
            "target_triangles": self.target_triangles if self.use_target else 0,
            "outside": self.outside.lower(),
            "threads": self.threads or preferences.threads(context),
        }


_SHARED = {*tolerance_settings(), *decimate_settings(), "placement"}


class _Task:
    """What runs in the thread: arrays in, arrays and numbers out."""

    def __init__(self, surface, reference, tolerance, options):
        self.surface = surface
        self.reference = reference
        self.tolerance = tolerance
        self.options = options
        self.locked = None
        self.uvs = None

    def run(self, progress):
        clock = [time.perf_counter()]
        threads = self.options["threads"]
        built = volume.native_volume(self.reference, self.tolerance, threads, progress)
        clock.append(time.perf_counter())
        arrays, matrix = self.surface.arrays, self.surface.matrix
        wedges = None
        if self.uvs is not None:
            wedges = native.module.wedges(arrays.triangles, self.uvs[arrays.corners])
        computed = native.module.decimate(
            arrays.vertices,
            arrays.triangles,
            built,
            to_world=matrix,
            locked=self.locked if self.locked.any() else None,
            wedges=wedges,
            progress=progress,
            **self.options,
        )
        result = transfer.Decimated.of(computed, arrays)
        clock.append(time.perf_counter())
        decimated = volume.Surface(mesh_io.MeshArrays(result.vertices, result.triangles, None, None), matrix)
        kept = computed.report["outside"]["faces"]
        certified = certify(decimated, self.reference, self.tolerance, kept, threads, progress)
        if kept:
            before = measure.largest_distance(
                (self.reference.world(), self.reference.arrays.triangles),
                (self.surface.world(), arrays.triangles),
                self.tolerance,
                threads,
                progress,
            )
            certified["outside"]["backward_before"] = before.upper
        clock.append(time.perf_counter())
        seconds = dict(zip(("field", "decimate", "certify"), np.diff(clock).tolist()))
        run = report.decimation_run(arrays, result, computed.report, built, certified, self.options, seconds)
        if wedges is not None:
            self._name_corners(run, wedges)
        if not report.proved(run):
            raise NotProved(report.intervals(run))
        return self.surface, self.reference, result, run

    def _name_corners(self, run, wedges):
        """Where three or more UV islands meet no vertex can go: said, because a map of many islands leaves little to take."""
        triangles = self.surface.arrays.triangles
        _, one_corner_each = np.unique(wedges, return_index=True)
        meeting = int((np.bincount(triangles.ravel()[one_corner_each]) > 2).sum())
        if meeting:
            run["locked"]["UV islands meet"] = meeting
        vertices = len(np.unique(triangles))
        if 2 * meeting > vertices:
            run["warnings"].append(
                f"{meeting:,} of {vertices:,} vertices have to stay, because three or more UV islands meet there; "
                "remove UV maps that are not needed"
            )
