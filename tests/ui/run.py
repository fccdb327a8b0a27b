# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tests of this folder in Blender's own event loop and ends Blender with an exit code that tells whether they pass.

A test is a generator. Where it yields nothing, Blender handles all events of the mouse and the keyboard that were sent, and
draws. Where it yields a number, Blender goes on for so many seconds.
"""

import importlib
import os
import sys
import time
import traceback
from pathlib import Path

import bpy

FOLDER = Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(FOLDER), str(FOLDER.parents[1]), str(FOLDER.parent / "blender")]
# This works only before the first window is drawn.
bpy.context.preferences.view.show_splash = False
# A tooltip comes after a time, and the next click would only close it.
bpy.context.preferences.view.show_tooltips = False

import addon  # noqa: E402
import window  # noqa: E402
from addon import native  # noqa: E402

window.draw_finely(False)


def in_its_window(test):
    """Runs a test in a window as wide as its file asks for by WIDTH, otherwise in a narrow one: see window.resize()."""
    width = getattr(sys.modules[test.__module__], "WIDTH", window.NARROW)
    if window.view()[0].width != width:
        yield from window.resize(width, window.view()[0].height)
    yield from test()


class Run:
    def __init__(self, names):
        modules = [importlib.import_module(path.stem) for path in sorted(FOLDER.glob("test_*.py"))]
        tests = [value for module in modules for name, value in vars(module).items() if name.startswith("test_")]
        if names[:1] == ["--share"]:
            # Tests of one file take about as long, so that these shares do, too.
            number, count = map(int, names[1].split("/"))
            self.waiting = tests[number - 1 :: count]
        else:
            self.waiting = [test for test in tests if not names or test.__name__ in names]
        self.failed = 0
        self.passed = 0
        self.started = time.time()
        self.used = time.process_time()
        self.current = window.close_other_areas()
        self.handling = iter(())
        self.between = True  # whether no test runs, but this preparation or what ends the work of a failed test

    def step(self):
        """Blender's timer calls this function. Returns the seconds until the next call."""
        try:
            if self.current is None:
                if not self.waiting:
                    self.end()
                print(f"{self.waiting[0].__name__} ...", flush=True)
                self.current = in_its_window(self.waiting.pop(0))
            pause = next(self.handling, None)
            if pause is None:
                pause = next(self.current)
            if pause is None:
                self.handling = window.handled()
                pause = next(self.handling)
            return pause
        except StopIteration:
            if self.between:
                self.between = False
            else:
                self.passed += 1
                used, self.used = time.process_time() - self.used, time.process_time()
                print(f"... passed after {time.time() - self.started:.0f} s, {used:.1f} s of the processor", flush=True)
        except Exception:
            traceback.print_exc()
            self.failed += not self.between
            self.between = not self.between
            if self.between:
                self.current = window.end_operators()
                return 0.0
        self.current = None
        return 0.0

    def end(self):
        counts = f"{self.failed} failed, {self.passed} passed" if self.failed else f"{self.passed} passed"
        print(f"{counts} in {time.time() - self.started:.1f} s", flush=True)
        sys.stderr.flush()
        os._exit(1 if self.failed or not self.passed else 0)


if native.module is None:
    print(f"1 failed: {native.reason}", flush=True)
    os._exit(1)
addon.register()
run = Run(sys.argv[sys.argv.index("--") + 1 :])
bpy.app.timers.register(run.step, first_interval=1.5, persistent=True)
