#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how long a window of Blender answers nothing when a button of the add-on is pressed for a mesh of two million faces.

/usr/bin/python3 benchmark/two_million.py [--triangles 2] [--buttons check decimate] [--no-esc] [--write FILE.md]

The mesh is a noisy torus, in one Blender on a virtual screen, with the tab Tolerance open. A timer that is called as often as
Blender takes events tells when it takes none. The object is drawn as a box, because Blender's own drawing of so many faces in
software would hide everything else: benchmark/redraw.py measures that. The script needs Xvfb and xdotool.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), *(str(ROOT / name) for name in ("benchmark", "tests/ui", "tests/blender", "tests/python"))]
MILLION = 1_000_000
LIMIT = 30  # seconds after which a button's work is cancelled: the table then says that it takes longer
REST = 0.5  # seconds after a button's work in which what it leads to is measured, too
ESCAPES = 0.02, 0.5  # when Esc is pressed, as shares of the time that the button took without
LATEST = 15  # seconds after which Esc is pressed at the latest
HEADS = ["Button", "First sign, s", "Begin, s", "Job, s", "End, s", "Esc, s", "Memory, MB", "Whole, s"]
BUMP = 2e-3  # how far the largest vertex is moved, as a share of the torus's radius, so that faces are outside the tolerance


class Beats:
    """Notes when Blender takes events, and whether the add-on is at work then."""

    def __init__(self):
        self.noted = []
        self.drawn = []  # when Blender has drawn the status bar with a text of the add-on

    def begin(self):
        from peak_memory import PeakMemory

        self.noted.clear()
        self.drawn.clear()
        self.memory = PeakMemory()
        self.note()

    def note_drawn(self, *_):
        from addon import status_bar

        if status_bar.showing():
            self.drawn.append(time.monotonic())

    def first(self):
        """Returns the seconds until the button's work was seen: in the status bar, or else because it was done."""
        return (self.drawn or [self.noted[1][0]])[0] - self.noted[0][0]

    def note(self):
        from addon import job

        self.noted.append((time.monotonic(), job.under_way() is not None))

    def gaps(self):
        """Returns the longest times between two notes: until a job has begun, while it was at work, and from its end on."""
        longest = [0.0, 0.0, 0.0]
        has_begun = False
        for (before, was), (now, is_) in zip(self.noted, self.noted[1:]):
            part = 0 if not was and not has_begun else 1 if was and is_ else 2
            has_begun |= is_
            longest[part] = max(longest[part], now - before)
        return longest


