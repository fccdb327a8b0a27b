# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe reads what is under the mouse, and a click leaves a label."""

import tempfile
from pathlib import Path

import bpy
import numpy as np

import scenes
from addon import overlay, status_bar
from addon.operators.probe import TOLVOL_OT_probe
from addon.overlay import legend, markers
from addon.proof import labels, probing
from addon.proof import places as worst_places
from test_layout import dark, drag_sidebar, light
from window import (
    WIDE,
    at_rest,
    click,
    finished,
    key,
    on_screen,
    open_tab,
    press,
    region,
    reset,
    screenshot,
    scroll_down,
    view,
    window_context,
    xdotool,
)

WIDTH = WIDE  # The view has room for labels beside the mesh.


def ball():
    """A ball that was blown up on its left side after its reference was set."""
    scenes.changed_ball(lambda co: co * np.where(co[:, :1] < 0, np.float32(1.05), np.float32(1)))
    view()[1].spaces[0].region_3d.view_distance = 6


def the_ball():
    return bpy.data.objects["ball"]


def places():
    """Returns two places on the screen: on the side of the ball that was blown up, and on the one that was not."""
    middle = region("WINDOW")
    return [on_screen(middle, middle.width // 2 + across, middle.height // 2) for across in (-60, 60)]


def reads(far):
    """Whether the probe shows a large or a small distance."""
    hover = probing.hover()
    return bool(hover and hover.lines) and ("outside" in hover.lines[0]) == far


def test_the_probe_reads_under_the_mouse_and_leaves_labels():
    yield from reset(ball)
    yield from open_tab()
    view()[1].spaces[0].region_3d.view_rotation = (0.7071, 0.7071, 0, 0)  # from the front
    yield
    left, right = places()
    yield from press("tolvol.probe", across=0.5)
    yield from finished(TOLVOL_OT_probe.running)
    xdotool("mousemove", *left)
    yield from finished(lambda: reads(True))
    yield
    screenshot("probe 1 beyond")
    lines = [line.replace("\u00a0", " ") for line in probing.hover().lines]
    assert lines == ["4.99 cm outside, 721 % of the tolerance", "Tolerance 6.93 mm: beyond"]
    assert (
        TOLVOL_OT_probe._running._said
        == f"ball: {', '.join(probing.hover().lines)}    Click: Leave a Label    Esc: End"
    )
    assert len(the_ball().tolvol.labels) == 0
    status_bar.clear()  # as a job does that ends
    yield from finished(status_bar.showing)
    # The view can be turned meanwhile: what is under the mouse is then read without a move.
    xdotool("click", 4)
    yield
    xdotool("mousemove", *right)
    yield from finished(lambda: reads(False))
    screenshot("probe 2 within")
    yield from click(*left)
    yield from finished(lambda: len(the_ball().tolvol.labels) == 1)
    yield from click(*right)
    yield from finished(lambda: len(the_ball().tolvol.labels) == 2)
    xdotool("mousemove", *on_screen(region("WINDOW"), 200, 600))  # beside the ball
    yield from finished(lambda: not probing.hover().lines)
    yield
    screenshot("probe 3 two labels")
    yield from click(*on_screen(region("WINDOW"), 200, 600))
    yield
    first, second = the_ball().tolvol.labels
    assert first.side == "outside" and 0.045 < first.distance < 0.0501 and second.distance < 1e-6
    assert np.linalg.norm(first.place) > 1.04 and labels.current(the_ball(), first)
    # Ctrl Z takes the last label back, and the probe goes on.
    xdotool("mousemove", *left, "key", "ctrl+z")
    yield from finished(lambda: len(the_ball().tolvol.labels) == 1)
    yield from finished(lambda: reads(True))
    xdotool("key", "ctrl+shift+z")
    yield from finished(lambda: len(the_ball().tolvol.labels) == 2)
    # The sidebar works meanwhile.
    the_ball().tolvol.tolerance_percent = 5
    xdotool("mousemove", left[0] + 2, left[1])
    yield from finished(lambda: reads(True) and "beyond" not in probing.hover().lines[1])
    # Where the reference is coloured, it is what the mouse points at.
    the_ball().tolvol.deviation_surface = "REFERENCE"
    xdotool("mousemove", *left)
    yield from finished(lambda: probing.hover().lines and "on the reference" in probing.hover().lines[0])
    assert TOLVOL_OT_probe._running._said.startswith("Reference of ball: ")
    screenshot("probe 4 on the reference")
    yield from click(*left)
    yield from finished(lambda: len(the_ball().tolvol.labels) == 3)
    assert the_ball().tolvol.labels[2].on_reference
    key("Escape")
    yield from finished(lambda: not TOLVOL_OT_probe.running())
    assert probing.hover() is None


def test_the_table_of_labels_in_the_sidebar():
    yield from reset(ball)
    yield from open_tab()
    for position in ((-1, 0, 0), (1, 0, 0), (0, 0, 1)):
        bpy.ops.tolvol.add_label(position=position)
    bpy.ops.ed.undo_push(message="labels")
    yield from press("tolvol.remove_label", across=0.775)
    yield from finished(lambda: len(the_ball().tolvol.labels) == 2)
    the_ball().data.vertices[0].co.z += 0.01
    the_ball().data.update()
    bpy.ops.ed.undo_push(message="edit")
    yield from at_rest()
    screenshot("probe 4 out of date")
    yield from drag_sidebar(60)
    yield from scroll_down()
    xdotool("mousemove", *on_screen(region("WINDOW"), 300, 300))
    yield
    screenshot("probe 4 out of date and narrow")
    yield from drag_sidebar(-60)
    yield from press("tolvol.renew_labels", across=0.775)
    yield from finished(lambda: all(labels.current(the_ball(), label) for label in the_ball().tolvol.labels))
    yield
    key("ctrl+z")
    yield from finished(lambda: not any(labels.current(the_ball(), label) for label in the_ball().tolvol.labels))


def test_labels_lie_beside_each_other_the_worst_point_and_the_legend():
    yield from reset(ball)
    with window_context():
        bpy.ops.tolvol.worst_point()
    (worst, *_), _, _ = worst_places.shown(the_ball())
    for i in range(12):
        bpy.ops.tolvol.add_label(position=np.array(worst.position) + (0, 0, 0.02 * i))
    boxes, draw = {}, markers.Box.draw
    markers.Box.draw = lambda box, place, faint=False: boxes.update({place: box._lines}) or draw(box, place, faint)

    def of_worst():
        return next((box for box, lines in boxes.items() if lines[0].startswith("1 of ")), None)

    try:
        place = region("WINDOW")
        yield from finished(lambda: legend.box(place) and of_worst())
        yield from at_rest()
        boxes.clear()
        view()[1].tag_redraw()
        yield from finished(lambda: len(boxes) > 4)
        yield
        screenshot("probe 9 many labels")
        assert "of the tolerance" in boxes[of_worst()][0]
        drawn = [legend.box(place), *boxes]
        assert not [(one, other) for i, one in enumerate(drawn) for other in drawn[:i] if markers.overlap(one, other)]
        with window_context():
            legend.move(bpy.context, *of_worst()[:2])
        boxes.clear()
        view()[1].tag_redraw()
        yield from finished(lambda: boxes)
        yield
        view()[1].tag_redraw()
        boxes.clear()
        yield from finished(lambda: boxes)
        screenshot("probe 10 legend in the middle")
        drawn = [legend.box(place), *boxes]
        assert not [(one, other) for i, one in enumerate(drawn) for other in drawn[:i] if markers.overlap(one, other)]
    finally:
        markers.Box.draw = draw
        legend.forget_moved()


def test_the_probe_in_themes_widths_scales_and_quad_view():
    yield from reset(ball)
    yield from open_tab()
    bpy.ops.tolvol.add_label(position=(-1, -0.5, 0))
    left, _ = places()
    try:
        light()
        yield from drag_sidebar(60)
        yield from press("tolvol.probe", across=0.5)
        xdotool("mousemove", *left)
        yield from finished(lambda: probing.hover() and probing.hover().lines)
        yield from at_rest()
        screenshot("probe 5 light and narrow")
        key("Escape")
        yield from finished(lambda: not TOLVOL_OT_probe.running())
        yield from drag_sidebar(-60)
        dark()
        with window_context():
            bpy.ops.screen.region_quadview()
        yield from at_rest()
        yield from press("tolvol.probe", across=0.5)
        seen = set()
        for share in ((0.25, 0.25), (0.72, 0.25), (0.25, 0.75), (0.72, 0.75)):
            area = view()[1]
            place = area.x + int(share[0] * area.width), view()[0].height - area.y - int(share[1] * area.height)
            xdotool("mousemove", *place)
            yield from at_rest()
            if probing.hover().lines:
                seen.add(probing.hover().region)
        screenshot("probe 6 quad view")
        assert len(seen) == 4
        xdotool("click", 3)  # The right button ends it, too.
        yield from finished(lambda: not TOLVOL_OT_probe.running())
        with window_context():
            bpy.ops.screen.region_quadview()
        bpy.context.preferences.view.ui_scale = 2
        yield from at_rest()
        with window_context():
            bpy.ops.tolvol.probe("INVOKE_DEFAULT")
        xdotool("mousemove", *left)
        yield from finished(lambda: probing.hover() and probing.hover().lines)
        yield from at_rest()
        screenshot("probe 7 twice as large")
        key("Escape")
        yield from finished(lambda: not TOLVOL_OT_probe.running())
    finally:
        bpy.context.preferences.view.ui_scale = 1
        dark()
    yield from at_rest()


def test_the_probe_ends_when_its_object_or_file_does():
    yield from reset(ball)
    yield from open_tab()
    left, _ = places()
    yield from press("tolvol.probe", across=0.5)
    yield from finished(TOLVOL_OT_probe.running)
    yield from press("tolvol.probe", across=0.5)  # The same button ends it.
    yield from finished(lambda: not TOLVOL_OT_probe.running())
    yield from press("tolvol.probe", across=0.5)
    yield from finished(TOLVOL_OT_probe.running)
    xdotool("mousemove", *left)
    yield from finished(lambda: probing.hover().lines)
    # Keys that would change the mesh do nothing meanwhile.
    xdotool("key", "Tab")
    yield
    assert the_ball().mode == "OBJECT"
    the_ball().data.vertices[0].co.z += 0.01
    the_ball().data.update()
    yield from finished(lambda: probing.hover().lines and probing.hover().lines != ["Preparing"])
    bpy.data.objects.remove(the_ball())
    yield from finished(lambda: not TOLVOL_OT_probe.running())
    assert probing.hover() is None
    yield from reset(ball)
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "probe.blend")
        bpy.ops.tolvol.add_label(position=(1, 0, 0))
        bpy.ops.wm.save_as_mainfile(filepath=path)
        with window_context():
            bpy.ops.tolvol.probe("INVOKE_DEFAULT")
        yield from finished(TOLVOL_OT_probe.running)
        with window_context():
            bpy.ops.wm.open_mainfile(filepath=path)
    yield from finished(lambda: not TOLVOL_OT_probe.running())
    yield from at_rest()
    assert probing.hover() is None and len(the_ball().tolvol.labels) == 1
    assert labels.current(the_ball(), the_ball().tolvol.labels[0]) and overlay.annotations._drawing
    screenshot("probe 8 file opened")
