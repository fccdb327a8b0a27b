# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar while it is scrolled to its end: its buttons stay although the sentences below them come and go."""

import bpy

import scenes
from addon import job, panels
from addon.panels import notes
from addon.proof import verdict
from panels_open import unfolded
from test_layout import rows, torus
from window import finished, on_screen, open_tab, press, region, reset, screenshot, scroll_down, window_context, xdotool


def test_no_button_moves_at_the_end_of_the_sidebar_when_sentences_vanish():
    yield from reset(scenes.torus)
    yield from open_tab()
    yield from press("tolvol.decimate")
    yield from finished(lambda: not job.under_way() and verdict.word(torus()) == verdict.PASS)
    with unfolded(panels.TOLVOL_PT_smooth):
        yield from scroll_down()
        before = yield from rows("tolvol.smooth")
        said, _ = notes.notes(bpy.context, torus())
        for state in ("vanished", "failed"):
            if state == "vanished":
                torus().data.vertices[0].co.z += 1.3  # No other test has measured this shape.
                torus().data.update()
                yield from finished(lambda: len(notes.notes(bpy.context, torus())[0]) < len(said) - 2)
            else:
                with window_context():
                    bpy.ops.tolvol.check("INVOKE_DEFAULT", True)
                yield from finished(lambda: not job.under_way() and verdict.word(torus()) == verdict.FAIL)
            xdotool("mousemove", *on_screen(region("WINDOW"), 300, 300))
            yield
            screenshot(f"scrolled {state}")
            assert (yield from rows("tolvol.smooth")) == before
