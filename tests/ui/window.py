# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions for the tests that use the mouse and the keyboard, take screenshots, and find buttons."""

import os
import subprocess
import time
from pathlib import Path

import bpy
import numpy as np

from addon import job
from addon.background import queue, thread
from addon.job import progress_text

# run.sh tells the folder.
PICTURES = Path(__file__).resolve().parents[2] / os.environ.get("TOLVOL_UI_OUT", "build/ui")


_COMMANDS = {
    "mousemove",
    "mousemove_relative",
    "mousedown",
    "mouseup",
    "click",
    "key",
    "keydown",
    "keyup",
    "type",
    "windowsize",
}
_sending = []  # the xdotool that sends all events


def xdotool(*arguments):
    """Gives commands to xdotool, and returns once the server has their events.

    One xdotool takes all commands from its input: to start another one takes many times as long as to send an event. No
    argument may hold a quotation mark.
    """
    if not _sending or _sending[0].poll() is not None:
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        _sending[:] = [subprocess.Popen(["xdotool", "-"], text=True, **pipes)]
    words = [f'"{word}"' if " " in word else word for word in map(str, arguments)]
    # xdotool cuts long lines, so that each command has a line of its own.
    lines = "".join(f"\n{word}" if word in _COMMANDS else f" {word}" for word in words)
    # The answer to a question comes after the server has taken all that was sent before.
    _sending[0].stdin.write(f"{lines.lstrip()}\ngetmouselocation\n")
    _sending[0].stdin.flush()
    answer = _sending[0].stdout.readline()
    if not answer.startswith("x:"):  # xdotool complains of a command that it refuses, and goes on.
        _sending.pop().kill()
        raise AssertionError(f"xdotool refuses {arguments}: {answer}")


def click(x, y):
    yield from move_onto(x, y)
    xdotool("click", 1)


def move_onto(x, y):
    """Moves the mouse onto a button. At one move of the mouse Blender leaves a button, and at the next one it enters another."""
    for across in (0, 1):
        xdotool("mousemove", x + across, y)
        yield


def key(name):
    xdotool("key", name)


_status_line = progress_text.status_line


def status_texts():
    """Returns a list that gets each text that a job shows in the status bar from now on."""
    said = []
    progress_text.status_line = lambda *about: said.append(_status_line(*about)) or said[-1]
    return said


class TOLVOL_TEST_OT_mark(bpy.types.Operator):
    """Notes what is in the clipboard when its key is handled, and empties the clipboard"""

    bl_idname, bl_label = "tolvol_test.mark", "Mark"
    noted = []

    def execute(self, context):
        self.noted.append(context.window_manager.clipboard)
        context.window_manager.clipboard = ""
        return {"FINISHED"}


_MARK = "Pause"  # a key that Blender does not use
_STUCK = 120  # seconds after which Blender counts as stuck


def sent(*events):
    """Sends events by xdotool and waits until Blender has handled them: it then handles the key that follows them.

    Returns what was in the clipboard each time that this key was handled. No operator may be at work that takes all keys.
    """
    if not hasattr(bpy.types, TOLVOL_TEST_OT_mark.__name__):
        bpy.utils.register_class(TOLVOL_TEST_OT_mark)
        configurations = bpy.context.window_manager.keyconfigs
        keymap = configurations.addon.keymaps.new("Window")
        keymap.keymap_items.new(TOLVOL_TEST_OT_mark.bl_idname, _MARK.upper(), "PRESS")
        # Where the mouse is over no button, Ctrl C would write the selected objects to a file.
        configurations.user.keymaps["3D View"].keymap_items["view3d.copybuffer"].active = False
    events += "key", _MARK
    noted = TOLVOL_TEST_OT_mark.noted
    noted.clear()
    xdotool(*events)
    yield from finished(lambda: len(noted) == events.count(_MARK), pause=0.01)
    return noted[:]


_ROUNDS = 4  # The first one is under way when the events are sent, and what the second one draws may lead to more.


def handled():
    """Waits until Blender has handled the events that were sent, and has drawn what they have changed.

    Blender's loop takes all events, handles them, calls each timer that is due and draws what has to be drawn anew.
    """
    for _ in range(_ROUNDS):
        yield 0.0


def at_rest(beside=("estimate",)):
    """Waits until the add-on has no work, in the background or in a job, and Blender has drawn what has come of it.

    beside: the kinds of tasks that may go on. An estimate takes minutes for some meshes.
    """
    yield  # What is drawn may ask for work.
    while _at_work(beside):
        yield from finished(lambda: not _at_work(beside))
        yield


def _at_work(beside):
    about, _, running, _ = queue._running or (("",), None, None, None)
    let = running if about[0] in beside else None
    waits = any(about[0] not in beside for about in queue._waiting)
    return bool(waits or running is not let or job.under_way() or any(one is not let for one in thread.at_work()))


