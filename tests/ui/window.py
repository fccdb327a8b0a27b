# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions for the tests that use the mouse and the keyboard, take screenshots, and find buttons."""

import subprocess
import time
from pathlib import Path

import bpy
import numpy as np

from addon.job import progress_text

PICTURES = Path(__file__).resolve().parents[2] / "build" / "ui"


def xdotool(*arguments):
    subprocess.run(["xdotool", *map(str, arguments)], check=True)


def click(x, y):
    xdotool("mousemove", x, y, "sleep", "0.1", "click", 1)


def key(name):
    xdotool("key", name)


_status_line = progress_text.status_line


def status_texts():
    """Returns a list that gets each text that a job shows in the status bar from now on."""
    said = []
    progress_text.status_line = lambda *about: said.append(_status_line(*about)) or said[-1]
    return said


class TOLVOL_TEST_OT_mark(bpy.types.Operator):
    """Counts how often its key was handled"""

    bl_idname, bl_label = "tolvol_test.mark", "Mark"
    count = 0

    def execute(self, context):
        TOLVOL_TEST_OT_mark.count += 1
        return {"FINISHED"}


_MARK = "Pause"  # a key that Blender does not use
_STUCK = 120  # seconds after which Blender counts as stuck


def sent(*events):
    """Sends events by xdotool and waits until Blender has handled them: it then handles the key that follows them.

    No operator may be at work that takes all keys.
    """
    if not hasattr(bpy.types, TOLVOL_TEST_OT_mark.__name__):
        bpy.utils.register_class(TOLVOL_TEST_OT_mark)
        keymap = bpy.context.window_manager.keyconfigs.addon.keymaps.new("Window")
        keymap.keymap_items.new(TOLVOL_TEST_OT_mark.bl_idname, _MARK.upper(), "PRESS")
    count = TOLVOL_TEST_OT_mark.count
    xdotool(*events, "key", _MARK)
    yield from finished(lambda: TOLVOL_TEST_OT_mark.count > count, pause=0.01)


def finished(change, seconds=_STUCK, pause=0.2):
    """Waits until change() is true."""
    end = time.monotonic() + seconds
    while not change():
        assert time.monotonic() < end, "nothing happened"
        yield pause


def still(read):
    """Waits until read() returns the same array twice, a second apart. Returns that array."""
    last, now = None, read()
    while last is None or not np.array_equal(last, now):
        yield 1.0
        last, now = now, read()
    return now


def screenshot(name):
    # This quality is the least compression, which takes a quarter of the time.
    subprocess.run(["import", "-window", "root", "-quality", "10", str(PICTURES / f"{name}.png")], check=True)


def picture(name):
    """Saves the 3D view and the status bar as a picture for the documentation, with few colours to keep the file small."""
    area = view()[1]
    height = area.y + area.height
    place = f"{area.width}x{height}+{area.x}+{view()[0].height - height}"
    reduce = ["-crop", place, "+repage", "-dither", "FloydSteinberg", "-colors", "256"]
    subprocess.run(["import", "-window", "root", *reduce, f"PNG8:{PICTURES / name}.png"], check=True)


def pixels():
    """Returns a screenshot, (height, width, 3) integers."""
    picture = subprocess.run(
        ["import", "-window", "root", "-depth", "8", "ppm:-"], check=True, capture_output=True
    ).stdout
    _, width, height, _ = picture.split(maxsplit=4)[:4]
    count = 3 * int(width) * int(height)
    return np.frombuffer(picture[-count:], np.uint8).reshape(int(height), int(width), 3).astype(int)


def draw_finely(fine):
    """Switches what takes most of the time where Blender draws in software: anti-aliasing, outlines, the floor."""
    system = bpy.context.preferences.system
    system.viewport_aa, system.use_overlay_smooth_wire = "8" if fine else "OFF", fine
    for screen in bpy.data.screens:
        for area in screen.areas:
            if area.type == "VIEW_3D":
                overlay = area.spaces[0].overlay
                overlay.show_outline_selected = overlay.show_floor = overlay.show_axis_x = overlay.show_axis_y = fine


def _view_areas():
    window = bpy.context.window_manager.windows[0]
    return [area for area in window.screen.areas if area.type == "VIEW_3D"]


def view():
    """Returns the window and the area of its 3D view."""
    return bpy.context.window_manager.windows[0], _view_areas()[0]


def region(kind):
    return next(region for region in view()[1].regions if region.type == kind)


def window_context():
    """A context for operators that act on the 3D view."""
    return bpy.context.temp_override(window=view()[0], area=view()[1], region=region("WINDOW"))


def on_screen(area_region, x, y):
    """Converts a place in a region, from its upper left corner, to pixels of the screen. The window fills the screen."""
    window, _ = view()
    return area_region.x + x, window.height - (area_region.y + area_region.height) + y