def buttons():
    """Returns {name: (the scene that it needs, a function that presses the button, whether Esc is tried)}."""
    import bpy

    from addon.operators import original

    def operator(name, **options):
        return lambda: getattr(bpy.ops.tolvol, name)("INVOKE_DEFAULT", True, **options)

    def switch(path, value):
        def press():
            owner, _, name = path.rpartition(".")
            thing = bpy.context.object.tolvol
            setattr(thing.path_resolve(owner) if owner else thing, name, value)
            bpy.ops.ed.undo_push(message=name)

        return press

    def show_original():
        original._shown.append(original._Shown(bpy.context, bpy.context.object))

    def in_mode(mode, guard=None):
        def press():
            if guard:
                setattr(bpy.context.object.tolvol.guard, guard, True)
            bpy.ops.object.mode_set(mode=mode)

        return press

    folder = tempfile.gettempdir()
    return {
        "Set Reference": ("plain", operator("set_reference"), True),
        "Decimate": ("plain", operator("decimate"), True),
        "LOD Chain": ("plain", operator("make_lods"), True),
        "Smooth": ("plain", operator("smooth"), True),
        "Deform": ("plain", operator("deform"), True),
        "Fit": ("plain", operator("fit_modifier"), True),
        "Apply": ("plain", operator("apply_modifier"), True),
        "Select Crossing Faces": ("moved", operator("select_crossing"), True),
        "Check": ("moved", operator("check"), True),
        "Measure Statistics": ("moved", operator("measure_statistics"), True),
        "Worst Point": ("moved", operator("worst_point"), True),
        "Select Outside": ("moved", operator("select_outside"), True),
        "Save Report": ("moved", operator("save_report", filepath=f"{folder}/tolvol_two_million.html"), True),
        "Shade by Reference": ("moved", operator("shade_by_reference"), True),
        "Replace Reference, the question": ("moved", operator("set_reference"), False),
        "Replace Reference": ("moved", operator("set_reference", replace=True), True),
        "Clear Reference, the question": ("moved", operator("clear_reference"), False),
        "Show Deviation, off": ("moved", switch("show_deviation", False), False),
        "Show Original": ("moved", show_original, False),
        "Restore Original": ("moved", operator("restore_original", sure=True), False),
        "Original as New Object": ("moved", operator("new_original"), False),
        "Guard, Sculpt Mode": ("moved", in_mode("SCULPT", "sculpting"), False),
        "Guard, Edit Mode": ("moved", in_mode("EDIT", "editing"), False),
        "Keep: One Way": ("moved", switch("keep", "ONE"), False),
        "Tolerance": ("moved", switch("tolerance_percent", 0.3), False),
        "Blender: an undo step": ("moved", lambda: bpy.ops.ed.undo_push(message="one"), False),
        "Blender: Edit Mode": ("moved", in_mode("EDIT"), False),
        "Blender: Sculpt Mode": ("moved", in_mode("SCULPT"), False),
    }


