# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates meshes within the tolerance: computes and certifies on arrays, then writes each mesh in one go."""

import contextlib
import functools
import math
import time

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty

from .. import native, preferences
from ..errors import NotProved, Refused
from ..job import JobOperator, run_all
from ..mesh import filling, mesh_io, protect, transfer
from ..operation_settings import PROTECTED, decimate_settings
from ..proof import kept_warnings, last_run, measure, report, solidity, verdict
from ..proof.certify import certify
from ..properties import PLACEMENTS, automatic_placement, tolerance_settings
from ..reference import measurements, snapshots, tolerances, volumes
from . import original
from . import settings as shared
from .blocked import allowed, decimate_blocked


def draw_decimate_settings(layout, settings):
    """Draws the settings of a decimation, for the panel and for Adjust Last Operation."""
    layout.prop(settings, "effort")
    column = layout.column(align=True)
    column.use_property_split = False  # The names of the placements need the whole width.
    column.label(text="Placement")
    column.prop(settings, "placement", expand=True)
    row = layout.row(heading="Stop At", align=True)
    row.prop(settings, "use_target", text="")
    sub = row.row()
    sub.active = settings.use_target
    sub.prop(settings, "target_triangles", text="")
    layout.row(heading="Holes").prop(settings, "close_holes", text="Close")


def draw_advanced_settings(layout, settings):
    """Draws the settings of a decimation that hardly anybody changes, for the panel and for Adjust Last Operation."""
    layout.prop(settings, "max_seconds")
    row = layout.row()
    row.active = settings.close_holes
    row.prop(settings, "largest_perimeter")
    layout.prop(settings, "crossings")
    layout.prop(settings, "max_normal_angle")


def draw_protect_settings(layout, settings, ob):
    """Draws the settings of the protected elements, for the panel and for Adjust Last Operation."""
    layout.row(heading="Faces").prop(settings, "only_selected", text="Unselected")
    column = layout.column(align=True)
    column.label(text="Edges")
    grid = column.grid_flow(columns=2, row_major=True, align=True)
    grid.use_property_split = False
    for kind, *_ in PROTECTED:
        grid.prop_enum(settings, "protect", kind)
    layout.row(align=True).prop(settings, "symmetry")
    shared.draw_vertex_group(layout, settings, ob)


def targets(context):
    """Returns the objects to decimate: the active one first, then all other selected meshes.

    While the original of the active object is shown, they are the same as before.
    """
    active = original.active(context)
    others = {ob for ob in (active, original.stand_in()) if ob is not None}
    return [active, *(ob for ob in context.selected_objects if ob.type == "MESH" and ob not in others)]


def _choose_placement(operator, _context):
    operator.own_placements = False


