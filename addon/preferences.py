# SPDX-License-Identifier: GPL-3.0-or-later
"""Edit > Preferences > Add-ons: the compiled module, and how many threads it may use."""

import bpy
from bpy.props import IntProperty

from . import native


class TOLVOL_AP_preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    threads: IntProperty(
        name="Threads",
        description="Threads that a computation may use; 0 uses all cores. Results are the same for any number",
        default=0,
        min=0,
        soft_max=64,
    )

    def draw(self, _context):
        self.layout.use_property_split = True
        if native.module is None:
            self.layout.label(text=native.reason, icon="ERROR")
            return
        self.layout.label(text=f"Compiled module {native.module.__version__}, {native.path}")
        self.layout.prop(self, "threads")


def threads(context):
    """The person's choice; all cores where the package is not installed as an add-on."""
    addon = context.preferences.addons.get(__package__)
    return addon.preferences.threads if addon else 0


def register():
    bpy.utils.register_class(TOLVOL_AP_preferences)


def unregister():
    bpy.utils.unregister_class(TOLVOL_AP_preferences)
