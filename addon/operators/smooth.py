# SPDX-License-Identifier: GPL-3.0-or-later
"""Smooths meshes within the tolerance."""

import bpy
import numpy as np

from .. import native, preferences
from ..job import WRITE, JobOperator
from ..mesh import mesh_io, protect
from ..operation_settings import smooth_settings, threads_setting
from ..proof import kept_warnings
from ..shared.errors import Refused
from ..shared.proof.verdict import PASS
from ..wrapping import property_fields
from . import settings as shared
from .blocked import allowed, decimate_blocked
from .motion import Motion

_MODES = {"OBJECT", "EDIT"}


def draw_smooth_settings(context, layout, settings, ob):
    """Draws the settings of smoothing, for the panel and for Adjust Last Operation."""
    property_fields(context, layout, settings, "iterations", "method", "weights", "boundary")
    shared.draw_vertex_group(layout, settings, ob)


class TOLVOL_OT_smooth(JobOperator, bpy.types.Operator):
    """Smooth the mesh as far as it stays within the tolerance of the reference. In Edit Mode, smooth the selected vertices \
of all edited meshes. An object without a reference gets one first, as by Set Reference"""

    bl_idname = "tolvol.smooth"
    bl_label = "Smooth in Tolerance"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = smooth_settings({"SKIP_SAVE"})
    threads: threads_setting()

    @classmethod
    def poll(cls, context):
        return allowed(cls, decimate_blocked(context.active_object, _MODES))

    def draw(self, context):
        self.layout.use_property_split = True
        draw_smooth_settings(context, self.layout, self, context.active_object)

    def targets(self, context):
        """Returns the active object, in Edit Mode together with all other meshes that are edited."""
        active = context.active_object
        edited = [ob for ob in context.view_layer.objects if ob.type == "MESH" and ob.mode == "EDIT" and ob != active]
        return [active, *(edited if active.mode == "EDIT" else [])]

    def steps(self, context):
        context.view_layer.update()
        shared.take(self, self.ob.tolvol.smooth, smooth_settings())
        chosen = [i for i, ob in enumerate(self.objects) if _anything_to_smooth(ob)]
        if not chosen:
            raise Refused(f"No vertex of {_names(self.objects)} is selected")
        tasks = []
        for i in chosen:
            tasks.append((yield from self._task(context, self.objects[i])))
        outcomes = yield from self.each(tasks, steps=_Task.steps)
        yield WRITE
        self.finish([self.objects[i] for i in chosen], outcomes)

    def _task(self, context, ob):
        """A generator for steps(): returns the _Task of an object."""
        if reason := decimate_blocked(ob, _MODES):
            raise Refused(f"{ob.name}: {reason}")
        if ob.mode == "EDIT" and ob.active_shape_key_index > 0:
            basis = ob.data.shape_keys.reference_key.name
            raise Refused(f"Smoothing changes the base mesh of {ob.name}: choose the shape key {basis} first")
        motion = yield from Motion.of(ob, self.threads or preferences.threads(context))
        locked = np.zeros(len(motion.before), bool)
        locked[mesh_io.loose_edges(ob.data)] = True
        if ob.mode == "EDIT":
            locked |= protect.unselected_vertices(ob)
        options = {
            "iterations": self.iterations,
            "operator": self.method.lower(),
            "weights": self.weights.lower(),
            "boundary": self.boundary.lower(),
            "locked": locked,
            "strength": protect.group_weights(ob, self.vertex_group, self.invert_vertex_group),
        }
        return _Task(ob.name, motion, options)

    def finish(self, objects, outcomes):
        moved = [(ob, *outcome) for ob, outcome in zip(objects, outcomes) if outcome is not None]
        if not moved:
            names = _names(objects)
            raise Refused(
                f"Smoothing does not move any vertex of {names}: the surface is smooth, or all its vertices have to stay"
            )
        # All results are certified before the first mesh is changed.
        for ob, motion, vertices, certified, report in moved:
            motion.write(ob, vertices, certified, "smooth")
            shared.give(self, ob.tolvol.smooth, smooth_settings())
            kept_warnings.keep(ob, report["warnings"])
            self._say(motion, vertices, certified, report, f"{ob.name}: " if len(moved) > 1 else "")

        if len(moved) > 1:
            self._report_totals(moved)

    def _report_totals(self, moved):
        count = sum(motion.count_moved(vertices) for _, motion, vertices, _, _ in moved)
        vertices = sum(len(vertices) for _, _, vertices, _, _ in moved)
        passed = sum(motion.verdict(certified).passed for _, motion, _, certified, _ in moved)
        counts = f"{count:,} of {vertices:,} vertices moved, {passed} of {len(moved)} {PASS}"
        self.say({"INFO"}, f"{len(moved)} objects: {counts}")

    def _say(self, motion, vertices, certified, report, prefix):
        for warning in report["warnings"]:
            self.say({"WARNING"}, prefix + warning)
        held = max(report["held_back"], default=0)
        remarks = [f"{self.iterations:,} iterations", *motion.moved(vertices, vertices)]
        remarks += [f"up to {held:,} held back"] * bool(held)
        self.say({"INFO"}, prefix + motion.line(remarks, certified))


def _anything_to_smooth(ob):
    if ob.mode != "EDIT":
        return True
    ob.update_from_editmode()
    return ob.data.total_vert_sel > 0


def _names(objects):
    return ", ".join(ob.name for ob in objects)


class _Task:
    """The work on one object."""

    def __init__(self, name, motion, options):
        self.name = name
        self._motion = motion
        self._options = options

    def steps(self):
        """A generator for the operator's steps(): returns (motion, vertices, certified, report), or None if no vertex moves."""
        motion = self._motion
        vertices, report = yield self._smooth
        vertices, certified = yield from motion.settle(vertices)
        return None if np.array_equal(vertices, motion.before) else (motion, vertices, certified, report)

    def _smooth(self, progress):
        motion = self._motion
        smoothed = native.module.smooth(
            motion.before,
            motion.surface.arrays.triangles,
            motion.volume(progress),
            to_world=motion.surface.matrix,
            two_sided=motion.two_sided,
            crossings=motion.crossings,
            threads=motion.threads,
            progress=progress,
            **self._options,
        )
        # smooth() knows the triangulation of quads that Blender shows; hold() keeps the tolerance in both.
        return motion.hold(smoothed.vertices, progress), smoothed.report