def centre():
    middle = region("WINDOW")
    return on_screen(middle, middle.width // 3, middle.height // 2)


def open_tab():
    """Shows the sidebar with the tab Tolerance."""
    view()[1].spaces[0].show_region_ui = True
    yield 0.5
    sidebar = region("UI")
    # The tabs are at the right edge, and the tab Tolerance is the last one.
    for y in range(150, 260, 20):
        click(*on_screen(sidebar, sidebar.width - 12, y))
        yield 0.3
        if (yield from find("tolvol.")) is not None:
            return
    raise AssertionError("no tab Tolerance")


def find(operator, across=0.33):
    """Moves the mouse down the sidebar until it is over the button of an operator. Returns the place or None.

    across: how far from the left of the sidebar. Blender's Ctrl C over a button copies the Python command that it runs.
    """
    return (yield from _find(f"bpy.ops.{operator}", "ctrl+c", across))


def find_property(name, across):
    """Does the same as find() for a property of Object.tolvol."""
    return (yield from _find(f".tolvol.{name}", "ctrl+shift+alt+c", across))


def find_hold():
    """Does the same as find() for the button that shows the original while it is held. It scrolls the sidebar down."""
    yield from scroll_down()
    return (yield from _find("tolvol_show_original", "ctrl+shift+alt+c", 0.33))


_found_at = {}


def _find(copied, keys, across):
    sidebar = region("UI")
    # In most cases the button is where it was the last time.
    rows = range(30, sidebar.height - 5, 12)
    last = _found_at.get((copied, across))
    for y in rows if last is None else (last, *rows):
        place = on_screen(sidebar, int(sidebar.width * across), y)
        bpy.context.window_manager.clipboard = ""
        yield from sent("mousemove", *place)
        yield from sent("key", keys)
        if copied in bpy.context.window_manager.clipboard:
            _found_at[copied, across] = y
            return place
    return None


def press(operator, across=0.33):
    """Clicks the button of an operator in the sidebar. If necessary, it scrolls the sidebar, and back up after that."""
    place = yield from find(operator, across)
    scrolled = place is None
    if scrolled:
        yield from scroll(_UP)
        place = yield from find(operator, across)
    # The sidebar may be several times as high as the window.
    for _ in range(_PAGES):
        if place is None:
            yield from scroll(_DOWN, _PAGE)
            place = yield from find(operator, across)
    assert place is not None, f"no button for {operator}"
    yield 0.6  # After so many seconds no tooltip is in the way.
    click(*place)
    yield 0.3
    if scrolled and _view_areas():  # A file browser may fill the window now.
        yield from scroll(_UP)


_UP, _DOWN = 4, 5  # X counts the two directions of the wheel as these buttons of the mouse.
_PAGE, _PAGES = 6, 6  # Steps of the wheel after which a part of the sidebar is still seen, and how often that is done.


def scroll(button=_UP, steps=30):
    """Turns the wheel over the sidebar. After 30 steps it no longer scrolls."""
    sidebar = region("UI")
    middle = on_screen(sidebar, sidebar.width // 2, sidebar.height // 2)
    xdotool("mousemove", *middle, "sleep", "0.1", "click", "--repeat", steps, "--delay", 20, button)
    yield 0.5


def scroll_down():
    yield from scroll(_DOWN)


def end_operators():
    """Ends what a failed test has left at work, and leaves its mode.

    The next test removes all objects: Blender crashes if an operator goes on that moves one of them.
    """
    for _ in range(2):
        xdotool("mouseup", 1, "mousemove", *centre(), "key", "Escape")
        yield 1.0
    if bpy.context.mode != "OBJECT":
        with window_context():
            bpy.ops.object.mode_set(mode="OBJECT")
        yield


_first_view = {}


def maximize():
    """Makes the 3D view fill the whole window, or gives it its former place."""
    with window_context():
        bpy.ops.screen.screen_full_area()
    yield 0.5


def sculpt_by_drawing():
    """Chooses the brush Draw in Sculpt Mode, which is also the first choice of Blender."""
    with window_context():
        bpy.ops.wm.tool_set_by_id(name="builtin_brush.Draw")


def reset(*make):
    """Makes a scene with only the object that make() makes. The object is active, and the view is the initial one."""
    camera = view()[1].spaces[0].region_3d
    for name in ("view_perspective", "view_distance", "view_location", "view_rotation"):
        value = getattr(camera, name)
        setattr(camera, name, _first_view.setdefault(name, value if isinstance(value, (str, float)) else value.copy()))
    for ob in list(bpy.data.objects):
        bpy.data.objects.remove(ob)
    for function in make:
        function()
    bpy.ops.ed.undo_push(message="start")
    xdotool("mousemove", *centre())
    yield 0.5
