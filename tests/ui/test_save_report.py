# SPDX-License-Identifier: GPL-3.0-or-later
"""Save Report with the file browser."""

import os
import tempfile
from pathlib import Path

import bpy

from addon.operators.report import TOLVOL_OT_save_report
from test_panel import monkey, suzanne
from window import finished, key, open_tab, press, reset, screenshot, xdotool


def test_save_report_by_mouse():
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"  # The file browser opens in this window.
    yield from reset(monkey)
    yield from open_tab()
    yield from press("tolvol.decimate")
    yield from finished(lambda: len(suzanne().data.polygons) < 3000)
    yield 1.0
    home = os.environ["HOME"]
    with tempfile.TemporaryDirectory() as folder:
        os.environ["HOME"] = folder
        try:
            yield from press("tolvol.save_report", across=0.7)
            yield 1.0
            screenshot("14 file browser")
            xdotool("mousemove", 640, 400)
            yield
            key("Return")
            saved = Path(folder) / "Suzanne deviation.html"
            yield from finished(saved.is_file)
            yield 1.0
            screenshot("15 saved")
            assert "Suzanne from its reference" in saved.read_text()
        finally:
            os.environ["HOME"] = home


def test_escape_in_the_file_browser_of_save_report():
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    yield from reset(monkey)
    yield from open_tab()
    yield from press("tolvol.set_reference")
    yield from finished(lambda: suzanne().tolvol.snapshot is not None)
    ended, cancel = [], TOLVOL_OT_save_report.cancel
    TOLVOL_OT_save_report.cancel = lambda operator, context: ended.append(cancel(operator, context))
    try:
        yield from press("tolvol.save_report", across=0.7)
        yield 1.0
        xdotool("mousemove", 640, 400)
        yield
        key("Escape")
        yield from finished(lambda: ended)
    finally:
        TOLVOL_OT_save_report.cancel = cancel
