# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel as a user operates it."""

import json

import bpy
import numpy as np

import job_time
import scenes
from addon import native, reference
from addon.mesh import mesh_io
from addon.overlay import legend
from addon.panels import deviation, notes
from addon.proof import verdict
from addon.reference import measurements, tolerances
from window import (
    at_rest,
    centre,
    click,
    find,
    find_property,
    finished,
    fold_adjust,
    key,
    on_screen,
    open_tab,
    pixels,
    press,
    region,
    reset,
    screenshot,
    status_texts,
    still,
    unfold_adjust,
    view,
    window_context,
    xdotool,
)

TRIANGLES = 15744  # of the monkey


def monkey(levels=2):
    bpy.ops.mesh.primitive_monkey_add()
    ob = bpy.context.object
    ob.modifiers.new("subdivision", "SUBSURF").levels = levels
    with bpy.context.temp_override(window=view()[0], area=view()[1], object=ob):
        bpy.ops.object.modifier_apply(modifier="subdivision")


def large_monkey():
    """Makes a monkey of four times as many triangles, for jobs that have to last."""
    monkey(3)


def suzanne():
    return bpy.data.objects["Suzanne"]


def stored():
    arrays = mesh_io.read_mesh(suzanne().data)
    return arrays.vertices.tobytes(), arrays.triangles.tobytes()


def assert_proved(ob, reference, percent):
    now = scenes.world_triangles(ob)
    tolerance = percent / 100 * native.module.diagonal(*reference)
    for pair in ((now, reference), (reference, now)):
        assert native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance).upper <= tolerance
    scenes.assert_within(now, reference, tolerance)


def test_decimate_by_mouse_and_undo_by_one_ctrl_z():
    yield from reset(monkey)
    yield from open_tab()
    screenshot("1 first sight")
    reference, before = scenes.world_triangles(suzanne()), stored()
    yield from press("tolvol.decimate")
    yield from finished(lambda: len(suzanne().data.polygons) < 3000)
    yield from at_rest()
    screenshot("2 decimated")
    assert len(reference[1]) == TRIANGLES and suzanne().tolvol.snapshot is not None
    assert suzanne().tolvol.tolerance_percent == np.float32(0.2)
    assert_proved(suzanne(), reference, 0.2)
    after = stored()
    xdotool("mousemove", *centre())
    yield
    key("ctrl+z")
    yield from at_rest()
    assert stored() == before and suzanne().tolvol.snapshot is None
    screenshot("3 undone")
    key("ctrl+shift+z")
    yield from at_rest()
    assert stored() == after and suzanne().tolvol.snapshot is not None


def test_tolerance_from_the_presets_and_decimation_by_menu_search():
    yield from reset(scenes.torus)
    yield from open_tab()
    ob, reference = bpy.data.objects["torus"], scenes.world_triangles(bpy.data.objects["torus"])
    _, y = yield from find_property("tolerance_percent", 0.6)
    sidebar = region("UI")
    x, _ = on_screen(sidebar, sidebar.width - 47, 0)  # the menu beside the tolerance
    xdotool("mousemove", *centre())
    yield
    yield from click(x, y)
    yield from at_rest()
    screenshot("presets")
    for _ in range(7):  # the last of the presets
        key("Down")
        yield
    key("Return")
    yield from finished(lambda: ob.tolvol.tolerance_mode == "LENGTH")
    assert tolerances.tolerance_length(ob.tolvol, 1) == 0.05
    xdotool("mousemove", *centre())
    yield
    key("F3")
    yield
    xdotool("type", "decimate in tol")
    yield
    screenshot("menu search")
    key("Return")
    yield from finished(lambda: len(ob.data.polygons) < 500)
    assert_proved(ob, reference, 5 / native.module.diagonal(*reference))