def finished(change, within=_STUCK, pause=0.05):
    """Waits until change() is true. within, pause: seconds, until it counts as failed and between two looks."""
    end = time.monotonic() + within
    while not change():
        assert time.monotonic() < end, "nothing happened"
        yield pause


def still(read, **options):
    """Waits until read() returns the same array twice, with an at_rest() of these options between. Returns that array."""
    last, now = None, read()
    while last is None or not np.array_equal(last, now):
        yield from at_rest(**options)
        last, now = now, read()
    return now


def _grab():
    """Returns the beginning of a command that takes a picture of the window, which is in a corner of the screen."""
    window = bpy.context.window_manager.windows[0]
    return ["import", "-window", "root", "-crop", f"{window.width}x{window.height}+0+0", "+repage"]


def screenshot(name):
    # This quality is the least compression, which takes a quarter of the time.
    subprocess.run([*_grab(), "-quality", "10", str(PICTURES / f"{name}.png")], check=True)


def picture(name):
    """Saves the 3D view and the status bar as a picture for the documentation, with few colours to keep the file small."""
    area = view()[1]
    height = area.y + area.height
    place = f"{area.width}x{height}+{area.x}+{view()[0].height - height}"
    reduce = ["-crop", place, "+repage", "-dither", "FloydSteinberg", "-colors", "256"]
    subprocess.run(["import", "-window", "root", *reduce, f"PNG8:{PICTURES / name}.png"], check=True)


def pixels():
    """Returns a screenshot, (height, width, 3) integers."""
    picture = subprocess.run([*_grab(), "-depth", "8", "ppm:-"], check=True, capture_output=True).stdout
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
    """Converts a place in a region, from its upper left corner, to pixels of the screen."""
    window, _ = view()
    return area_region.x + x, window.height - (area_region.y + area_region.height) + y