class TOLVOL_OT_decimate(JobOperator, bpy.types.Operator):
    """Reduce the triangles of each selected mesh within the tolerance of its reference, with the settings of the active \
object. An object without a reference gets one first, as by Set Reference"""

    bl_idname = "tolvol.decimate"
    bl_label = "Decimate in Tolerance"
    bl_options = {"REGISTER", "UNDO"}

    # A setting that is not given is taken from the object. SKIP_SAVE keeps Blender from taking it from the last run,
    # which may have been on another object.
    __annotations__ = tolerance_settings({"SKIP_SAVE"}) | decimate_settings({"SKIP_SAVE"})
    placement: EnumProperty(
        name="Placement",
        description="How the positions of the remaining vertices are chosen",
        items=PLACEMENTS,
        options={"SKIP_SAVE"},
        update=_choose_placement,
    )
    own_placements: BoolProperty(
        description="No placement was chosen: the placement depends on the UV maps of each mesh",
        options={"HIDDEN", "SKIP_SAVE"},
    )
    outside: EnumProperty(
        name="Outside",
        description="How to treat faces that are not within the tolerance of the reference before the decimation",
        items=(
            ("ERROR", "Stop", "Change nothing and report the number of such faces"),
            ("KEEP", "Keep", "Leave such faces as they are and decimate the rest"),
        ),
        options={"SKIP_SAVE"},
    )
    threads: IntProperty(options={"HIDDEN", "SKIP_SAVE"}, min=0)

    @classmethod
    def poll(cls, context):
        return allowed(cls, decimate_blocked(context.active_object))

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        column = layout.column(align=True)
        column.prop(self, "tolerance_percent" if self.tolerance_mode == "PERCENT" else "tolerance_length")
        column.prop(self, "tolerance_mode", text=" ")
        layout.prop(self, "keep")
        draw_decimate_settings(layout, self)
        draw_protect_settings(layout, self, context.active_object)
        layout.prop(self, "outside")
        draw_advanced_settings(layout, self)

    def targets(self, context):
        return targets(context)

    def prepare(self, context):
        context.view_layer.update()
        self._take_settings(self.ob.tolvol)
        tasks = []
        for ob in self.objects:
            if reason := decimate_blocked(ob):
                raise Refused(f"{ob.name}: {reason}")
            tasks.append(self._task(context, ob))
        # The tolerance is stored in the other unit too, so that changing the unit in Adjust Last Operation keeps it.
        other = "PERCENT" if self.tolerance_mode == "LENGTH" else "LENGTH"
        tolerances.convert_tolerance(self, tasks[0].reference.size(), other)
        return functools.partial(run_all, tasks)

    def _task(self, context, ob):
        surface, reference = snapshots.surface_of(ob), snapshots.reference_of(ob)
        task = _Task(
            ob.name,
            surface,
            reference,
            tolerances.tolerance_length(self, reference.size()),
            self._options(context, ob.data),
        )
        task.uvs = mesh_io.corner_uvs(ob.data)
        task.locked[mesh_io.loose_edges(ob.data)] = True
        task.locked |= protect.on_edges(ob.data, self.protect)
        task.locked |= protect.on_planes(ob.data, self.symmetry)
        if self.only_selected:
            task.locked |= protect.unselected(ob)
            task.selected = mesh_io.column(ob.data.polygons, "select", 1, bool)
        if self.close_holes:
            angle = task.options["max_normal_angle"]
            task.close_holes = {
                "largest_perimeter": self.largest_perimeter or None,
                # Left as it is, *Normals* would leave open the ends of tubes, which are at right angles to the tubes.
                "max_normal_angle": None if angle == 90 else angle,
            }
        task.shares = protect.group_weights(ob, self.vertex_group, self.invert_vertex_group)
        if task.shares is not None:
            task.locked |= task.shares == 0
        return task

    def finish(self, context, outcomes):
        # Entering all contexts checks that Blender can hold all results before the first mesh is changed.
        with contextlib.ExitStack() as stack:
            writes = [
                stack.enter_context(transfer.Writing(ob.data, source, result))
                for ob, (source, _, result, _) in zip(self.objects, outcomes)
            ]
            without = [ob for ob in self.objects if ob.tolvol.snapshot is None]
            # If anything fails until the meshes are written, the objects have no reference, as before.
            stack.callback(lambda: [snapshots.clear_reference(ob) for ob in without])
            for ob, (_, reference, _, _) in zip(self.objects, outcomes):
                if ob in without:
                    snapshots.set_reference(ob, reference)
            for write in writes:
                write.write()
            without.clear()
        for ob, (_, _, _, run) in zip(self.objects, outcomes):
            self._keep(ob, run, f"{ob.name}: " if len(self.objects) > 1 else "")

    def _keep(self, ob, run, prefix):
        """Remembers the run at its object and reports it."""
        shared.give(self, ob.tolvol, _SHARED if self.own_placements else {*_SHARED, "placement"})
        measurements.remember(ob, snapshots.surface_of(ob), run, run["tolerance"]["absolute"])
        last_run.keep(ob, run)
        kept_warnings.keep(ob, run["warnings"], run["locked"])
        for warning in run["warnings"]:
            self.report({"WARNING"}, prefix + warning)
        self.report({"INFO"}, f"{prefix}{verdict.word(ob)}: {report.line(run)}")

    def _take_settings(self, settings):
        """Takes the settings of the active object for all objects, so that Adjust Last Operation shows the ones used."""
        given = self.properties.is_property_set
        for mode, name in (("PERCENT", "tolerance_percent"), ("LENGTH", "tolerance_length")):
            if given(name) and not given("tolerance_mode"):
                self.tolerance_mode = mode
        if given("target_triangles") and not given("use_target"):
            self.use_target = True
        shared.take(self, settings, _SHARED)
        if not given("placement"):
            self.placement = settings.placement
            self.own_placements = settings.placement_choice < 0

    def _options(self, context, mesh):
        placement = automatic_placement(mesh) if self.own_placements else self.placement
        return {
            "placement": placement.lower(),
            "two_sided": self.keep == "BOTH",
            "effort": self.effort.lower(),
            "crossings": self.crossings.lower(),
            # A property holds a float32, in which 90 and 180 degrees are slightly more.
            "max_normal_angle": round(math.degrees(self.max_normal_angle), 4),
            "max_seconds": self.max_seconds or None,
            "target_triangles": self.target_triangles if self.use_target else None,
            "outside": self.outside.lower(),
            "threads": self.threads or preferences.threads(context),
        }


