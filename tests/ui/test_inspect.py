# SPDX-License-Identifier: GPL-3.0-or-later
"""What is beyond the tolerance is found, marked and brought into view by mouse."""

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

import scenes
from addon import panels
from addon.mesh import mesh_io
from addon.overlay import annotations, legend
from addon.panels import notes
from addon.proof import kept_warnings, places
from panels_open import alone
from test_job import status_bar_pixels
from test_warnings import islands
from window import (
    WIDE,
    at_rest,
    finished,
    on_screen,
    open_tab,
    pixels,
    press,
    region,
    reset,
    screenshot,
    view,
    window_context,
    xdotool,
)

WIDTH = WIDE  # The view has room for the boxes of places and labels beside the mesh.


def ball():
    """A ball with a dent in front and a peak at the back."""

    def dented(co):
        for direction, factor in (((0.6, -0.6, 0.5), 0.9), ((-0.6, 0.6, -0.5), 1.2)):
            towards = np.array(direction) / np.linalg.norm(direction)
            near = co @ towards > 0.985
            co[near] *= factor
        return co

    scenes.changed_ball(dented)


def the_ball():
    return bpy.data.objects["ball"]


def in_the_middle(position):
    """Whether a point of the world is in the middle of the 3D view."""
    place = region("WINDOW")
    spot = location_3d_to_region_2d(place, view()[1].spaces[0].region_3d, Vector(position))
    return (spot - Vector((place.width / 2, place.height / 2))).length < 5


def white_near_the_middle():
    """Returns the number of white pixels in the middle of the view, where the present place has its mark."""
    place = region("WINDOW")
    x, y = on_screen(place, place.width // 2, place.height // 2)
    return int((pixels()[y - 24 : y + 25, x - 24 : x + 25].min(2) > 250).sum())


def test_worst_point_next_and_previous_by_mouse():
    yield from reset(ball)
    with alone(panels.TOLVOL_PT_deviation):
        yield from open_tab()
        plain = white_near_the_middle()
        yield from press("tolvol.worst_point", across=0.25)
        yield from finished(lambda: places.shown(the_ball())[0])
        yield from at_rest()
        screenshot("worst point")
        found, _, _ = places.shown(the_ball())
        assert len(found) == 4 and found[0].distance.lower > 0.19 and found[0].position[1] > 0
        assert in_the_middle(found[0].position) and white_near_the_middle() > plain + 20
        towards = view()[1].spaces[0].region_3d.view_rotation @ Vector((0, 0, 1))
        assert towards.y > 0.2  # The view was turned to the back.
        for at, across in ((1, 0.684), (2, 0.684), (1, 0.59)):
            yield from press("tolvol.next_place", across=across)
            yield from finished(lambda at=at: places.shown(the_ball())[1] == at)
            yield
            screenshot(f"worst point {at + 1}")
            assert in_the_middle(found[at].position)
        yield from press("tolvol.clear_places", across=0.775)
        yield from finished(lambda: not places.any_shown())
        yield from at_rest()
        assert not annotations._drawing and white_near_the_middle() < plain + 20
        # Select Outside brings the selected faces into view, too: all of them are at two ends of the ball.
        view()[1].spaces[0].region_3d.view_distance = 50
        yield from press("tolvol.select_outside", across=0.7)
        yield from finished(lambda: the_ball().mode == "EDIT")
    yield from at_rest()
    screenshot("select outside frames")
    assert view()[1].spaces[0].region_3d.view_distance < 10
    with window_context():
        bpy.ops.object.mode_set(mode="OBJECT")


def test_the_worst_point_lies_beside_the_legend_where_that_covers_the_middle():
    yield from reset(ball)
    with alone(panels.TOLVOL_PT_deviation):
        yield from open_tab()
        the_ball().tolvol.show_deviation = True
        area = region("WINDOW")
        yield from finished(lambda: legend.box(area))
        with window_context():
            _, _, width, height = legend.box(area)
            legend.move(bpy.context, (area.width - width) / 2, (area.height - height) / 2)
            bpy.context.area.tag_redraw()
        yield from at_rest()
        yield from press("tolvol.worst_point", across=0.25)
        yield from finished(lambda: places.shown(the_ball())[0])
        yield from at_rest()
        screenshot("worst point beside the legend")
    box, ob = legend.box(area), the_ball()
    found, at, _ = places.shown(ob)
    spot = location_3d_to_region_2d(area, view()[1].spaces[0].region_3d, Vector(found[at].position))
    with window_context():
        left, right, _ = legend.free_part(bpy.context)
        legend.forget_moved()
    assert box[0] < area.width / 2 < box[0] + box[2] and left < spot.x < right
    assert not legend.reaches(box, spot, 20) and abs(spot.y - area.height / 2) < 5


def test_warnings_stay_in_the_panel_and_select_their_vertices():
    yield from reset(lambda: islands(scenes.sheet(), 900))
    yield from open_tab()
    said, text_lines = [], notes.text_lines
    notes.text_lines = lambda context, where, text, icon: said.append(text) or text_lines(context, where, text, icon)
    ob = bpy.data.objects["sheet"]
    yield from press("tolvol.decimate")
    yield from finished(lambda: ob.tolvol.warnings)
    (warning,), _ = kept_warnings.of(ob)
    yield from finished(lambda: warning in said)
    xdotool("mousemove", 5, 5)
    yield from finished(
        lambda: np.ptp(status_bar_pixels()[:, 460:], axis=(0, 1)).max() == 0
    )  # It has no text any more.
    said.clear()
    view()[1].tag_redraw()
    yield from finished(lambda: warning in said)
    notes.text_lines = text_lines
    yield from press("tolvol.select_staying")
    yield from finished(lambda: ob.mode == "EDIT")
    yield
    screenshot("staying vertices")
    ob.update_from_editmode()
    assert warning.startswith("841 of 961 vertices")
    assert mesh_io.column(ob.data.vertices, "select", 1, bool).sum() == 841
    with window_context():
        bpy.ops.object.mode_set(mode="OBJECT")
    xdotool("mousemove", 5, 5)
