# SPDX-License-Identifier: GPL-3.0-or-later
"""Scaling a decimated mesh by keys."""

from addon.proof import verdict
from test_panel import monkey, suzanne
from window import at_rest, centre, finished, key, open_tab, press, reset, screenshot, xdotool


def test_a_scaled_mesh_stays_proved_until_one_axis_is_scaled():
    yield from reset(monkey)
    yield from open_tab()
    yield from press("tolvol.decimate")
    yield from finished(lambda: verdict.word(suzanne()) == verdict.PASS)
    yield from at_rest()
    for keys, height, word in (("s2", 2, verdict.PASS), ("sz3", 6, verdict.NOT_CHECKED)):
        xdotool("mousemove", *centre())
        yield
        for each in (*keys, "Return"):
            key(each)
            yield
        screenshot(f"scaled {keys}")
        assert suzanne().scale.z == height and verdict.word(suzanne()) == word
