# SPDX-License-Identifier: GPL-3.0-or-later
"""The colours of Show Deviation: the tests count pixels of the screen."""

import bmesh
import bpy
import numpy as np
from mathutils import Vector

import scenes
from addon import guard, native, overlay
from addon.proof import verdict
from test_panel import monkey, suzanne
from window import (
    WIDE,
    at_rest,
    centre,
    click,
    find_property,
    finished,
    key,
    on_screen,
    open_tab,
    pixels,
    press,
    region,
    reset,
    screenshot,
    scroll_down,
    sculpt_by_drawing,
    view,
    window_context,
    xdotool,
)

WIDTH = WIDE  # The tests count the pixels of a large view.


def ball():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6)
    bpy.context.object.tolvol.tolerance_percent = 1
    bpy.context.object.tolvol.deviation_kind = "MAGNITUDE"
    bpy.context.object.tolvol.deviation_opacity = 1
    view()[1].spaces[0].region_3d.view_distance = 5


def test_a_hole_that_is_cut_is_seen_on_the_reference_and_the_guard_puts_it_back():
    yield from reset(ball)
    ob = the_object()
    bpy.ops.tolvol.set_reference()
    xdotool("mousemove", *centre())
    yield from finished(lambda: near() > 30_000)
    ob.tolvol.deviation_surface = "REFERENCE"
    to_mode("EDIT")
    towards = view()[1].spaces[0].region_3d.view_rotation @ Vector((0, 0, 1))
    edited = bmesh.from_edit_mesh(ob.data)
    for face in edited.faces:
        face.select = face.normal.dot(towards) > 0.9
    with window_context():
        bpy.ops.mesh.select_mode(type="FACE")
    bmesh.update_edit_mesh(ob.data)
    whole = len(edited.faces)
    yield from finished(lambda: near() > 30_000 and verdict.word(ob) == verdict.PASS)
    assert striped() == 0
    yield from delete_faces()
    yield from finished(lambda: verdict.word(ob) == verdict.FAIL)
    yield from finished(lambda: striped() > 1000)
    screenshot("overlay 10 hole on the reference")
    assert verdict.of(ob).ways == "the reference" and len(bmesh.from_edit_mesh(ob.data).faces) < whole
    key("ctrl+z")
    yield from finished(lambda: striped() == 0 and verdict.word(the_object()) == verdict.PASS)
    undone, undo = [], guard.edit.undo
    # Undo may make the object anew.
    guard.edit.undo = lambda: undone.append(len(bmesh.from_edit_mesh(the_object().data).faces)) or undo()
    try:
        the_object().tolvol.guard.editing = True
        the_object().update_tag()
        yield from finished(lambda: [on for _, _, on in guard.states(the_object())] == [True])
        yield from delete_faces()
        yield from finished(lambda: undone and verdict.word(the_object()) == verdict.PASS)
    finally:
        guard.edit.undo = undo
    assert undone[0] < whole == len(bmesh.from_edit_mesh(the_object().data).faces)
    to_mode("OBJECT")


def delete_faces():
    """Deletes the selected faces by the menu of X, which takes a letter only once it is there."""
    xdotool("key", "x")
    yield
    xdotool("key", "f")


def solid_monkey(voxel_size=0.04):
    """Makes a closed monkey. Blender's own is open."""
    bpy.ops.mesh.primitive_monkey_add()
    ob = bpy.context.object
    ob.modifiers.new("subdivision", "SUBSURF").levels = 2
    remesh = ob.modifiers.new("remesh", "REMESH")
    remesh.voxel_size, remesh.use_smooth_shade = voxel_size, True
    ob.modifiers.new("smooth", "SMOOTH").iterations = 3
    with bpy.context.temp_override(window=view()[0], area=view()[1], object=ob, active_object=ob):
        bpy.ops.object.convert(target="MESH")
    ob.tolvol.tolerance_percent = 1
    view()[1].spaces[0].region_3d.view_distance = 4.5


def the_object():
    return bpy.data.objects[0]


def striped():
    """Returns the number of pixels of the view with the colours of stripes."""
    return int((np.abs(surface() - native.module.OUTSIDE_COLOURS[0]).max(-1) <= 2).sum())


def near():
    """Returns the number of pixels with the colour of no deviation: yellow, lit or not. No other part of the view has it."""
    red, green, blue = np.moveaxis(surface(), -1, 0)
    return int(((red > 100) & (green > 90) & (blue < 45) & (np.abs(red - green) < 40)).sum())


def gone():
    return near() < 300  # Some such pixels belong to edges drawn around.


def surface():
    """Returns the picture of the view without the sidebar and the legend."""
    place = region("WINDOW")
    x, y = on_screen(place, 0, 0)
    return pixels()[y + 40 : y + place.height - 40, x + 70 : x + place.width - 450]


def to_mode(mode):
    with bpy.context.temp_override(window=view()[0], area=view()[1], object=the_object()):
        bpy.ops.object.mode_set(mode=mode)
    bpy.ops.ed.undo_push(message=mode)  # A key would store an undo step, too.


