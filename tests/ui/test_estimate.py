# SPDX-License-Identifier: GPL-3.0-or-later
"""The estimated number of triangles: before the first click, and while the tolerance is dragged by the mouse."""

import contextlib
from unittest import mock

from addon import estimate, native
from addon.estimate import known
from addon.proof import verdict
from test_panel import monkey, suzanne
from window import (
    at_rest,
    find_property,
    finished,
    move_onto,
    on_screen,
    open_tab,
    press,
    region,
    reset,
    screenshot,
    xdotool,
)

_TRIANGLES = 3936  # of the monkey: the decimations of its curve end soon


@contextlib.contextmanager
def drawn():
    """Gives a list to which each answer is added that the panel draws, (tolerance, answer).

    Drawing must not compute: an answer that begins an estimate itself is an error of the panel.
    """
    answers, shown = [], estimate.shown
    refused = {"side_effect": AssertionError("drawing must not compute")}

    def watched(context):
        with mock.patch.object(known, "read", **refused), mock.patch.object(native.module, "decimate", **refused):
            answer = shown(context)
        answers.append((suzanne().tolvol.tolerance_percent, answer))
        return answer

    estimate.shown = watched
    try:
        yield answers
    finally:
        estimate.shown = shown


def is_known(answers):
    return bool(answers) and isinstance(answers[-1][1], estimate.Estimate)


def test_the_number_follows_the_tolerance_while_it_is_dragged():
    yield from reset(lambda: monkey(1))
    with drawn() as answers:
        yield from open_tab()
        yield from finished(lambda: is_known(answers))
        screenshot("estimate 1 before the click")
        before = answers[-1][1]
        assert suzanne().tolvol.snapshot is None and before.before == _TRIANGLES and not before.known
        # The curve reaches as far as the tolerance is dragged below.
        yield from finished(lambda: "Suzanne" in known._known and known._known["Suzanne"].curve.count(6))
        x, y = yield from find_property("tolerance_percent", 0.6)
        yield from move_onto(x, y)
        xdotool("mousedown", 1)
        yield
        answers.clear()
        for step in range(1, 13):
            xdotool("mousemove", x + 2 * step, y)
            yield
        screenshot("estimate 2 dragged")
        held = [(percent, answer.after) for percent, answer in answers]
        xdotool("mouseup", 1)
        yield from at_rest(beside=())
        assert len({percent for percent, _ in held}) >= 4, answers
        # As the curve gets finer, the answer for one tolerance may change: the last one counts.
        counts = [count for _, count in sorted(dict(held).items())]
        assert counts == sorted(counts, reverse=True) and counts[-1] < 0.7 * before.after, held
        estimated = answers[-1][1].after
        xdotool("mousemove", *on_screen(region("WINDOW"), 300, 300))
        yield from press("tolvol.decimate")
        yield from finished(lambda: verdict.word(suzanne()) == verdict.PASS)
        yield from finished(lambda: is_known(answers) and answers[-1][1].known)
        xdotool("mousemove", *on_screen(region("WINDOW"), 300, 300))
        yield
        screenshot("estimate 3 decimated")
        count = len(suzanne().data.polygons)
        assert answers[-1][1] == estimate.Estimate(_TRIANGLES, count, True)
        assert abs(estimated - count) <= 0.15 * count
