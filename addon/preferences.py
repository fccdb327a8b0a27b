# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences, in Edit > Preferences > Add-ons: default tolerance, threads, and drawing in 3D views."""

from pathlib import Path

import bpy
import gpu
from bpy.props import BoolProperty, FloatProperty, IntProperty

from . import native
from .reference import built, snapshots
from .wrapping import text_lines

# The tolerance of an object for which no other was chosen, in percent of the size.
TOLERANCE = 0.2
# The options of all properties that hold a tolerance in percent of the size.
PERCENT = {
    "min": 1e-5,  # The field shows as many digits. float32 cannot hold a third of it.
    "max": 100.0,
    "soft_min": 0.01,
    "soft_max": 2.0,  # The slider is as wide as the panel: the less it spans, the finer it is to drag.
    "step": 1,
    "precision": 3,
    "subtype": "PERCENTAGE",
}


_PROBLEM = "report-a-problem"  # the anchor of the manual's section


def manual():
    """Returns the path of the manual: in the package a page beside the add-on's files, in a checkout the file in docs/."""
    folder = Path(__file__).resolve().parent
    packed = folder / "manual.html"
    return packed if packed.is_file() else folder.parent / "docs" / "manual.md"


class TOLVOL_AP_preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    tolerance: FloatProperty(
        name="Default Tolerance",
        description="The tolerance of an object until another one is chosen for it, in percent of the reference's size",
        default=TOLERANCE,
        **PERCENT,
        update=lambda _preferences, _context: snapshots.notify(),
    )
    threads: IntProperty(
        name="Threads",
        description="The number of threads that a computation may use. 0 uses all cores. Results do not depend on it",
        default=0,
        min=0,
        soft_max=64,
    )
    use_gl: BoolProperty(
        name="Draw in 3D Views",
        description="Let Show Deviation draw in 3D views with the graphics driver. Everything else works without it. If "
        "the driver has refused to draw, turning this off and on again makes another try",
        default=True,
        update=lambda _preferences, _context: snapshots.notify(),
    )

    def draw(self, context):
        self.layout.use_property_split = True
        row, page = self.layout.row(align=True), manual().as_uri()
        row.operator("wm.url_open", text="Manual", icon="HELP").url = page
        row.operator("wm.url_open", text="Report a Problem", icon="URL").url = f"{page}#{_PROBLEM}"
        self.layout.operator("tolvol.copy_problem_report", icon="COPYDOWN")
        if native.module is None:
            text_lines(context, self.layout, native.reason, "ERROR")
            return
        text_lines(context, self.layout, f"Compiled module {native.module.__version__}, {native.path}", "NONE")
        self.layout.prop(self, "tolerance")
        self.layout.prop(self, "threads")
        self.layout.prop(self, "use_gl")
        if text := _volume(context.active_object):
            text_lines(context, self.layout, text, "INFO")
        if not bpy.app.background:  # Without a window Blender crashes when it is asked for the renderer.
            text_lines(context, self.layout, f"3D views are drawn by {gpu.platform.renderer_get()}", "INFO")


def _volume(ob):
    """Returns the cost of the tolerance volume of `ob` as text, or None if it has none in memory."""
    if ob is None or ob.type != "MESH" or ob.tolvol.snapshot is None or not snapshots.sound(ob.tolvol.snapshot_size):
        return None
    volume = built.volume_of(ob)
    if volume is None:
        return None
    return (
        f"The tolerance volume of {ob.name} took {volume.seconds:.2f} s to build and takes {volume.memory / 1e6:.3g} MB"
    )


def _chosen(context, name, otherwise):
    """Returns the value of a preference, or `otherwise` if the package is not installed as an add-on."""
    addon = context.preferences.addons.get(__package__)
    return getattr(addon.preferences, name) if addon else otherwise


def tolerance(context):
    """Returns the default tolerance, in percent of the size."""
    return _chosen(context, "tolerance", TOLERANCE)


def threads(context):
    """Returns the number of threads that a computation may use, or None for all cores."""
    return _chosen(context, "threads", 0) or None


def use_gl(context):
    """Whether the add-on may draw in 3D views."""
    return _chosen(context, "use_gl", True)


def register():
    bpy.utils.register_class(TOLVOL_AP_preferences)


def unregister():
    bpy.utils.unregister_class(TOLVOL_AP_preferences)
