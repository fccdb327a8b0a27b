# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes Blender draw its 3D views again after a change that Blender does not notice."""

import bpy


def redraw_sidebars():
    """Draws the sidebars of all 3D views again, without what the views show."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


def redraw_views():
    """Draws all 3D views again, with the panels in their sidebars."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
