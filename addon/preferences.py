# SPDX-License-Identifier: GPL-3.0-or-later
"""Edit > Preferences > Add-ons: the tolerance to begin with, the compiled module, threads, drawing."""

import bpy
import gpu
from bpy.props import BoolProperty, FloatProperty, IntProperty

from . import native
from .reference import snapshots

# Percent of the size, where nobody chose anything else.
TOLERANCE = 0.5
# What a tolerance in percent of the size may be and how it is typed.
PERCENT = {
    "min": 1e-6,
    "max": 100.0,
    "soft_min": 0.01,
    "soft_max": 10.0,
    "step": 10,
    "precision": 3,
    "subtype": "PERCENTAGE",
}


class TOLVOL_AP_preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    tolerance: FloatProperty(
        name="Default Tolerance",
        description="The tolerance of objects for which none was chosen yet, in percent of the reference's size",
        default=TOLERANCE,
        **PERCENT,
        update=lambda _preferences, _context: snapshots.notify(),
    )
    threads: IntProperty(
        name="Threads",
        description="Threads that a computation may use; 0 uses all cores. Results are the same for any number",
        default=0,
        min=0,
        soft_max=64,
    )
    use_gl: BoolProperty(
        name="Draw in 3D Views",
        description="Let Show Deviation draw by the graphics driver. Turned off, the add-on does everything else as "
        "before; turned on again, it asks a driver anew that refused",
        default=True,
        update=lambda _preferences, _context: snapshots.notify(),
    )

    def draw(self, _context):
        self.layout.use_property_split = True
        if native.module is None:
            self.layout.label(text=native.reason, icon="ERROR")
            return
        self.layout.label(text=f"Compiled module {native.module.__version__}, {native.path}")
        self.layout.prop(self, "tolerance")
        self.layout.prop(self, "threads")
        self.layout.prop(self, "use_gl")
        if not bpy.app.background:  # where asking crashes
            self.layout.label(text=f"3D views are drawn by {gpu.platform.renderer_get()}", icon="INFO")


def _chosen(context, name, otherwise):
    """The person's choice; another where the package is not installed as an add-on."""
    addon = context.preferences.addons.get(__package__)
    return getattr(addon.preferences, name) if addon else otherwise


def tolerance(context):
    """In percent, of objects for which nobody chose one."""
    return _chosen(context, "tolerance", TOLERANCE)


def threads(context):
    return _chosen(context, "threads", 0)


def use_gl(context):
    """Whether the add-on may draw in 3D views."""
    return _chosen(context, "use_gl", True)


def register():
    bpy.utils.register_class(TOLVOL_AP_preferences)


def unregister():
    bpy.utils.unregister_class(TOLVOL_AP_preferences)
