# SPDX-License-Identifier: GPL-3.0-or-later
"""Edit > Preferences > Add-ons: the compiled module, and how many threads it may use."""

import bpy
from bpy.props import BoolProperty, IntProperty

from . import native, volume


class TOLVOL_AP_preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    threads: IntProperty(
        name="Threads",
        description="Threads that a computation may use; 0 uses all cores. Results are the same for any number",
        default=0,
        min=0,
        soft_max=64,
    )
    use_gl: BoolProperty(
        name="Draw in 3D Views",
        description="Let Show Deviation draw by the graphics driver. Turned off, the add-on does everything else as before",
        default=True,
        update=lambda _preferences, _context: volume.notify(),
    )

    def draw(self, _context):
        self.layout.use_property_split = True
        if native.module is None:
            self.layout.label(text=native.reason, icon="ERROR")
            return
        self.layout.label(text=f"Compiled module {native.module.__version__}, {native.path}")
        self.layout.prop(self, "threads")
        self.layout.prop(self, "use_gl")


def threads(context):
    """The person's choice; all cores where the package is not installed as an add-on."""
    addon = context.preferences.addons.get(__package__)
    return addon.preferences.threads if addon else 0


def use_gl(context):
    """Whether the add-on may draw in 3D views."""
    addon = context.preferences.addons.get(__package__)
    return addon.preferences.use_gl if addon else True


def register():
    bpy.utils.register_class(TOLVOL_AP_preferences)


def unregister():
    bpy.utils.unregister_class(TOLVOL_AP_preferences)
