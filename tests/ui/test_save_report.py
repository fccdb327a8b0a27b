# SPDX-License-Identifier: GPL-3.0-or-later
"""Save Report with the file browser."""

import contextlib
import os
import tempfile
from pathlib import Path

import bpy

import scenes
from addon.operators.report import TOLVOL_OT_save_report
from test_layout import torus
from window import at_rest, finished, key, open_tab, press, reset, screenshot, xdotool


@contextlib.contextmanager
def folder_to_save_in():
    """Gives an empty folder, which is the one that Save Report offers while the context lasts."""
    home = os.environ["HOME"]
    with tempfile.TemporaryDirectory() as folder:
        os.environ["HOME"] = folder
        try:
            yield Path(folder)
        finally:
            os.environ["HOME"] = home


def torus_with_reference():
    yield from reset(scenes.torus)
    yield from open_tab()
    yield from press("tolvol.set_reference")
    yield from finished(lambda: torus().tolvol.snapshot is not None)


def test_save_report_by_mouse():
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"  # The file browser opens in this window.
    yield from reset(scenes.torus)
    yield from open_tab()
    yield from press("tolvol.decimate")
    yield from finished(lambda: len(torus().data.polygons) < 500)
    yield from at_rest()
    with folder_to_save_in() as folder:
        yield from press("tolvol.save_report", across=0.7)
        yield from at_rest()
        screenshot("14 file browser")
        xdotool("mousemove", 640, 400)
        yield
        key("Return")
        saved = folder / "torus deviation.html"
        yield from finished(saved.is_file)
        yield from at_rest()
        screenshot("15 saved")
        assert "torus from its reference" in saved.read_text()


def test_escape_in_the_file_browser_of_save_report():
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    yield from torus_with_reference()
    ended, cancel = [], TOLVOL_OT_save_report.cancel
    TOLVOL_OT_save_report.cancel = lambda operator, context: ended.append(cancel(operator, context))
    try:
        yield from press("tolvol.save_report", across=0.7)
        yield from at_rest()
        xdotool("mousemove", 640, 400)
        yield
        key("Escape")
        yield from finished(lambda: ended)
    finally:
        TOLVOL_OT_save_report.cancel = cancel


def browser():
    """Returns the area of the file browser and its operator."""
    area = next(area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == "FILE_BROWSER")
    return area, area.spaces[0].active_operator


def choose_next_format():
    """Goes to the next entry of the menu by Ctrl and the wheel, which do so without opening it."""
    area, operator = browser()
    side = next(region for region in area.regions if region.type == "TOOL_PROPS")
    before, height = operator.format, bpy.context.window_manager.windows[0].height
    for y in range(4, side.height, 12):
        xdotool("mousemove", side.x + side.width * 3 // 4, height - side.y - side.height + y)
        yield
        xdotool("keydown", "ctrl", "click", 5, "keyup", "ctrl")
        yield
        if operator.format != before:
            return
    raise AssertionError("no choice of format")


def test_format_is_chosen_in_the_file_browser():
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    yield from torus_with_reference()
    with folder_to_save_in() as folder:
        yield from press("tolvol.save_report", across=0.7)
        yield from at_rest()
        area, _ = browser()
        assert area.spaces[0].params.filename == "torus deviation.html"
        yield from choose_next_format()
        yield from at_rest()
        screenshot("16 format chosen")
        assert area.spaces[0].params.filename == "torus deviation.csv"
        xdotool("mousemove", 640, 400)
        yield
        key("Return")
        saved = folder / "torus deviation.csv"
        yield from finished(saved.is_file)
        assert saved.read_text().startswith("direction,quantity")


def test_a_page_of_several_objects_is_not_named_after_one():
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    yield from torus_with_reference()
    torus = bpy.context.active_object
    bpy.ops.mesh.primitive_cube_add()
    torus.select_set(True)
    bpy.context.view_layer.objects.active = torus
    with folder_to_save_in():
        yield from press("tolvol.save_report", across=0.7)
        yield from at_rest()
        area, _ = browser()
        assert area.spaces[0].params.filename == "objects deviation.html"
        xdotool("mousemove", 640, 400)
        yield
        key("Escape")
        yield from at_rest()
