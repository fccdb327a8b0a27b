# SPDX-License-Identifier: GPL-3.0-or-later
"""Applies a modifier that only moves vertices; each vertex stops at the tolerance."""

from functools import partial

import bpy
import numpy as np
from bpy.props import StringProperty

from .. import preferences
from ..job import WRITE
from ..mesh.evaluation import Evaluation, same_faces
from ..mesh.mesh_io import column
from ..operation_settings import modifier_settings, threads_setting
from ..proof import kept_warnings
from ..shared.errors import Refused
from . import settings as shared
from .modifiers import ModifierOperator
from .motion import Motion


class TOLVOL_OT_apply_modifier(ModifierOperator, bpy.types.Operator):
    """Apply a modifier that only moves vertices, such as Smooth, to the base mesh without the other modifiers. Each vertex \
moves as far as the tolerance permits. An object without a reference gets one first, as by Set Reference"""

    bl_idname = "tolvol.apply_modifier"
    bl_label = "Apply Modifier in Tolerance"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = modifier_settings({"SKIP_SAVE"})
    modifier: StringProperty(
        name="Modifier",
        description="The name of the modifier. If none is given, the first modifier that can be applied is used",
        options={"SKIP_SAVE"},
    )
    threads: threads_setting()

    def draw(self, context):
        self.layout.use_property_split = True
        self.layout.prop(self, "result")

    def steps(self, context):
        context.view_layer.update()
        ob, name = self.ob, self.chosen(fitted=False).name
        motion = yield from Motion.of(ob, self.threads or preferences.threads(context))
        with Evaluation(ob, name) as evaluation:
            mesh = evaluation.mesh()
            if not same_faces(mesh, ob.data):
                raise Refused(
                    f"{name} changes the faces of {ob.name}: only a modifier that moves vertices can be applied within "
                    "the tolerance"
                )
            wished = column(mesh.vertices, "co", 3)
        if np.array_equal(wished, motion.before):
            raise Refused(f"{name} does not move {ob.name}: check its settings")

        vertices, certified = yield from motion.settle((yield partial(motion.hold, wished)))
        if np.array_equal(vertices, motion.before):
            raise Refused(f"The tolerance permits no movement of {ob.name} by {name}: take a larger tolerance")
        yield WRITE
        shared.give(self, self.ob.tolvol.modifiers, modifier_settings())
        ob = self.target(context)
        if self.result == "SHAPE_KEY":
            motion.keep_reference(ob)
            self._add_key(ob, name, vertices)
        else:
            motion.write(ob, vertices, certified, "apply_modifier")
        kept_warnings.keep(ob, motion.warnings)
        for warning in motion.warnings:
            self.say({"WARNING"}, warning)
        self.say({"INFO"}, f"{name}: {motion.line(motion.moved(vertices, wished), certified)}")

    @staticmethod
    def _add_key(ob, name, vertices):
        if ob.data.shape_keys is None:
            ob.shape_key_add(name="Basis")
        key = ob.shape_key_add(name=name, from_mix=False)
        key.data.foreach_set("co", vertices.ravel())
        key.value = 1.0
        ob.data.update()