_SHARED = {*tolerance_settings(), *decimate_settings()}


class _Task:
    """The work on one object in the thread: it reads and returns arrays and numbers, no data of Blender."""

    def __init__(self, name, surface, reference, tolerance, options):
        self.name = name
        self.surface = surface
        self.reference = reference
        self.tolerance = tolerance
        self.options = options
        self.locked = np.zeros(len(surface.arrays.vertices), bool)
        self.shares = None
        self.uvs = None
        self.close_holes = None  # the options of close_holes(), if holes are to be closed
        self.selected = None  # (polygons,) bool, if only the selected ones are to be changed

    def run(self, progress):
        clock = [time.perf_counter()]
        threads = self.options["threads"]
        built = volumes.native_volume(self.reference, self.tolerance, threads, progress)
        clock.append(time.perf_counter())
        arrays, matrix = self.surface.arrays, self.surface.matrix
        holes, stages = None, ["field", "decimate", "certify"]
        if self.close_holes is not None:
            arrays, holes = self._close(arrays, built, progress)
            stages.insert(1, "close_holes")
            clock.append(time.perf_counter())
        wedges = None
        if self.uvs is not None:
            values = self.uvs[arrays.corners]
            if holes is not None:
                number = arrays.hole.astype(np.float32)[:, None, None]
                values = np.concatenate([values, np.broadcast_to(number, (*values.shape[:2], 1))], 2)
            wedges = native.module.wedges(arrays.triangles, np.ascontiguousarray(values))
        computed = native.module.decimate(
            arrays.vertices,
            arrays.triangles,
            built,
            to_world=matrix,
            locked=self.locked if self.locked.any() else None,
            shares=self.shares,
            wedges=wedges,
            progress=progress,
            **self.options,
        )
        result = transfer.Decimated.of(computed, arrays)
        clock.append(time.perf_counter())
        decimated = snapshots.Surface(mesh_io.MeshArrays(result.vertices, result.triangles, None, None), matrix)
        kept = computed.report["outside"]["faces"]
        certified = certify(decimated, self.reference, self.tolerance, kept, threads, progress)
        if kept:
            before = measure.largest_distance(
                (self.reference.world(), self.reference.arrays.triangles),
                (self.surface.world(), self.surface.arrays.triangles),
                self.tolerance,
                threads,
                progress,
            )
            certified["outside"]["backward_before"] = before.upper
        certified["solidity"] = solidity.compared(
            *(solidity.facts(surface, threads, progress) for surface in (self.surface, decimated))
        )
        clock.append(time.perf_counter())
        seconds = dict(zip(stages, np.diff(clock).tolist()))
        run = report.decimation_run(
            self.surface.arrays, result, computed.report, built, certified, self.options, seconds, holes
        )
        if wedges is not None:
            self._name_corners(run, arrays.triangles, wedges)
        if not report.proved(run):
            raise NotProved(report.intervals(run))
        return arrays, self.reference, result, run

    def _close(self, arrays, volume, progress):
        """Returns the arrays with holes closed, and the report of them."""
        closed = native.module.close_holes(
            arrays.vertices,
            arrays.triangles,
            volume,
            to_world=self.surface.matrix,
            shares=self.shares,
            threads=self.options["threads"],
            progress=progress,
            **self.close_holes,
        )
        arrays, holes = filling.filled(arrays, closed, self.selected, self.uvs)
        return arrays, holes | self.close_holes | {"warnings": closed.report["warnings"]}

    def _name_corners(self, run, triangles, wedges):
        """Counts the vertices where three or more UV islands meet. They have to stay, so a UV map of many islands leaves
        little to decimate: the run warns of that."""
        meeting = int(protect.meeting(triangles, wedges).sum())
        if meeting:
            run["locked"][kept_warnings.ISLANDS] = meeting
        vertices = len(np.unique(triangles))
        if 2 * meeting > vertices:
            run["warnings"].append(
                f"{meeting:,} of {vertices:,} vertices have to stay, because three or more UV islands meet at each of "
                "them; remove UV maps that are not needed"
            )
