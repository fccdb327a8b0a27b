# SPDX-License-Identifier: GPL-3.0-or-later
"""The range and the bands of the legend, as they are drawn, and the statistics in the panel."""

import bpy
import numpy as np

from addon import overlay, panels
from addon.overlay import legend
from addon.proof import statistics
from panels_open import unfolded
from test_layout import dark, drag_sidebar, light
from test_show_deviation import striped, surface
from window import (
    WIDE,
    at_rest,
    click_property,
    finished,
    on_screen,
    open_tab,
    pixels,
    press,
    region,
    reset,
    resize,
    screenshot,
    scroll_down,
    sent,
    still,
    view,
    window_context,
    xdotool,
)

WIDTH = WIDE  # The legend is dragged, and its colours are counted in a wide view.


def ramp():
    """A closed slab whose upper side goes up from one end to the other, by four tolerances, after its reference was set."""
    bpy.ops.mesh.primitive_cube_add(size=2)
    ob = bpy.context.object
    ob.name = "ramp"
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.1
    ob.tolvol.deviation_opacity = 1
    bpy.ops.tolvol.set_reference()
    for vertex in ob.data.vertices:
        vertex.co.z += 0.2 * (vertex.co.x + 1) * (vertex.co.z > 0)
    ob.data.update()
    space = view()[1].spaces[0]
    space.region_3d.view_perspective, space.region_3d.view_rotation = "ORTHO", (1, 0, 0, 0)  # from above
    space.region_3d.view_distance = 5
    space.show_gizmo = space.overlay.show_cursor = space.overlay.show_object_origins = False


def the_ramp():
    return bpy.data.objects["ramp"]


