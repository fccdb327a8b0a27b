# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Deviation as it looks: what is counted are pixels of the screen."""

import bpy
import numpy as np

from addon import native, overlay
from test_panel import finished
from window import (
    centre,
    click,
    find_property,
    key,
    on_screen,
    open_tab,
    pixels,
    press,
    region,
    reset,
    screenshot,
    view,
    xdotool,
)


def ball():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6)
    bpy.context.object.name = "ball"
    bpy.context.object.tolvol.deviation_kind = "MAGNITUDE"
    bpy.context.object.tolvol.deviation_opacity = 1
    view()[1].spaces[0].region_3d.view_distance = 5


def the_ball():
    return bpy.data.objects["ball"]


def striped():
    """Pixels of the view that say: outside."""
    return int((np.abs(_surface() - native.module.OUTSIDE_COLOURS[0]).max(-1) <= 2).sum())


def near():
    """Pixels of the view with the colour of no deviation, which nothing else there has: yellow, lit or not."""
    red, green, blue = np.moveaxis(_surface(), -1, 0)
    return int(((red > 100) & (green > 90) & (blue < 45) & (np.abs(red - green) < 40)).sum())


def gone():
    return near() < 300  # some are the edges of what is drawn around


def _surface():
    """Without the sidebar and the legend."""
    place = region("WINDOW")
    x, y = on_screen(place, 0, 0)
    return pixels()[y + 40 : y + place.height - 40, x + 70 : x + place.width - 400]


def to_mode(mode):
    with bpy.context.temp_override(window=view()[0], area=view()[1], object=the_ball()):
        bpy.ops.object.mode_set(mode=mode)
    bpy.ops.ed.undo_push(message=mode)  # as a key would


def test_deviation_is_shown_while_the_mesh_changes():
    yield from reset(ball)
    yield from open_tab()
    assert gone() and not overlay.shows(the_ball())
    yield from press("tolvol.set_reference")
    xdotool("mousemove", *centre())
    yield from finished(lambda: near() > 30_000)
    assert striped() == 0
    screenshot("overlay 1 set")

    to_mode("SCULPT")
    yield 0.5
    x, y = centre()
    xdotool("mousemove", x, y, "sleep", "0.2", "mousedown", 1)
    for step in range(1, 9):
        xdotool("mousemove", x + 9 * step, y)
        yield 0.1
    yield 0.4
    during = striped()
    xdotool("mouseup", 1)
    screenshot("overlay 2 sculpted")
    assert during > 100
    yield 0.5
    key("ctrl+z")
    yield from finished(lambda: striped() == 0)
    assert near() > 30_000

    to_mode("EDIT")
    xdotool("mousemove", x, y)
    yield 0.5
    assert near() > 3000
    xdotool("key", "--delay", 100, "s", "1", "period", "0", "5")
    yield from finished(lambda: striped() > 3000)  # while it is going on
    screenshot("overlay 3 scaling in edit mode")
    key("Escape")
    yield from finished(lambda: striped() == 0)
    to_mode("OBJECT")

    the_ball().tolvol.tolerance_percent = 5
    the_ball().data.vertices.foreach_set("co", (1.02 * np.array([v.co for v in the_ball().data.vertices])).ravel())
    the_ball().data.update()
    yield 1.0
    assert gone() and striped() == 0, "neither near nor outside"
    the_ball().tolvol.tolerance_percent = 0.2
    yield from finished(lambda: striped() > 10_000)


def test_views_places_and_switches():
    yield from reset(ball)
    yield from open_tab()
    yield from press("tolvol.set_reference")
    xdotool("mousemove", *centre())
    yield from finished(lambda: near() > 30_000)
    space = view()[1].spaces[0]
    space.region_3d.view_perspective = "ORTHO"
    the_ball().scale.x = -1
    the_ball().location.x += 0.3
    yield 0.7
    assert near() > 30_000, "moved and mirrored"
    the_ball().scale.x *= 2
    yield 0.7
    screenshot("overlay 4 rescaled")
    assert gone()
    the_ball().scale.x /= 2
    yield 0.7
    assert near() > 30_000
    space.overlay.show_overlays = False
    yield 0.5
    assert gone()
    space.overlay.show_overlays = True
    space.region_3d.view_perspective = "PERSP"

    place = yield from find_property("show_deviation")
    assert place is not None
    yield 0.6  # until no tooltip is in the way
    click(*place)
    yield 0.5
    screenshot("overlay 5 off")
    xdotool("mousemove", *centre())
    yield 0.7
    assert not the_ball().tolvol.show_deviation and gone()
    assert not overlay.shows(the_ball()) and not overlay._drawing
    assert not any(handler.__module__.startswith("addon.overlay") for handler in bpy.app.handlers.depsgraph_update_post)
    the_ball().tolvol.show_deviation = True
    yield from finished(lambda: near() > 30_000)
    bpy.data.objects.remove(the_ball())
    yield 0.7
    assert gone() and not overlay._drawing
