#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how long Blender takes to draw its window, alone and with the overlay of the deviation, on a virtual screen.

/usr/bin/python3 benchmark/redraw.py [--triangles 0.1 2] [--write FILE.md]

The meshes are noisy tori, each in a Blender of its own, with the package that setup.sh builds. The times are the medians of
drawings of the view from different sides. The script needs Xvfb.
"""

import argparse
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(Path(__file__).resolve().parent), str(ROOT / "build/release/package"), str(ROOT / "tests/python")]
MILLION = 1_000_000
DRAWINGS = 7
PATIENCE = 300  # seconds until the overlay has to be there
HEADS = ["Triangles", "Blender alone, s", "With the overlay, s", "Times as long"]


def seconds():
    """Draws the window some times, the view turned a little each time, and returns the median of the seconds."""
    import bpy
    from mathutils import Euler

    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    took = []
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view3d.view_all()
        for _ in range(DRAWINGS):
            area.spaces[0].region_3d.view_rotation.rotate(Euler((0, 0, 0.01)))
            began = time.perf_counter()
            bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
            took.append(time.perf_counter() - began)
    return statistics.median(took)


def torus(count):
    """Makes a torus of about `count` triangles the only object, and returns it."""
    import bpy
    from tolerance_volumes.mesh import mesh_io

    import meshes

    for ob in list(bpy.data.objects):
        bpy.data.objects.remove(ob)
    columns = round((1.25 * count) ** 0.5)
    arrays = meshes.torus(columns, round(count / 2 / columns), noise=0.002)
    ob = bpy.data.objects.new("torus", mesh_io.new_mesh("torus", *arrays))
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.view_layer.objects.active = ob
    ob.select_set(True)
    return ob


def in_blender(count):
    """Measures in Blender, and prints the results as a line for main()."""
    import bpy
    import tolerance_volumes

    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.system.viewport_aa = "OFF"
    tolerance_volumes.register()
    state = {}

    def begin():
        state["ob"] = torus(count)
        seconds()  # The first drawings fill the buffers.
        state["alone"], state["began"] = seconds(), time.monotonic()
        bpy.ops.tolvol.set_reference()
        state["ob"].tolvol.show_deviation = True
        bpy.app.timers.register(wait, first_interval=1)

    def wait():
        from tolerance_volumes.overlay import geometry_buffer

        seconds()
        if not geometry_buffer._buffers and time.monotonic() < state["began"] + PATIENCE:
            return 1
        seconds()
        print("measured", len(state["ob"].data.polygons), state["alone"], seconds(), flush=True)
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(begin, first_interval=1)


def measure(count):
    """Returns (triangles, seconds alone, seconds with the overlay) of a Blender of its own."""
    blender = ["blender", "--factory-startup", "--window-geometry", "0", "278", "720", "746", "--python-exit-code", "1"]
    screen = ["xvfb-run", "--auto-servernum", "--server-args", "-screen 0 1280x1024x24 +extension GLX"]
    words = [*screen, *blender, "--python", __file__, "--", str(count)]
    output = subprocess.run(words, check=True, capture_output=True, text=True).stdout
    line = next(line for line in output.splitlines() if line.startswith("measured"))
    return tuple(map(float, line.split()[1:]))


def main():
    import tables
    from machine import machine

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=float, nargs="+", default=[0.1, 2], help="millions")
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    options = parser.parse_args()
    rows = []
    for millions in options.triangles:
        count, alone, coloured = measure(round(millions * MILLION))
        rows.append([f"{count:,.0f}", f"{alone:.2f}", f"{coloured:.2f}", f"{coloured / alone:.2f}"])
        print(*rows[-1], sep=" | ", flush=True)
    tables.publish(options.write, "redraw", f"{machine()}.\n\n{tables.table(HEADS, rows, 'rrrr')}")


if "bpy" in sys.modules:
    in_blender(int(sys.argv[sys.argv.index("--") + 1]))
elif __name__ == "__main__":
    main()