def centre():
    middle = region("WINDOW")
    return on_screen(middle, middle.width // 3, middle.height // 2)


def open_tab():
    """Shows the sidebar with the tab Tolerance."""
    view()[1].spaces[0].show_region_ui = True
    yield from finished(lambda: region("UI").width > 100)
    sidebar = region("UI")
    # The tabs are at the right edge, and the tab Tolerance is the last one. It may be open already.
    for y in range(150, 260, 20):
        if (yield from find("tolvol.")) is not None:
            return
        yield from click(*on_screen(sidebar, sidebar.width - 12, y))
        yield
    raise AssertionError("no tab Tolerance")


def find(operator, across=0.33):
    """Moves the mouse down the sidebar until it is over the button of an operator. Returns the place or None.

    across: how far from the left of the sidebar. Blender's Ctrl C over a button copies the Python command that it runs.
    """
    return (yield from _find(f"bpy.ops.{operator}", "ctrl+c", across))


def find_property(name, across):
    """Does the same as find() for a property of Object.tolvol."""
    return (yield from _find(f".tolvol.{name}", "ctrl+shift+alt+c", across))


def find_setting(path):
    """Does the same as find() for a property, by its whole data path: Blender's Shift Ctrl C copies that."""
    return (yield from _find(path, "ctrl+shift+c", 0.33))


def move_onto_hold():
    """Moves the mouse onto the button that shows the original while it is held. If necessary, it scrolls the sidebar."""
    yield from _scrolled_to("tolvol_show_original", "ctrl+shift+alt+c", 0.33)


_last_seen, _last_found, _last_pages = {}, {}, {}


def copied_in_sidebar(keys="ctrl+c", across=0.33):
    """Moves the mouse down the sidebar and presses keys that copy something from the button below the mouse.

    Returns pairs (place, what was copied). Buttons that moved since the last time may move still: it then does so again.
    """
    end = time.monotonic() + _STUCK
    while time.monotonic() < end:
        copied = yield from _down_the_sidebar(keys, across)
        if _last_seen.get((keys, across)) == copied:
            return copied
        _last_seen[keys, across] = copied
        yield
    raise AssertionError("the buttons do not come to rest")


def _places(across, step=8):
    sidebar = region("UI")
    return [on_screen(sidebar, int(sidebar.width * across), y) for y in range(30, sidebar.height - 5, step)]


def _down_the_sidebar(keys, across):
    """The events come so quickly that Blender draws few times meanwhile."""
    places, events = _places(across), []
    for x, y in places:
        if events:
            events += "key", "--delay", 0, _MARK
        events += *_onto(x, y), "key", "--delay", 0, keys
    bpy.context.window_manager.clipboard = ""
    copied = yield from sent(*events)
    return list(zip(places, copied))


def _onto(x, y):
    """Returns events that move the mouse onto a button.

    At one move of the mouse Blender leaves a button, and at the next one it enters another. It takes moves that follow each
    other for one: a key keeps them apart.
    """
    return "mousemove", x, y, "key", "--delay", 0, "Insert", "mousemove", x + 1, y


def _find(wanted, keys, across):
    end = time.monotonic() + _STUCK
    # Most buttons are where they were the last time. To go down the whole sidebar takes many times as long as a look.
    place = _last_found.get((wanted, keys, across))
    if place not in _places(across):
        place = None
    while time.monotonic() < end:
        # The button may have moved since it was found.
        if place and (yield from _is_at(place, wanted, keys)):
            _last_found[wanted, keys, across] = place
            return place
        found = yield from copied_in_sidebar(keys, across)
        place = next((place for place, copied in found if wanted in copied), None)
        if place is None:
            return None
    raise AssertionError(f"{wanted} does not come to rest")


def _is_at(place, wanted, keys):
    bpy.context.window_manager.clipboard = ""
    return wanted in (yield from sent(*_onto(*place), "key", keys))[0]


def press(operator, across=0.33):
    """Clicks the button of an operator in the sidebar. If necessary, it scrolls the sidebar, and back up after that."""
    scrolled = yield from _scrolled_to(f"bpy.ops.{operator}", "ctrl+c", across)
    xdotool("click", 1)
    yield
    if scrolled and _view_areas():  # A file browser may fill the window now.
        yield from scroll(UP)


def click_property(name, across):
    """Clicks the field or the button of a property of Object.tolvol in the sidebar. If necessary, it scrolls the sidebar."""
    yield from _scrolled_to(f".tolvol.{name}", "ctrl+shift+alt+c", across)
    xdotool("click", 1)
    yield


def _scrolled_to(wanted, keys, across):
    """Moves the mouse onto what _find() finds, and scrolls the sidebar if necessary. Returns whether it has scrolled."""
    pages = _last_pages.get((wanted, keys, across), 0)
    if pages:
        yield from scroll(DOWN, pages * _PAGE)
    place = yield from _find(wanted, keys, across)
    scrolled = bool(pages) or place is None
    if place is None:
        yield from scroll(UP)
        pages, place = 0, (yield from _find(wanted, keys, across))
    # The sidebar may be several times as high as the window.
    while place is None and pages < PAGES:
        yield from scroll(DOWN, _PAGE)
        pages, place = pages + 1, (yield from _find(wanted, keys, across))
    assert place is not None, f"no button for {wanted}"
    _last_pages[wanted, keys, across] = pages
    return scrolled


UP, DOWN = 4, 5  # X counts the two directions of the wheel as these buttons of the mouse.
_PAGE, PAGES = 6, 6  # Steps of the wheel after which a part of the sidebar is still seen, and how often that is done.


def scroll(button=UP, steps=30):
    """Turns the wheel over the sidebar. After 30 steps it no longer scrolls."""
    sidebar = region("UI")
    middle = on_screen(sidebar, sidebar.width // 2, sidebar.height // 2)
    xdotool("mousemove", *middle, "click", "--repeat", steps, "--delay", 1, button)
    yield


def scroll_down():
    yield from scroll(DOWN)


def unfold_adjust():
    """Unfolds the panel of the last operation, which at first is only a header in the corner of the view."""
    yield from finished(lambda: region("HUD").height > 10)
    hud = region("HUD")
    yield from click(*on_screen(hud, 60, hud.height - 12))
    yield from finished(lambda: region("HUD").height > 200)


def fold_adjust():
    """Folds that panel again. Blender would unfold it in later tests, too, and it would take the keys that they press."""
    yield from click(*on_screen(region("HUD"), 60, 12))
    yield from finished(lambda: region("HUD").height < 100)
    xdotool("mousemove", *centre())
    yield


def end_operators():
    """Ends what a failed test has left at work, and leaves its mode.

    The next test removes all objects: Blender crashes if an operator goes on that moves one of them.
    """
    for _ in range(2):
        xdotool("mouseup", 1, "mousemove", *centre(), "key", "Escape")
        yield from finished(lambda: not job.under_way())
        yield
    if bpy.context.mode != "OBJECT":
        with window_context():
            bpy.ops.object.mode_set(mode="OBJECT")
        yield


_first_view = {}


def close_other_areas():
    """Closes all areas beside the 3D view, which then fills the window: drawing in software takes as long as there are pixels."""
    window, _ = view()
    for area in list(window.screen.areas):
        if area.type != "VIEW_3D":
            with bpy.context.temp_override(window=window, area=area, region=area.regions[0]):
                bpy.ops.screen.area_close()
    yield
    # Until Blender has drawn the window again its context is incomplete.
    yield from finished(lambda: hasattr(bpy.context, "object"))


NARROW, WIDE = 720, 1060  # widths of the window in pixels: a narrow one has room for the sidebar and a view beside it


def resize(width, height):
    """Gives the window another size. Drawing in software takes as long as there are pixels."""
    window = view()[0]
    shell = subprocess.run(["xdotool", "search", "--class", "blender"], check=True, capture_output=True, text=True)
    xdotool("windowsize", shell.stdout.split()[-1], width, height)
    yield from finished(lambda: (window.width, view()[1].width, window.height) == (width, width, height))
    yield


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
    yield
