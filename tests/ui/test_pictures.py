# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the pictures of the add-on in the README and the manual: build/ui/guard.png, overlay.png and panel.png.

In the run of everything their edges are smooth and the mesh is finer, which takes four minutes. Only these pictures are for
the documentation.
"""

import os
from functools import partial

import bpy
import numpy as np
from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d
from mathutils import Euler, Vector

from addon import guard
from addon.panels.guard import TOLVOL_PT_guard
from addon.proof import places, verdict
from addon.reference import measurements
from panels_open import alone
from test_show_deviation import counted, sides, solid_monkey, stroke, surface, the_object, to_mode
from window import (
    WIDE,
    draw_finely,
    finished,
    on_screen,
    open_tab,
    picture,
    pixels,
    region,
    reset,
    resize,
    sculpt_by_drawing,
    still,
    view,
    window_context,
    xdotool,
)

WIDTH = WIDE  # The view of the pictures is as wide as that.

_FOREHEAD = (0.43, 0.255), (0.54, 0.235)  # two places, as shares of the view's width and height
_MIDDLE = (0.46, 0.25), (0.50, 0.243)
_SNOUT = (0.36, 0.72), (0.38, 0.75)


def test_pictures_for_the_documentation():
    for_documentation = "TOLVOL_ALL_TESTS" in os.environ
    make = partial(solid_monkey, 0.025 if for_documentation else 0.06)
    yield from reset(make)
    usual = view()[0].width, view()[0].height
    if for_documentation:
        yield from resize(1280, 800)
    draw_finely(for_documentation)
    space = view()[1].spaces[0]
    space.show_gizmo = space.show_region_toolbar = space.overlay.show_cursor = False
    from_the_front()
    with alone(TOLVOL_PT_guard):
        yield from open_tab()
        begin("set_reference")
        the_object().tolvol.guard.sculpting = True
        to_mode("SCULPT")
        sculpt_by_drawing()
        bpy.context.tool_settings.sculpt.show_brush = False
        bpy.context.tool_settings.sculpt.brush.strength = 1
        yield from draw(*_FOREHEAD)
        yield from finished(lambda: sides()[0] > 300)
        yield from finished(lambda: verdict.word(the_object()) == verdict.PASS and counted() is not None, pause=0.05)
        yield
        picture("guard")
    assert magenta() == 0
    assert [text.startswith("Held back") for _, text, _ in guard.states(the_object())] == [True]

    the_object().tolvol.guard.sculpting = False
    bpy.context.tool_settings.sculpt.brush.strength = 0.6
    yield from draw(*_MIDDLE)
    xdotool("keydown", "ctrl")
    yield from draw(*_SNOUT)
    xdotool("keyup", "ctrl")
    yield from settled()
    bpy.context.tool_settings.sculpt.show_brush = True
    to_mode("OBJECT")
    bpy.ops.tolvol.add_label(position=seen_at(*_SNOUT[1]))
    begin("worst_point")
    yield from finished(lambda: places.shown(the_object())[0])
    from_the_front()  # Worst Point has brought its place into the middle of the view.
    yield from settled()
    picture("overlay")
    assert min(sides()) > 300 and magenta() > 300

    yield from reset(make)
    from_the_front()
    space.overlay.show_wireframes = True
    begin("decimate")
    yield from finished(lambda: measurements.measurement_of(the_object()) is not None)
    yield from settled()
    picture("panel")
    found = verdict.of(the_object())
    assert found.forward_within and found.backward_within and min(sides()) > 300 and magenta() == 0
    space.overlay.show_wireframes = False
    space.show_gizmo = space.show_region_toolbar = space.overlay.show_cursor = True
    draw_finely(False)
    yield from resize(*usual)


def from_the_front():
    """Shows the monkey from one side, so near that it fills the view."""
    camera = view()[1].spaces[0].region_3d
    camera.view_perspective, camera.view_distance = "PERSP", 3.4
    camera.view_rotation = Euler((1.4, 0, 0.5)).to_quaternion()
    camera.view_location = camera.view_rotation @ Vector((0.3, 0, 0))


def begin(operator):
    with window_context():
        getattr(bpy.ops.tolvol, operator)("INVOKE_DEFAULT")


def seen_at(x, y):
    """Returns the point of the mesh that is seen at a place of the view. x, y: as shares of the view's width and height."""
    place, camera = region("WINDOW"), view()[1].spaces[0].region_3d
    at = x * place.width, (1 - y) * place.height
    ray = region_2d_to_origin_3d(place, camera, at), region_2d_to_vector_3d(place, camera, at)
    return bpy.context.scene.ray_cast(bpy.context.evaluated_depsgraph_get(), *ray)[1]


def draw(*ends):
    place = region("WINDOW")
    yield from stroke(*(on_screen(place, int(x * place.width), int(y * place.height)) for x, y in ends))
    aside()


def aside():
    """Moves the mouse above the 3D view, beside the menu Help, so that no tooltip is in the picture."""
    xdotool("mousemove", 262, 10)


def magenta():
    """Returns the number of pixels with the colours of stripes, which are shaded here."""
    red, green, blue = np.moveaxis(surface(), -1, 0)
    return int(((red > 150) & (green < 80) & (blue > 90)).sum())


def settled():
    """Waits until the colours are shown and the picture no longer changes."""
    aside()
    yield from finished(lambda: min(sides()) > 300)
    yield from still(pixels)