def test_deviation_is_shown_while_the_mesh_changes():
    yield from reset(ball)
    yield from open_tab()
    assert gone() and not overlay.shows(the_object())
    yield from press("tolvol.set_reference")
    xdotool("mousemove", *centre())
    yield from finished(lambda: near() > 30_000)
    assert striped() == 0
    screenshot("overlay 1 set")

    to_mode("SCULPT")
    sculpt_by_drawing()
    yield
    x, y = centre()
    yield from stroke((x, y), (x + 72, y), before_it_ends=lambda: striped() > 100)
    screenshot("overlay 2 sculpted")
    key("ctrl+z")
    yield from finished(lambda: striped() == 0)
    assert near() > 30_000

    to_mode("EDIT")
    xdotool("mousemove", x, y)
    yield
    assert near() > 3000
    xdotool("key", "--delay", 100, "s", "1", "period", "0", "5")
    yield from finished(lambda: striped() > 3000)  # The stripes appear while the stroke goes on.
    screenshot("overlay 3 scaling in edit mode")
    key("Escape")
    yield from finished(lambda: striped() == 0)
    to_mode("OBJECT")

    the_object().tolvol.tolerance_percent = 5
    the_object().data.vertices.foreach_set("co", (1.02 * np.array([v.co for v in the_object().data.vertices])).ravel())
    the_object().data.update()
    yield from at_rest()
    yield from finished(lambda: striped() == 0 and not gone())
    the_object().tolvol.tolerance_percent = 0.2
    yield from finished(lambda: striped() > 10_000)


