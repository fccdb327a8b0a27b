# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels as they lie on the screen: what the first screen shows, and that buttons stay where they are."""

from pathlib import Path

import bpy

import job_time
import scenes
from addon import job, panels
from addon.overlay import legend
from addon.proof import verdict
from panels_open import alone, unfolded
from test_panel import monkey
from window import (
    DOWN,
    PAGES,
    at_rest,
    copied_in_sidebar,
    find,
    finished,
    on_screen,
    open_tab,
    press,
    region,
    reset,
    screenshot,
    scroll,
    scroll_down,
    view,
    window_context,
    xdotool,
)


def torus():
    return bpy.data.objects["torus"]


def rows(*operators):
    """Returns the heights at which the buttons are."""
    seen, heights = (yield from copied_in_sidebar(across=0.25)), []
    for operator in operators or ("tolvol.decimate", "tolvol.check"):
        heights.append(next((y for (_, y), copied in seen if f"bpy.ops.{operator}" in copied), None))
        assert heights[-1] is not None, f"{operator} is not on the first screen"
    return heights


def test_the_first_screen_has_everything_and_buttons_stay_where_they_are():
    yield from reset(scenes.torus)
    yield from open_tab()
    yield from scroll()
    aside = on_screen(region("WINDOW"), 300, 300)
    first = yield from rows()
    xdotool("mousemove", *aside)
    yield
    screenshot("layout 1 first screen")
    assert torus().tolvol.snapshot is None and verdict.word(torus()) == verdict.NOT_CHECKED
    yield from press("tolvol.decimate")
    yield from finished(lambda: verdict.word(torus()) == verdict.PASS)
    assert (yield from rows()) == first
    torus().modifiers.new("wave", "WAVE")
    torus().data.vertices[0].co.z += 1
    torus().data.update()
    yield
    assert (yield from rows()) == first
    yield from press("tolvol.check")
    yield from finished(lambda: verdict.word(torus()) == verdict.FAIL)
    yield from at_rest()
    assert (yield from rows()) == first
    xdotool("mousemove", *aside)
    yield
    screenshot("layout 2 failed")
    for mode in ("EDIT", "SCULPT"):
        with window_context():
            bpy.ops.object.mode_set(mode=mode)
        yield
        assert (yield from rows()) == first
        xdotool("mousemove", *aside)
        yield
        screenshot(f"layout 3 {mode.lower()}")
    with window_context():
        bpy.ops.object.mode_set(mode="OBJECT")


def test_no_button_moves_while_a_job_runs():
    yield from reset(monkey)
    yield from open_tab()
    yield from scroll()
    yield from _no_button_moves("decimate", "tolvol.set_reference", "tolvol.decimate", "tolvol.check")
    # The panel Notes is left out, because it is below all buttons.
    yield from reset(monkey)
    with alone(panels.TOLVOL_PT_deviation, panels.TOLVOL_PT_smooth):
        yield from scroll_down()
        yield from _no_button_moves("smooth", "tolvol.check", "tolvol.save_report", "tolvol.smooth")


def _no_button_moves(operator, *buttons):
    before = yield from rows(*buttons)
    aside = on_screen(region("WINDOW"), 300, 300)
    screenshot(f"layout 9 before {operator}")
    with job_time.unending() as released:
        yield from press(f"tolvol.{operator}")
        yield from finished(lambda: job.under_way() and job.under_way().told().share, pause=0.01)
        xdotool("mousemove", *aside)
        yield
        screenshot(f"layout 9 during {operator}")
        assert (yield from rows(*buttons)) == before and job.under_way()
        if operator == "smooth":
            yield from press("tolvol.smooth")
            yield
            screenshot("layout 9 second job")
            assert job.under_way().told().count == "another operation has to wait"
        released.append(True)
    yield from finished(lambda: not job.under_way())
    assert (yield from rows(*buttons)) == before
    xdotool("mousemove", *aside)
    yield
    screenshot(f"layout 9 after {operator}")


