# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates meshes within the tolerance: computes and certifies on arrays, then writes each mesh in one go."""

import contextlib

import bpy
from bpy.props import BoolProperty

from .. import preferences
from ..job import WRITE, JobOperator
from ..mesh import transfer
from ..operation_settings import PROTECTED, decimate_settings, threads_setting
from ..proof import verdict
from ..properties import automatic_placement, placement_setting, tolerance_settings
from ..reference import snapshots, tolerances
from ..shared.errors import Refused
from ..shared.proof import report
from ..wrapping import fits_tick, property_fields
from . import decimation, original
from . import settings as shared
from .blocked import allowed, decimate_blocked
from .mesh_and_reference import mesh_and_reference


def draw_decimate_settings(layout, settings):
    """Draws the settings of a decimation, for the panel and for Adjust Last Operation."""
    layout.prop(settings, "effort")
    column = layout.column(align=True)
    column.use_property_split = False  # The names of the placements need the whole width.
    column.label(text="Placement")
    column.prop(settings, "placement", expand=True)
    row = layout.row(heading="Stop At", align=True)
    row.prop(settings, "use_target", text="")
    if settings.use_target:
        row.prop(settings, "target_triangles", text="")
    layout.row(heading="Holes").prop(settings, "close_holes", text="Close")


def draw_advanced_settings(context, layout, settings):
    """Draws the settings of a decimation that hardly anybody changes, for the panel and for Adjust Last Operation."""
    property_fields(context, layout, settings, "max_seconds")
    column = layout.column()
    column.active = settings.close_holes
    property_fields(context, column, settings, "largest_perimeter")
    property_fields(context, layout, settings, "crossings", "max_normal_angle", "outside")


def draw_protect_settings(context, layout, settings, ob):
    """Draws the settings of the protected elements, for the panel and for Adjust Last Operation."""
    if fits_tick(context, "Unselected"):
        layout.row(heading="Faces").prop(settings, "only_selected", text="Unselected")
    else:
        row = layout.row()
        row.use_property_split = False
        row.prop(settings, "only_selected", text="Unselected Faces")
    column = layout.column(align=True)
    column.label(text="Edges")
    grid = column.grid_flow(columns=2, row_major=True, align=True)
    grid.use_property_split = False
    for kind, *_ in PROTECTED:
        grid.prop_enum(settings, "protect", kind)
    property_fields(context, layout, settings, "symmetry")
    shared.draw_vertex_group(layout, settings, ob)


def targets(context):
    """Returns the objects to decimate: the active one first, then all other selected meshes.

    While the original of the active object is shown, they are the same as before.
    """
    active = original.active(context)
    others = {ob for ob in (active, original.stand_in()) if ob is not None}
    return [active, *(ob for ob in context.selected_objects if ob.type == "MESH" and ob not in others)]


def blocked_others(context):
    """Yields for each selected mesh but the active one why it cannot be decimated, for the panel and poll()."""
    for ob in targets(context)[1:]:
        if reason := decimate_blocked(ob):
            yield _with_name(ob, reason)


def _with_name(ob, reason):
    return reason if reason.startswith(f"{ob.name} ") else f"{ob.name}: {reason}"


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
    placement: placement_setting(options={"SKIP_SAVE"}, update=_choose_placement)
    own_placements: BoolProperty(
        description="No placement was chosen: the placement depends on the UV maps of each mesh",
        options={"HIDDEN", "SKIP_SAVE"},
    )
    threads: threads_setting()

    @classmethod
    def poll(cls, context):
        return allowed(cls, decimate_blocked(context.active_object) or next(blocked_others(context), None))

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        column = layout.column(align=True)
        column.prop(self, "tolerance_percent" if self.tolerance_mode == "PERCENT" else "tolerance_length")
        column.prop(self, "tolerance_mode", text=" ")
        layout.prop(self, "keep")
        draw_decimate_settings(layout, self)
        layout.label(text="Protect")
        draw_protect_settings(context, layout, self, context.active_object)
        draw_advanced_settings(context, layout, self)

    def targets(self, context):
        return targets(context)

    def steps(self, context):
        context.view_layer.update()
        self._take_settings(self.ob.tolvol)
        tasks = []
        for ob in self.objects:
            if reason := decimate_blocked(ob):
                raise Refused(_with_name(ob, reason))
            tasks.append((yield from self._task(context, ob)))
        # The tolerance is stored in the other unit too, so that changing the unit in Adjust Last Operation keeps it.
        other = "PERCENT" if self.tolerance_mode == "LENGTH" else "LENGTH"
        tolerances.convert_tolerance(self, tasks[0].reference.size(), other)
        outcomes = yield from self.each(tasks)
        with contextlib.ExitStack() as stack:
            # All are prepared, which checks that Blender can hold all results, before the first mesh is changed.
            writes = yield from decimation.prepared(self, stack, lambda: self._writes(outcomes))
            yield WRITE
            self.finish(outcomes, writes)

    def _task(self, context, ob):
        """A generator for steps(): returns the Task of an object."""
        surface, reference = yield from mesh_and_reference(ob)
        tolerance = tolerances.tolerance_length(self, reference.size())
        placement = automatic_placement(ob.data) if self.own_placements else self.placement
        options = decimation.options(self, placement, self.threads or preferences.threads(context))
        return decimation.task(ob, surface, reference, tolerance, self, options)

    def _writes(self, outcomes):
        return [transfer.Writing(ob.data, source, result) for ob, (source, _, result, _) in zip(self.objects, outcomes)]

    def finish(self, outcomes, writes):
        with contextlib.ExitStack() as stack:
            without = [ob for ob in self.objects if ob.tolvol.snapshot is None]
            # If anything fails until the meshes are written, the objects have no reference, as before.
            stack.callback(lambda: [snapshots.clear_reference(ob) for ob in without])
            for ob, (_, reference, _, _) in zip(self.objects, outcomes):
                if ob in without:
                    snapshots.set_reference(ob, reference)
            for ob, write in zip(self.objects, writes):
                write.write(ob.data)
            without.clear()
        for ob, outcome, write in zip(self.objects, outcomes, writes):
            shared.give(self, ob.tolvol, _SHARED if self.own_placements else {*_SHARED, "placement"})
            decimation.keep(self, ob, outcome, write.layout, f"{ob.name}: " if len(self.objects) > 1 else "")
        if len(outcomes) > 1:
            self._report_totals([run for _, _, _, run in outcomes])

    def _report_totals(self, runs):
        before, after = (sum(run[way]["triangles"] for run in runs) for way in ("input", "output"))
        passed = sum(verdict.word(ob) == verdict.PASS for ob in self.objects)
        seconds = sum(sum(run["seconds"].values()) for run in runs)
        counts = f"{before:,} -> {after:,} triangles, {passed} of {len(runs)} {verdict.PASS}"
        self.say({"INFO"}, f"{len(runs)} objects: {counts}, {report.duration(seconds)}")

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


_SHARED = {*tolerance_settings(), *decimate_settings()}
