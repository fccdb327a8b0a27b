# SPDX-License-Identifier: GPL-3.0-or-later
"""Selects the vertices that a decimation has to leave where they are."""

import bpy
import numpy as np

from ..mesh import mesh_io, protect
from .blocked import allowed, object_blocked


class TOLVOL_OT_select_staying(bpy.types.Operator):
    """Switch to Edit Mode, select the vertices at which three or more UV islands meet, and bring them into view. Decimation \
keeps these vertices, because the corners of all the islands end there"""

    bl_idname = "tolvol.select_staying"
    bl_label = "Select Staying Vertices"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        reason = object_blocked(ob)
        if not reason and not ob.data.uv_layers:
            reason = f"{ob.name} has no UV maps"
        return allowed(cls, reason)

    def execute(self, context):
        mesh = context.active_object.data
        chosen = protect.where_islands_meet(mesh_io.read_mesh(mesh), mesh_io.corner_uvs(mesh))
        if not chosen.any():
            self.report({"INFO"}, "Three or more UV islands meet nowhere")
            return {"CANCELLED"}
        mesh_io.select_vertices(mesh, chosen)
        show_selected(context, context.active_object, (True, False, False))
        self.report({"INFO"}, f"{np.count_nonzero(chosen):,} of {len(chosen):,} vertices selected")
        return {"FINISHED"}


def show_selected(context, ob, mode):
    """Enters Edit Mode of `ob` with this selection mode and brings what is selected into view if there is a 3D view."""
    context.view_layer.objects.active = ob  # While a job ran, the user may have chosen another object.
    context.tool_settings.mesh_select_mode = mode
    bpy.ops.object.mode_set(mode="EDIT")
    area = context.area
    if area is None or area.type != "VIEW_3D" or bpy.app.background:
        return
    region = next(region for region in area.regions if region.type == "WINDOW")
    with context.temp_override(region=region):
        bpy.ops.view3d.view_selected()