def test_no_button_moves_when_sentences_and_labels_come_and_go():
    yield from reset(scenes.torus)
    yield from open_tab()
    yield from press("tolvol.set_reference")
    yield from finished(lambda: torus().tolvol.snapshot)
    first = "tolvol.set_reference", "tolvol.decimate", "tolvol.check"
    steps = []  # of the wheel, that take it to the others
    with unfolded(panels.TOLVOL_PT_smooth):

        def seen(name):
            """Returns the heights of the first buttons, and the distance of two of the others, which have to be scrolled to."""
            yield from scroll()
            heights = yield from rows(*first)
            if steps:
                yield from scroll(DOWN, sum(steps))
            while len(steps) < PAGES and (yield from find("tolvol.smooth", across=0.25)) is None:
                steps.append(3)
                yield from scroll(DOWN, steps[-1])
            above, below = yield from rows("tolvol.save_report", "tolvol.smooth")
            xdotool("mousemove", *on_screen(region("WINDOW"), 300, 300))
            yield
            screenshot(f"layout 10 {name}")
            return *heights, below - above

        before = yield from seen("plain")
        for position in ((1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)):
            bpy.ops.tolvol.add_label(position=position)
        assert (yield from seen("labels")) == before
        torus().tolvol.deviation_surface = "REFERENCE"
        assert (yield from seen("magnitude")) == before
        twin = torus().copy()
        assert (yield from seen("two users")) == before
        bpy.data.objects.remove(twin)
        torus().modifiers.new("multires", "MULTIRES")
        assert (yield from seen("multires")) == before


def light():
    theme = next(Path(folder) / "Blender_Light.xml" for folder in bpy.utils.preset_paths("interface_theme"))
    with window_context():
        bpy.ops.script.execute_preset(filepath=str(theme), menu_idname="USERPREF_MT_interface_theme_presets")


def dark():
    with window_context():
        bpy.ops.preferences.reset_default_theme()


def drag_sidebar(by):
    """Moves the left edge of the sidebar by so many pixels."""
    before = region("UI").width
    # The edge is drawn beside the region's own.
    x, y = on_screen(region("UI"), int(7 * bpy.context.preferences.system.ui_scale), 300)
    for step in (("mousemove", x - 40, y), ("mousemove", x, y), ("mousedown", 1), ("mousemove", x + by // 2, y)):
        xdotool(*step)
        yield
    xdotool("mousemove", x + by, y)
    yield
    xdotool("mouseup", 1)
    yield
    assert abs(before - region("UI").width - by) < 20, (before, region("UI").width, by)


def test_themes_widths_and_scales():
    yield from reset(scenes.torus)
    yield from open_tab()
    drawn = []
    whole, word = legend.Page.rectangle, legend._draw_word
    legend._draw_word = lambda *arguments: drawn.append("word") or word(*arguments)
    legend.Page.rectangle = lambda page, x, y, width, height, *rest, **options: (
        (drawn.append("legend") if height > 120 * page.scale else None)
        or (drawn.append("small word") if 14 < height / page.scale < 18 < width / page.scale else None)
        or whole(page, x, y, width, height, *rest, **options)
    )
    yield from press("tolvol.decimate")
    yield from finished(lambda: verdict.word(torus()) == verdict.PASS)
    aside = on_screen(region("WINDOW"), 300, 300)
    try:
        xdotool("mousemove", *aside)
        light()
        yield from finished(lambda: drawn)
        yield from at_rest()
        screenshot("layout 4 light")
        assert set(drawn) == {"legend"}
        yield from drag_sidebar(60)
        xdotool("mousemove", *aside)
        yield from at_rest()
        screenshot("layout 5 narrow")
        yield from drag_sidebar(-260)
        xdotool("mousemove", *aside)
        yield from at_rest()
        screenshot("layout 6 wide")
        yield from drag_sidebar(200)
        dark()
        with window_context():
            bpy.ops.screen.region_quadview()
        drawn.clear()
        yield from at_rest()
        screenshot("layout 7 quad view")
        assert set(drawn) == {"word"}
        with window_context():
            bpy.ops.screen.region_quadview()
        bpy.context.preferences.view.ui_scale = 2
        yield from at_rest()
        drawn.clear()
        view()[1].tag_redraw()
        yield from at_rest()
        screenshot("layout 8 twice as large")
        assert set(drawn) == {"word", "small word"}
        with window_context():
            bpy.ops.screen.region_quadview()
        drawn.clear()
        yield from at_rest()
        screenshot("layout 9 quad view, twice as large")
        assert "small word" in drawn
        with window_context():
            bpy.ops.screen.region_quadview()
    finally:
        bpy.context.preferences.view.ui_scale = 1
        legend.Page.rectangle, legend._draw_word = whole, word
        dark()
    yield from at_rest()
    view()[1].tag_redraw()
