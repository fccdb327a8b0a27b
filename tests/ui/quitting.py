# SPDX-License-Identifier: GPL-3.0-or-later
"""Quits Blender while the add-on is at work: blender --python tests/ui/quitting.py -- WHAT.

The outcome is Blender's exit code and its output."""

import sys
from pathlib import Path

import bpy

FOLDER = Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(FOLDER.parents[1]), str(FOLDER)]
bpy.context.preferences.view.show_splash = False
bpy.context.preferences.view.use_save_prompt = False

import addon  # noqa: E402
import job_time  # noqa: E402
from addon.background import thread  # noqa: E402
from addon.reference import snapshots  # noqa: E402
from window import draw_finely, window_context  # noqa: E402

draw_finely(False)

_TICK = 0.05
_MOST_TICKS = 2000


def mesh(across):
    """Makes a flat grid with 2 * across^2 triangles the active object."""
    for ob in list(bpy.data.objects):
        bpy.data.objects.remove(ob)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=across, y_subdivisions=across)
    ob = bpy.context.object
    ob.tolvol.show_deviation = False
    return ob


def decimating():
    ob = mesh(200)
    for i, vertex in enumerate(ob.data.vertices):
        vertex.co.z = 1e-3 * (i % 7)
    ob.tolvol.effort, ob.tolvol.tolerance_percent = "THOROUGH", 0.3
    bpy.ops.tolvol.decimate("INVOKE_DEFAULT")


def fitting():
    mesh(300).modifiers.new("decimate", "DECIMATE")
    bpy.ops.tolvol.fit_modifier("INVOKE_DEFAULT")


def guarding():
    ob = mesh(707)
    snapshots.set_reference(ob, snapshots.surface_of(ob))
    ob.tolvol.guard.sculpting = True
    bpy.ops.object.mode_set(mode="SCULPT")


def showing():
    ob = mesh(400)
    ob.tolvol.show_deviation = True
    snapshots.set_reference(ob, snapshots.surface_of(ob))


def start():
    with window_context():
        globals()[sys.argv[sys.argv.index("--") + 1]]()


_ticks = iter(range(_MOST_TICKS))


def leave():
    """Quits as soon as a thread is at work."""
    if not thread.at_work():
        return _TICK if next(_ticks, None) is not None else None
    print("at work", flush=True)
    with window_context():
        bpy.ops.wm.quit_blender()
    return None


addon.register()
# On a slow machine drawing may take longer than the work once. The context ends with the process.
endless = job_time.unending()
endless.__enter__()
bpy.app.timers.register(start, first_interval=1.0)
bpy.app.timers.register(leave, first_interval=1.0 + _TICK)