def colours():
    """Returns how many colours take a good part of the view, without those of the background."""
    found, counts = np.unique(surface().reshape(-1, 3) // 3, axis=0, return_counts=True)
    return int(((counts > 300) & (np.ptp(found, axis=1) > 4)).sum())


def labels_of_the_legend():
    """Records the texts that the legend draws from now on. Call the result to stop."""
    said, text = [], legend.Page.text
    legend.Page.text = lambda page, x, y, words, *rest, **options: (
        said.append(words.replace("\u00a0", " ")) or text(page, x, y, words, *rest, **options)
    )

    def stop():
        legend.Page.text = text

    return said, stop


def test_range_and_bands_of_the_colours():
    yield from reset(ramp)
    yield from open_tab()
    settings = the_ramp().tolvol
    said, stop = labels_of_the_legend()
    try:
        xdotool("mousemove", *on_screen(region("WINDOW"), 120, 600))
        yield from finished(lambda: striped() > 10_000)
        view()[1].tag_redraw()
        yield from finished(lambda: "+10 cm" in said and "\u221210 cm" in said)
        yield from at_rest()
        screenshot("legend 1 tolerance")
        # Each band within the tolerance has one colour: a quarter of the ramp has the upper half of them.
        settings.use_bands, settings.band_count = True, 10
        yield from finished(lambda: 5 <= colours() <= 7)
        yield from at_rest()
        screenshot("legend 2 ten bands")
        said.clear()
        settings.deviation_range = "AUTOMATIC"
        yield from finished(lambda: "+40 cm" in said)
        yield from at_rest()
        screenshot("legend 3 automatic")
        assert "+10 cm (tolerance)" in said and "\u221210 cm (tolerance)" in said
        assert striped() > 10_000, "beyond the tolerance every colour is striped"
        settings.use_bands = False
        said.clear()
        settings.deviation_range, settings.deviation_limit = "FIXED", 0.05
        yield from finished(lambda: "+5 cm" in said)
        yield from at_rest()
        screenshot("legend 4 fixed")
        settings.use_bands, settings.band_count = True, 20
        said.clear()
        yield from finished(lambda: sum(text.endswith(" %") for text in said) >= 21)
        yield from at_rest()
        light()
        yield from at_rest()
        screenshot("legend 5 twenty bands, light")
        # Where twenty rows have no room, the bar has its usual height and no shares.
        bpy.context.preferences.view.ui_scale = 1.3
        yield from at_rest()
        said.clear()
        view()[1].tag_redraw()
        yield from finished(lambda: "+5 cm" in said or "NOT CHECKED" in said)
        yield
        screenshot("legend 6 larger")
        assert sum(text.endswith(" %") for text in said) <= 1 < len(said)
    finally:
        stop()
        bpy.context.preferences.view.ui_scale = 1
        dark()
    with window_context():
        bpy.ops.screen.region_quadview()
    yield from at_rest()
    screenshot("legend 7 quad view")
    with window_context():
        bpy.ops.screen.region_quadview()
    view()[1].spaces[0].region_3d.view_perspective = "PERSP"
    space = view()[1].spaces[0]
    space.show_gizmo = space.overlay.show_cursor = space.overlay.show_object_origins = True
    assert overlay.shows(the_ramp())


def choose(name, letter):
    """Chooses the value of a property from its menu, in which Blender underlines a letter of each value."""
    yield from click_property(name, across=0.66)
    yield
    xdotool("key", letter)


def bar_pixels():
    """Returns the picture of the legend."""
    left, bottom, width, height = map(int, legend.box(region("WINDOW")))
    x, y = on_screen(region("WINDOW"), left, region("WINDOW").height - bottom - height)
    return pixels()[y : y + height, x : x + width]


def test_the_settings_of_the_colours_are_clicked():
    usual = view()[0].width, view()[0].height
    said, stop = labels_of_the_legend()
    try:
        light()
        yield from reset(ramp)
        with unfolded(panels.TOLVOL_PT_show_deviation):
            yield from open_tab()
            yield from settings_clicked(said, 1)
        yield from resize(1280, 1024)
        bpy.context.preferences.view.ui_scale = 2
        yield from reset(ramp)
        with unfolded(panels.TOLVOL_PT_show_deviation):
            yield from open_tab()
            # Only so does the legend have room.
            view()[1].spaces[0].show_region_toolbar = False
            yield from drag_sidebar(80)
            yield from settings_clicked(said, 2)
            yield from drag_sidebar(-80)
    finally:
        stop()
        view()[1].spaces[0].show_region_toolbar = True
        bpy.context.preferences.view.ui_scale = 1
        dark()
    yield from resize(*usual)
    space = view()[1].spaces[0]
    space.region_3d.view_perspective = "PERSP"
    space.show_gizmo = space.overlay.show_cursor = space.overlay.show_object_origins = True


def settings_clicked(said, scale):
    """Clicks surface, range, palette and bands in the sidebar, and looks what the legend becomes each time."""
    settings, place = the_ramp().tolvol, region("WINDOW")
    yield from finished(lambda: legend.box(place) is not None)
    yield from scroll_down()  # At the edge of the sidebar a click does not reach a button that is cut off.
    for kind, across, heading in (
        ("REFERENCE", 0.7, "Deviation of the reference of ramp"),
        ("MESH", 0.25, "Deviation of ramp"),
    ):
        said.clear()
        yield from click_property("deviation_surface", across)
        yield from finished(lambda kind=kind: settings.deviation_surface == kind)
        yield from finished(lambda heading=heading: heading in said)
    yield from finished(lambda: "+10 cm" in said and any(text.endswith(" %") for text in said))
    said.clear()
    yield from choose("deviation_range", "f")  # Fixed
    yield from finished(lambda: settings.deviation_range == "FIXED" and "+1 cm" in said)
    xdotool("mousemove", *on_screen(place, 120, 300))
    before = yield from still(bar_pixels)
    screenshot(f"legend 12 range clicked at {scale}")
    yield from choose("deviation_palette", "g")  # Green to Red
    yield from finished(lambda: settings.deviation_palette != "SAFE")
    xdotool("mousemove", *on_screen(place, 120, 300))
    after = yield from still(bar_pixels)
    assert after.shape == before.shape and (after != before).any(2).sum() > 1000 * scale**2
    said.clear()
    yield from scroll_down()  # The limit has pushed the bands to the edge.
    yield from click_property("use_bands", across=0.4)
    yield from finished(lambda: settings.use_bands)
    xdotool("mousemove", *on_screen(place, 120, 300))
    said.clear()
    view()[1].tag_redraw()
    yield from finished(lambda: sum(text.endswith(" %") for text in said) == 10)
    yield from still(bar_pixels)
    screenshot(f"legend 13 bands clicked at {scale}")


def drag_legend(place, across, up):
    """Drags the legend of a region by so many pixels."""
    first = legend.box(place)
    grip = on_screen(place, int(first[0]) + 20, place.height - int(first[1]) - 20)
    # Blender has to see the mouse over the legend before the button goes down.
    for by in (0, 1):
        yield from sent("mousemove", grip[0] + by, grip[1])
    xdotool("mousedown", 1)
    for step in range(5):
        yield
        xdotool("mousemove", grip[0] + 1 + across * step // 4, grip[1] - up * step // 4)
    yield
    xdotool("mouseup", 1)
    yield from finished(lambda: abs(legend.box(place)[0] - first[0] - across) < 10)
    assert abs(legend.box(place)[1] - first[1] - up) < 10


def test_each_view_has_its_own_place_for_the_legend():
    yield from reset(ramp)
    window, area = view()
    area.spaces[0].show_region_ui, area.spaces[0].show_gizmo = False, True
    with bpy.context.temp_override(window=window, area=area, region=region("WINDOW")):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    areas = [area for area in window.screen.areas if area.type == "VIEW_3D"]
    one, other = (next(region for region in area.regions if region.type == "WINDOW") for area in areas)
    try:
        yield from finished(lambda: legend.box(one) is not None and legend.box(other) is not None)
        yield
        before = legend.box(one), legend.box(other)
        yield from drag_legend(other, -100, 160)
        assert legend.box(one) == before[0]
        moved = legend.box(other)
        yield from drag_legend(one, -50, 80)
        screenshot("legend 11 two views")
        assert legend.box(other) == moved
        legend.forget_moved()
        for part in areas:
            part.tag_redraw()
        yield from finished(lambda: (legend.box(one), legend.box(other)) == before)
    finally:
        legend.forget_moved()
        with bpy.context.temp_override(window=window, area=areas[1], region=areas[1].regions[0]):
            bpy.ops.screen.area_close()
        yield from finished(lambda: hasattr(bpy.context, "object"))
    view()[1].spaces[0].region_3d.view_perspective = "PERSP"
    view()[1].spaces[0].overlay.show_cursor = view()[1].spaces[0].overlay.show_object_origins = True


def test_the_legend_is_dragged_and_is_one_for_selected_objects():
    yield from reset(ramp)
    said, stop = labels_of_the_legend()
    try:
        xdotool("mousemove", *on_screen(region("WINDOW"), 120, 600))
        view()[1].spaces[0].show_gizmo = True
        place = region("WINDOW")
        yield from finished(lambda: "Outside" in said and legend.box(place) is not None)
        yield from drag_legend(place, -200, 160)
        screenshot("legend 9 dragged")
        # It stays in the view, and each view has its own place for it.
        with window_context():
            legend.move(bpy.context, -500, 5000)
        view()[1].tag_redraw()
        yield from finished(lambda: 0 < legend.box(place)[0] < 100)
        assert legend.box(place)[1] + legend.box(place)[3] < place.height
        legend.forget_moved()
        # The legend of several selected objects is one, with the largest of their ranges.
        other = the_ramp().copy()
        other.data, other.location.x = the_ramp().data.copy(), 2.5
        bpy.context.collection.objects.link(other)
        other.tolvol.tolerance_length = 0.3
        other.select_set(True)
        said.clear()
        yield from finished(lambda: "Deviation of 2 objects" in said and "+30 cm" in said)
        yield from finished(lambda: any(text.endswith(" %") for text in said))
        yield from at_rest()
        screenshot("legend 10 two objects")
        other.select_set(False)
        said.clear()
        view()[1].tag_redraw()
        yield from finished(lambda: "Deviation of ramp" in said and "+10 cm" in said)
    finally:
        stop()
    view()[1].spaces[0].region_3d.view_perspective = "PERSP"
    view()[1].spaces[0].overlay.show_cursor = view()[1].spaces[0].overlay.show_object_origins = True


def test_statistics_are_unfolded_and_measured():
    yield from reset(ramp)
    with unfolded(panels.TOLVOL_PT_statistics):
        yield from open_tab()
        yield from press("tolvol.measure_statistics", across=0.4)
        yield from finished(lambda: statistics.of(the_ramp()))
        for width in (60, -60):
            yield from scroll_down()
            xdotool("mousemove", *on_screen(region("WINDOW"), 300, 300))
            yield from at_rest()
            screenshot(f"legend 8 statistics {width}")
            yield from drag_sidebar(width)
    assert statistics.of(the_ramp())["forward"]["mean"] > 0.02
