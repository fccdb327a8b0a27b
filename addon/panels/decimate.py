# SPDX-License-Identifier: GPL-3.0-or-later
import json

import bpy

from .. import report, volume
from ..operators import blocked
from ..operators.decimate import draw_decimate_settings
from .layout import SubPanel, text_lines


class TOLVOL_PT_decimate(SubPanel, bpy.types.Panel):
    bl_label = "Decimate"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        ob = context.active_object
        draw_decimate_settings(layout, ob.tolvol)
        layout.operator("tolvol.decimate", text="Decimate")
        if ob.tolvol.last_run and ob.tolvol.last_run_of == volume.shown_fingerprint(ob):
            text_lines(context, layout, report.counts(json.loads(ob.tolvol.last_run)), "CHECKMARK")
        reason = blocked.decimate_blocked(ob)
        # The panel above says what is wrong with the reference.
        if reason and reason not in (
            blocked.object_blocked(ob),
            blocked.reference_blocked(ob),
            blocked.check_blocked(ob),
        ):
            text_lines(context, layout, reason, "ERROR")
