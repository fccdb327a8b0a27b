# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds entries to menus of the 3D view: to Object in Object Mode and to Vertex in Edit Mode."""

import bpy

# All operators are in this menu, because Blender's menu search (F3) finds only entries of menus.
_IN_OBJECT_MENU = (
    *("set_reference", "clear_reference", "restore_original", "new_original"),
    *(
        "check",
        "measure_statistics",
        "worst_point",
        "select_outside",
        "select_crossing",
        "select_staying",
        "save_report",
    ),
    *("probe", "add_label", "renew_labels", "remove_label"),
    *("decimate", "make_lods", "show_level", "smooth", "apply_modifier", "fit_modifier", "deform"),
    *("shade_by_reference", "bake_normals"),
)


def _object_menu(self, _context):
    self.layout.separator()
    self.layout.menu("TOLVOL_MT_object")


def _vertex_menu(self, _context):
    self.layout.separator()
    self.layout.operator("tolvol.smooth")


class TOLVOL_MT_object(bpy.types.Menu):
    bl_label = "Tolerance"

    def draw(self, _context):
        for name in _IN_OBJECT_MENU:
            self.layout.operator(f"tolvol.{name}")


def register():
    bpy.utils.register_class(TOLVOL_MT_object)
    bpy.types.VIEW3D_MT_object.append(_object_menu)
    bpy.types.VIEW3D_MT_edit_mesh_vertices.append(_vertex_menu)


def unregister():
    bpy.types.VIEW3D_MT_edit_mesh_vertices.remove(_vertex_menu)
    bpy.types.VIEW3D_MT_object.remove(_object_menu)
    bpy.utils.unregister_class(TOLVOL_MT_object)