def test_adjust_last_operation():
    yield from reset(monkey)
    yield from open_tab()
    reference = scenes.world_triangles(suzanne())
    yield from press("tolvol.decimate")
    yield from finished(lambda: len(suzanne().data.polygons) < 3000)
    yield from at_rest()
    first = len(suzanne().data.polygons)
    yield from unfold_adjust()
    yield from at_rest()
    hud = region("HUD")
    xdotool("mousemove", *on_screen(hud, hud.width * 2 // 3, 50))
    yield from at_rest()
    # Return over a field starts typing. A double click would do so too, but a busy machine may take it for two clicks.
    key("Return")
    yield from at_rest()
    xdotool("key", "ctrl+a", "type", "3")
    key("Return")
    yield from finished(lambda: len(suzanne().data.polygons) < first)
    yield from at_rest()
    screenshot("4 adjusted")
    assert suzanne().tolvol.tolerance_percent == 3
    # The reference is the first mesh and not the first result.
    assert len(suzanne().tolvol.snapshot.polygons) == TRIANGLES
    assert_proved(suzanne(), reference, 3)
    yield from fold_adjust()
    key("ctrl+z")
    yield from at_rest()
    assert len(scenes.world_triangles(suzanne())[1]) == TRIANGLES


def test_escape_leaves_everything_as_it_was():
    yield from reset(monkey)
    yield from open_tab()
    with bpy.context.temp_override(window=view()[0], area=view()[1], object=suzanne()):
        suzanne().modifiers.new("more", "SUBSURF").levels = 1  # The decimation becomes slow enough to be stopped.
        bpy.ops.object.modifier_apply(modifier="more")
    yield
    before = stored()
    said = status_texts()
    yield from press("tolvol.decimate")
    yield from finished(lambda: any("triangles left" in text for text in said))
    screenshot("5 busy")
    drawn, draw_verdict = [], deviation._draw_verdict
    deviation._draw_verdict = lambda *about: drawn.append(about) or draw_verdict(*about)
    try:
        key("Escape")
        yield from finished(lambda: drawn)  # without a move of the mouse
        yield from at_rest()
    finally:
        deviation._draw_verdict = draw_verdict
    assert any(text.startswith("Decimating") and text.endswith("Esc: Cancel") for text in said)
    count = len(said)
    yield from at_rest()
    assert len(said) == count  # No job goes on.
    assert stored() == before and suzanne().tolvol.snapshot is None and not suzanne().tolvol.last_run
    screenshot("6 stopped")


def test_escape_keeps_what_refining_has_reached():
    yield from reset(monkey)
    yield from open_tab()
    suzanne().tolvol.tolerance_percent, suzanne().tolvol.effort = 0.3, "THOROUGH"
    suzanne().tolvol.placement = "OPTIMAL"  # This placement has more to refine.
    reference = scenes.world_triangles(suzanne())
    said = status_texts()
    yield from press("tolvol.decimate")
    yield from finished(lambda: any(text.startswith("Refining") for text in said))
    screenshot("refining")
    key("Escape")
    yield from finished(lambda: suzanne().tolvol.last_run)
    assert any(text.startswith("Refining") and text.endswith("Esc: Keep Present Result") for text in said)
    run = json.loads(suzanne().tolvol.last_run)
    assert run["stopped_by"] == "request" and run["output"]["triangles"] == len(suzanne().data.polygons) < 1500
    assert_proved(suzanne(), reference, 0.3)


def test_reference_check_and_select_outside():
    yield from reset(monkey)
    yield from open_tab()
    yield from press("tolvol.set_reference")
    yield from finished(lambda: suzanne().tolvol.snapshot is not None)
    screenshot("7 reference")
    co = mesh_io.column(suzanne().data.vertices, "co", 3)
    lifted = co[:, 2] > 0.9
    co[lifted, 2] += np.float32(0.1)
    suzanne().data.vertices.foreach_set("co", co.ravel())
    suzanne().data.update()
    yield
    yield from press("tolvol.check")
    yield from finished(lambda: measurements.measurement_of(suzanne()) is not None)
    yield from at_rest()
    screenshot("8 checked")
    # The word of the legend is the one of the panel.
    words, draw = [], legend.draw
    legend.draw = lambda context, heading, note, word, *rest: (
        words.append(word) or draw(context, heading, note, word, *rest)
    )
    view()[1].tag_redraw()
    yield from finished(lambda: words)
    assert words[-1] == verdict.word(suzanne()) == verdict.FAIL
    suzanne().tolvol.tolerance_percent = 20
    yield from finished(lambda: words[-1] == verdict.word(suzanne()) == verdict.PASS)  # at once, without the mouse
    screenshot("8 checked and passed")
    suzanne().tolvol.tolerance_percent = 0.5
    yield from finished(lambda: words[-1] == verdict.FAIL)
    legend.draw = draw
    measured = suzanne().tolvol.measurement
    assert (
        not verdict.of(suzanne()).forward_within and 0.05 < measured.forward < 0.2 and 0 < measured.share_outside < 0.2
    )
    yield from press("tolvol.select_outside", across=0.7)
    yield from finished(lambda: suzanne().mode == "EDIT")
    yield
    screenshot("9 outside selected")
    assert (yield from find("tolvol.check")) is not None  # greyed
    screenshot("10 edit mode")
    with bpy.context.temp_override(window=view()[0], area=view()[1]):
        bpy.ops.object.mode_set(mode="OBJECT")
    chosen = mesh_io.column(suzanne().data.polygons, "select", 1, bool)
    assert 0 < chosen.sum() < len(chosen) / 4


def test_what_is_in_the_way_is_said():
    yield from reset(monkey)
    yield from open_tab()
    yield from press("tolvol.set_reference")
    suzanne().tolvol.reference_kind = "OBJECT"
    yield
    screenshot("11 another reference")
    before = stored()
    yield from press("tolvol.decimate")  # greyed
    yield from at_rest()
    assert stored() == before
    xdotool("mousemove", *centre())
    suzanne().tolvol.reference_kind = "SELF"
    suzanne().modifiers.new("on top", "WAVE")
    twin = suzanne().copy()
    bpy.context.collection.objects.link(twin)
    yield
    view()[1].tag_redraw()
    yield
    screenshot("12 two users")
    bpy.data.objects.remove(twin)
    # A running count would need the module, which is never removed while Blender runs.
    suzanne().tolvol.show_deviation = False
    found = native.module
    native.module, native.reason = None, "The package tolvol is missing: install the add-on's zip"
    view()[1].tag_redraw()
    yield
    screenshot("13 no module")
    native.module, native.reason = found, None
    view()[1].tag_redraw()
    yield


def test_a_damaged_file_breaks_no_panel():
    yield from reset(monkey)
    yield from open_tab()
    yield from press("tolvol.decimate")
    yield from finished(lambda: suzanne().tolvol.last_run)
    yield from at_rest()
    said, text_lines = [], notes.text_lines
    notes.text_lines = lambda context, layout, text, icon: said.append(text) or text_lines(context, layout, text, icon)
    try:
        suzanne().tolvol.last_run = suzanne().tolvol.last_run[:100]
        suzanne().tolvol.measurement.forward = float("nan")
        measurements.forget_kept()
        view()[1].tag_redraw()
        yield from finished(lambda: any("damaged" in text for text in said))
        suzanne().tolvol.snapshot.clear_geometry()
        reference.forget_all()
        view()[1].tag_redraw()
        yield from at_rest()
        screenshot("damaged")
    finally:
        notes.text_lines = text_lines


def sidebar_pixels():
    place = region("UI")
    x, y = on_screen(place, 0, 0)
    return pixels()[y : y + place.height, x : x + place.width]


def test_the_answer_of_check_is_seen_without_moving_the_mouse():
    yield from reset(scenes.torus)
    yield from open_tab()
    ob = bpy.data.objects["torus"]
    yield from press("tolvol.set_reference")
    yield from finished(lambda: ob.tolvol.snapshot is not None)
    ob.data.vertices[0].co.z += 0.001
    ob.data.update()
    xdotool("mousemove", *centre())
    yield
    before = yield from still(sidebar_pixels, beside=())  # The sidebar shows the estimate.
    assert verdict.of(ob) is None
    with window_context(), job_time.in_background():
        bpy.ops.tolvol.check("INVOKE_DEFAULT")
    yield from finished(lambda: verdict.of(ob) is not None)
    yield from finished(lambda: (sidebar_pixels() != before).any())
    seen = yield from still(sidebar_pixels, beside=())
    screenshot("14 checked without the mouse")
    view()[1].tag_redraw()
    yield from at_rest()
    assert (seen == (yield from still(sidebar_pixels, beside=()))).all()


def test_what_replaces_the_original_asks():
    yield from reset(scenes.torus)
    yield from open_tab()
    ob = bpy.data.objects["torus"]
    yield from press("tolvol.decimate")
    yield from finished(lambda: len(ob.data.polygons) < 500)
    original = ob.tolvol.snapshot_fingerprint
    ob.scale = (1.5, 1.5, 1.5)
    yield
    assert len(ob.tolvol.snapshot.polygons) == 2304
    screenshot("15 scaled")
    yield from press("tolvol.set_reference")
    yield from at_rest()
    screenshot("16 asked")
    assert ob.tolvol.snapshot_fingerprint == original
    xdotool("mousemove", *centre())
    yield
    key("Escape")
    yield
    assert ob.tolvol.snapshot_fingerprint == original
    yield from press("tolvol.set_reference")
    yield
    key("Down")
    key("Return")
    yield from finished(lambda: ob.tolvol.snapshot_fingerprint != original)
    assert ob.tolvol.snapshot_fingerprint == mesh_io.read_mesh(ob.data).fingerprint()
    key("ctrl+z")
    yield from finished(lambda: bpy.data.objects["torus"].tolvol.snapshot_fingerprint == original)


def test_a_length_typed_in_millimetres():
    yield from reset(scenes.torus)
    units = bpy.context.scene.unit_settings
    units.scale_length, units.length_unit = 0.001, "MILLIMETERS"
    ob = bpy.data.objects["torus"]
    ob.tolvol.tolerance_mode = "LENGTH"
    yield from open_tab()
    place = yield from find_property("tolerance_length", 0.6)
    xdotool("mousemove", *place)
    yield
    key("Return")
    yield
    xdotool("key", "ctrl+a", "type", "0.5mm")
    key("Return")
    yield from finished(lambda: abs(ob.tolvol.tolerance_length - 0.5) < 1e-3)
    yield
    screenshot("17 typed")
    assert tolerances.tolerance_length(ob.tolvol, 1) == 0.5, ob.tolvol.tolerance_length
    units.scale_length, units.length_unit = 1.0, "METERS"


def test_a_pixel_of_dragging_changes_the_tolerance_by_little():
    yield from reset(monkey)
    yield from open_tab()
    settings = suzanne().tolvol
    for mode, name, start, most in (
        ("LENGTH", "tolerance_length", 0.005, 0.001),
        ("PERCENT", "tolerance_percent", 0.2, 0.03),
    ):
        settings.tolerance_mode = mode
        setattr(settings, name, start)
        yield from at_rest()
        x, y = yield from find_property(name, 0.6)
        xdotool("mousemove", x, y)
        yield
        xdotool("mousedown", 1)
        yield
        for pixel in range(1, 25):
            xdotool("mousemove", x + pixel, y)
            yield
        xdotool("mouseup", 1)
        yield from at_rest()
        assert start < getattr(settings, name) <= start + 24.01 * most


def test_the_lines_of_an_error_have_room_in_blenders_popup():
    yield from reset(scenes.moved_up)
    ob = bpy.context.object
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    said = ""
    try:
        bpy.ops.tolvol.decimate()
    except RuntimeError as error:
        said = str(error).removeprefix("Error: ")
    lines = said.splitlines()
    assert len(lines) == 3 and all(len(line) <= 101 for line in lines)
    # The status bar shows them as one.
    assert "Select Outside shows these faces" in "".join(lines)
