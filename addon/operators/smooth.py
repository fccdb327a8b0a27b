# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoothing within the tolerance."""

import bpy
import numpy as np
from bpy.props import IntProperty

from .. import mesh_io, native, preferences, protect
from ..errors import Refused
from ..job import JobOperator
from ..motion import Motion
from ..operation_settings import smooth_settings
from . import settings as shared
from .blocked import allowed, decimate_blocked

_MODES = {"OBJECT", "EDIT"}


def draw_smooth_settings(layout, settings, ob):
    """The same rows in the panel and in Adjust Last Operation."""
    layout.prop(settings, "iterations")
    for name in ("method", "weights", "boundary"):
        layout.prop(settings, name)
    shared.draw_vertex_group(layout, settings, ob)


class TOLVOL_OT_smooth(JobOperator, bpy.types.Operator):
    """Smooth the mesh as far as it stays within the tolerance of the reference. Without a reference this mesh as it is \
becomes it. In Edit Mode: the selected vertices"""

    bl_idname = "tolvol.smooth"
    bl_label = "Smooth in Tolerance"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = smooth_settings({"SKIP_SAVE"})
    threads: IntProperty(options={"HIDDEN", "SKIP_SAVE"}, min=0)

    @classmethod
    def poll(cls, context):
        return allowed(cls, decimate_blocked(context.active_object, _MODES))

    def draw(self, context):
        self.layout.use_property_split = True
        draw_smooth_settings(self.layout, self, context.active_object)

    def prepare(self, context):
        context.view_layer.update()
        ob = self.ob
        shared.take(self, ob.tolvol.smooth, smooth_settings())
        if ob.mode == "EDIT" and ob.active_shape_key_index > 0:
            basis = ob.data.shape_keys.reference_key.name
            raise Refused(f"What is smoothed is the mesh of {ob.name}: choose its shape key {basis} first")
        motion = Motion(ob, self.threads or preferences.threads(context))
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

        def work(progress):
            smoothed = native.module.smooth(
                motion.before,
                motion.surface.arrays.triangles,
                motion.volume(progress),
                to_world=motion.surface.matrix,
                threads=motion.threads,
                progress=progress,
                **options,
            )
            # What was smoothed is inside as Blender shows its quads; held, it is however they are cut.
            vertices = motion.hold(smoothed.vertices, progress)
            return motion, vertices, smoothed.report, motion.certify(vertices, progress)

        return work

    def finish(self, context, outcome):
        motion, vertices, run, certified = outcome
        ob = self.ob
        if np.array_equal(vertices, motion.before):
            raise Refused(f"Nothing of {ob.name} can be smoothed: it is even, or all of its vertices have to stay")
        certified = motion.settle(vertices, certified)
        motion.write(ob, vertices, certified)
        shared.give(self, ob.tolvol.smooth, smooth_settings())
        for warning in run["warnings"]:
            self.report({"WARNING"}, warning)
        held = max(run["held_back"], default=0)
        remarks = [f"{self.iterations:,} iterations", *motion.moved(vertices, vertices)]
        remarks += [f"up to {held:,} held back"] * bool(held)
        self.report({"INFO"}, motion.line(remarks, certified))