def in_blender(count, chosen, escapes):
    """Measures in Blender, and prints the results as lines for main()."""
    import bpy

    import addon
    import meshes
    import window
    from addon import job, status_bar
    from addon.mesh import mesh_io

    preferences = bpy.context.preferences
    preferences.view.show_splash = preferences.view.show_tooltips = False
    preferences.edit.undo_memory_limit = 0
    addon.register()
    beats, folder = Beats(), tempfile.TemporaryDirectory(prefix="tolvol-")
    bpy.types.STATUSBAR_HT_header.append(beats.note_drawn)

    def make_scenes():
        """Saves the scenes that the buttons need."""
        for ob in list(bpy.data.objects):
            bpy.data.objects.remove(ob)
        columns = round((1.25 * count) ** 0.5)
        vertices, triangles = meshes.torus(columns, round(count / 2 / columns), noise=BUMP / 2)
        ob = bpy.data.objects.new("torus", mesh_io.new_mesh("torus", vertices, triangles))
        bpy.context.scene.collection.objects.link(ob)
        ob.display_type = "BOUNDS"
        bpy.context.view_layer.objects.active = ob
        ob.select_set(True)
        cage = bpy.data.objects.new("cage", bpy.data.lattices.new("cage"))
        bpy.context.scene.collection.objects.link(cage)
        cage.scale = 4, 4, 4
        cage.data.points[0].co_deform.x += 0.05
        ob.tolvol.lattice = cage
        ob.modifiers.new("fewer", "DECIMATE").ratio = 0.5
        ob.modifiers.new("smooth", "SMOOTH").iterations = 1
        for modifier in ob.modifiers:
            modifier.show_viewport = False
        yield
        bpy.ops.wm.save_as_mainfile(filepath=f"{folder.name}/plain.blend", compress=False)
        bpy.ops.tolvol.set_reference()
        ob.data.vertices[len(vertices) // 3].co *= 1 + 10 * BUMP
        ob.data.update()
        yield
        bpy.ops.wm.save_as_mainfile(filepath=f"{folder.name}/moved.blend", compress=False)

    def working():
        return job.under_way() or status_bar.showing()

    def pressed(scene, press, escape=None):
        """Presses a button, and Esc so many seconds later. Returns the seconds from Esc to the end of the work."""
        bpy.ops.wm.open_mainfile(filepath=f"{folder.name}/{scene}.blend", load_ui=False)
        yield 1.0
        yield from window.at_rest()
        window.xdotool("mousemove", *window.centre())
        yield 0.2
        beats.begin()
        if escape is not None:
            words = ["sh", "-c", f"sleep {escape}; date +%s.%N; xdotool key Escape"]
            keys = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        with window.window_context():
            press()
        end = time.monotonic() + LIMIT
        yield
        while working():
            if time.monotonic() > end and job.under_way():
                job.under_way().progress.cancel()
            yield
        ended = time.time()
        if escape is not None:
            return ended - float(keys.communicate()[0])
        rest = time.monotonic() + REST
        while time.monotonic() < rest or window._at_work(("estimate",)):
            yield
        return ended - (time.time() - time.monotonic()) - beats.noted[0][0]

    def run():
        yield from window.close_other_areas()
        yield from window.open_tab()
        yield from make_scenes()
        for name, (scene, press, cancels) in buttons().items():
            if chosen and not any(word.lower() in name.lower() for word in chosen):
                continue
            whole = yield from pressed(scene, press)
            cells = [f"{beats.first():.2f}", *(f"{gap:.2f}" for gap in beats.gaps())]
            memory = f"{max(beats.memory.peak() - beats.memory.before, 0) / 1e6:,.0f}"
            lasted, took = f"{whole:.1f}" if whole < LIMIT else f"> {LIMIT}", []
            for share in ESCAPES if cancels and escapes else ():
                took.append((yield from pressed(scene, press, min(share * whole, LATEST))))
            # An operator that had ended before Esc was pressed tells nothing.
            took = [seconds for seconds in took if seconds > 0]
            print("measured", name, *cells, f"{max(took):.2f}" if took else "", memory, lasted, sep="\t", flush=True)
        print("done", flush=True)

    current = run()
    pause = [0.0]

    def step():
        beats.note()
        if time.monotonic() < pause[0]:
            return 0.0
        try:
            wait = next(current)
        except StopIteration:
            os._exit(0)
        except BaseException:
            import traceback

            traceback.print_exc()
            sys.stdout.flush()
            os._exit(1)
        pause[0] = time.monotonic() + (wait or 0.0)
        return 0.0

    bpy.app.timers.register(step, first_interval=1.5, persistent=True)


def main():
    import tables
    from machine import machine

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=float, default=2, help="millions")
    parser.add_argument(
        "--buttons", nargs="+", default=[], metavar="WORD", help="only those whose name has such a word"
    )
    parser.add_argument("--no-esc", action="store_true", help="do not press Esc")
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    options = parser.parse_args()
    blender = ["blender", "--factory-startup", "--window-geometry", "0", "278", "720", "746", "--python-exit-code", "1"]
    screen = ["xvfb-run", "--auto-servernum", "--server-args", "-screen 0 1280x1024x24 +extension GLX"]
    words = [str(round(options.triangles * MILLION)), str(int(not options.no_esc)), *options.buttons]
    rows = []
    environment = os.environ | {"LIBGL_ALWAYS_SOFTWARE": "1", "TOLVOL_UI_OUT": "build/ui"}
    command = [*screen, *blender, "--python", __file__, "--", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        for line in process.stdout:
            if line.startswith("measured"):
                rows.append(line.rstrip("\n").split("\t")[1:])
                print(*rows[-1], sep=" | ", flush=True)
            elif "Error" in line or "Traceback" in line or line.startswith("  "):
                print(line, end="", flush=True)
    if process.returncode:
        sys.exit("two_million.py: Blender has failed")
    tables.publish(options.write, "two million", f"{machine()}.\n\n{tables.table(HEADS, rows, 'lrrrrrrr')}")


if "bpy" in sys.modules:
    given = sys.argv[sys.argv.index("--") + 1 :]
    in_blender(int(given[0]), given[2:], given[1] == "1")
elif __name__ == "__main__":
    main()