def test_sides_of_a_closed_reference():
    yield from reset(solid_monkey)
    yield from open_tab()
    yield from press("tolvol.set_reference")
    xdotool("mousemove", *beside())
    yield from finished(lambda: overlay.field.at_hand(the_object()) is not None)
    the_object().tolvol.deviation_opacity = 0.8
    to_mode("SCULPT")
    sculpt_by_drawing()
    view()[1].spaces[0].show_gizmo = False
    yield from at_rest()
    red, blue = sides()
    assert red < 300 and blue < 300
    x, y = on_screen(region("WINDOW"), *(size // 2 for size in (region("WINDOW").width, region("WINDOW").height)))
    yield from stroke((x - 130, y - 90), (x - 20, y - 140))
    assert sides()[0] > red + 300 and sides()[1] < 300
    xdotool("keydown", "ctrl")
    yield from stroke((x - 80, y + 40), (x + 10, y - 20))
    xdotool("keyup", "ctrl")
    yield from at_rest()
    screenshot("overlay 6 both sides")
    assert sides()[1] > blue + 300


def thin_sheets():
    """Makes an open and thin mesh: two wavy sheets with opposite orientation, a hundredth of the tolerance apart."""
    vertices, faces = scenes.sheet_arrays(count=60)
    other = vertices + np.array([0, 0, 2e-4], np.float32)
    both = np.concatenate([faces, faces[:, ::-1] + len(vertices)])
    ob = scenes.add_object("sheets", np.concatenate([vertices, other]), both)
    shown_as_magnitude(ob, 1)


def fine_monkey():
    """Makes a monkey of 15,744 triangles, which is open at the eyes."""
    monkey()
    shown_as_magnitude(suzanne(), 0.05)


def shown_as_magnitude(ob, percent):
    ob.tolvol.tolerance_percent = percent
    ob.tolvol.deviation_kind, ob.tolvol.deviation_opacity = "MAGNITUDE", 1
    view()[1].spaces[0].region_3d.view_distance = 5


def counted():
    """Returns the tolerance for which the legend shows shares, or None while they are blank."""
    (_, scale), found = overlay.shares._counted.get(the_object().name) or ((None, None), None)
    return found and scale.tolerance


def far():
    """Returns the number of pixels with colours of a deviation of at least a quarter of the tolerance, lit or not: green,
    blue and violet."""
    red, green, blue = np.moveaxis(surface(), -1, 0)
    return int(((blue > 60) & (np.maximum(abs(red - green), abs(green - blue)) > 25)).sum())


def test_triangles_are_drawn_once_for_each_drawing_of_the_view():
    yield from reset(ball)
    bpy.ops.tolvol.set_reference()
    xdotool("mousemove", *beside())
    yield from finished(lambda: near() > 30_000)
    calls, shading = [], view()[1].spaces[0].shading
    draw, fill = overlay.surface.Surface.draw, overlay.draw._fill
    overlay.surface.Surface.draw = lambda *about: calls.append("triangles") or draw(*about)
    overlay.draw._fill = lambda *about: calls.append("view") or fill(*about)
    try:
        for shading.show_xray in (False, True):
            calls.clear()
            view()[1].tag_redraw()
            yield from finished(lambda: calls)
            yield
            assert calls.count("triangles") == calls.count("view"), calls
    finally:
        overlay.surface.Surface.draw, overlay.draw._fill = draw, fill
        shading.show_xray = False


def test_what_deviates_by_nothing_is_drawn_as_nothing():
    for make in (thin_sheets, fine_monkey):
        yield from reset(make)
        yield from open_tab()
        yield from press("tolvol.set_reference")
        xdotool("mousemove", *beside())
        space = view()[1].spaces[0]
        space.show_gizmo = space.overlay.show_object_origins = space.overlay.show_cursor = False
        yield from finished(lambda: near() > 15_000)
        yield from at_rest()
        screenshot(f"overlay 7 {make.__name__} untouched")
        assert striped() == 0 and far() == 0, make
        the_object().tolvol.deviation_kind = "SIGNED"
        yield from at_rest()
        assert striped() == 0
    # The proved result has no striped speck either.
    the_object().tolvol.tolerance_percent = 0.1
    before = len(the_object().data.polygons)
    yield from press("tolvol.decimate")
    yield from finished(lambda: len(the_object().data.polygons) < before and verdict.of(the_object()) is not None)
    xdotool("mousemove", *beside())
    yield from finished(lambda: counted() == 0.1 / 100 * the_object().tolvol.snapshot_size)
    yield from at_rest()
    screenshot("overlay 8 proved")
    assert verdict.of(the_object()).kind == verdict.WITHIN and striped() == 0
    the_object().tolvol.tolerance_percent = 0.05
    yield from finished(lambda: striped() > 1000)
    screenshot("overlay 9 half the tolerance")
    space.show_gizmo = space.overlay.show_object_origins = space.overlay.show_cursor = True


def small_ball():
    ball()
    the_object().scale = (0.02,) * 3
    view()[1].spaces[0].region_3d.view_distance = 0.1


# The rounding of the places of its vertices is then larger than the steps of the depths near the eye.
def test_a_close_view_of_an_object_far_from_the_origin_is_coloured_everywhere():
    yield from reset(small_ball)
    bpy.ops.tolvol.set_reference()
    xdotool("mousemove", *beside())
    yield from finished(lambda: near() > 30_000)
    yield from at_rest()
    at_origin = near()
    the_object().location = view()[1].spaces[0].region_3d.view_location = (20, 10, 5)
    yield from finished(lambda: near() > 10_000)
    yield from at_rest()
    screenshot("overlay 11 far from the origin")
    assert near() > 0.98 * at_origin


def stroke(start, end, steps=4, before_it_ends=lambda: True):
    """Drags the brush over the mesh. The stroke ends once before_it_ends() is true."""
    xdotool("mousemove", *start)
    yield
    xdotool("mousedown", 1)
    for step in range(1, steps + 1):
        xdotool("mousemove", *((a + (b - a) * step // steps) for a, b in zip(start, end)))
        yield
    yield from finished(before_it_ends)
    xdotool("mouseup", 1, "mousemove", *beside())
    yield


def beside():
    """Returns a place on the screen for the mouse where the circle of the brush is not counted."""
    return on_screen(region("WINDOW"), 75, region("WINDOW").height - 20)


def sides():
    """Returns the numbers of pixels of the view that are red, for outside, and blue, for inside."""
    red, green, blue = np.moveaxis(surface(), -1, 0)
    return int(((red > 110) & (red - blue > 60) & (red - green > 50)).sum()), int(
        ((blue - red > 60) & (blue > 110)).sum()
    )


def test_views_places_and_switches():
    yield from reset(ball)
    yield from open_tab()
    yield from press("tolvol.set_reference")
    xdotool("mousemove", *centre())
    yield from finished(lambda: near() > 30_000)
    space = view()[1].spaces[0]
    space.region_3d.view_perspective = "ORTHO"
    the_object().scale.x = -1
    the_object().location.x += 0.3
    yield
    assert near() > 30_000, "moved and mirrored"
    the_object().scale.x *= 2
    yield from finished(lambda: near() > 40_000)
    screenshot("overlay 4 scaled with its reference")
    assert striped() == 0
    the_object().scale.x /= 2
    the_object().name = "another"
    yield from finished(lambda: near() > 30_000)
    with window_context():
        bpy.ops.view3d.localview(frame_selected=False)
    yield
    assert near() > 30_000
    the_object().hide_set(True)
    yield
    assert gone()
    the_object().hide_set(False)
    with window_context():
        bpy.ops.view3d.localview(frame_selected=False)
    space.overlay.show_overlays = False
    yield
    assert gone()
    space.overlay.show_overlays = True
    space.region_3d.view_perspective = "PERSP"

    yield from scroll_down()
    place = yield from find_property("show_deviation", across=0.2)
    assert place is not None
    yield from click(*place)
    yield
    screenshot("overlay 5 off")
    xdotool("mousemove", *centre())
    yield
    assert not the_object().tolvol.show_deviation and gone()
    assert not overlay.shows(the_object()) and not overlay._drawing and not overlay.geometry_buffer._buffers
    assert not any(handler.__module__.startswith("addon.overlay") for handler in bpy.app.handlers.depsgraph_update_post)
    the_object().tolvol.show_deviation = True
    yield from finished(lambda: near() > 30_000)
    bpy.data.objects.remove(the_object())
    yield
    assert gone() and not overlay._drawing
