# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing anew what shows something that Blender does not know to have changed."""

import bpy


def redraw_views():
    """All 3D views, with the panels in their sidebars."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
