# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves the legend of a 3D view by dragging it. Each view has its own place for it, until Blender is closed."""

import bpy

from . import legend


class TOLVOL_GT_legend(bpy.types.Gizmo):
    """Drag to move the legend of this view"""

    bl_idname = "TOLVOL_GT_legend"
    __slots__ = ("_from",)

    def draw(self, _context):
        """The legend is drawn by the overlay."""

    def test_select(self, context, location):
        """Returns 0 if the mouse is over the legend, else -1."""
        box = legend.box(context.region)
        if box is None:
            return -1
        left, bottom, width, height = box
        return 0 if left <= location[0] <= left + width and bottom <= location[1] <= bottom + height else -1

    def invoke(self, context, event):
        box = legend.box(context.region)
        if box is None:
            return {"CANCELLED"}
        self._from = box[0] - event.mouse_region_x, box[1] - event.mouse_region_y, legend.moved(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event, _tweak):
        if legend.box(context.region) is not None:
            legend.move(context, self._from[0] + event.mouse_region_x, self._from[1] + event.mouse_region_y)
            context.area.tag_redraw()
        return {"RUNNING_MODAL"}

    def exit(self, context, cancel):
        if cancel:
            legend.move_back(context, self._from[2])
            context.area.tag_redraw()


class TOLVOL_GGT_legend(bpy.types.GizmoGroup):
    """Lets the mouse take hold of the legend"""

    bl_idname = "TOLVOL_GGT_legend"
    bl_label = "Legend of the Deviation"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = {"PERSISTENT", "SHOW_MODAL_ALL"}

    @classmethod
    def poll(cls, _context):
        return legend.any_drawn()

    def setup(self, _context):
        self.gizmos.new(TOLVOL_GT_legend.bl_idname)


_CLASSES = (TOLVOL_GT_legend, TOLVOL_GGT_legend)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
