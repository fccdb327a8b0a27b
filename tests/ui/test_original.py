# SPDX-License-Identifier: GPL-3.0-or-later
"""The original is shown while a key or a button is held, and comes back after a question."""

import tempfile

import bpy
import numpy as np

import scenes
from addon.mesh import mesh_io
from addon.operators import decimate, original
from window import (
    WIDE,
    at_rest,
    centre,
    finished,
    key,
    move_onto_hold,
    on_screen,
    open_tab,
    pixels,
    press,
    region,
    reset,
    screenshot,
    scroll,
    still,
    view,
    window_context,
    xdotool,
)

WIDTH = WIDE  # A large part of the view is compared.


def torus():
    return bpy.data.objects["torus"]


def decimated():
    yield from reset(scenes.torus)
    yield from open_tab()
    torus().tolvol.tolerance_percent = 4
    torus().tolvol.show_deviation = False
    view()[1].spaces[0].region_3d.view_distance = 5
    yield from press("tolvol.decimate")
    yield from finished(lambda: len(torus().data.polygons) < 300)
    yield from at_rest()  # The original cannot be shown while the job ends.


def view_pixels():
    place = region("WINDOW")
    x, y = on_screen(place, 250, 150)
    return pixels()[y : y + place.height - 200, x : x + 400]


def test_the_original_is_shown_while_its_key_is_held_in_object_and_sculpt_mode():
    yield from decimated()
    for mode in ("OBJECT", "SCULPT"):
        with window_context():
            bpy.ops.object.mode_set(mode=mode)
        if mode == "SCULPT":  # The outline of the brush would be another difference.
            torus().data.update()
        xdotool("mousemove", *on_screen(region("WINDOW"), 200, 600))
        before = yield from still(view_pixels)
        count, objects, meshes = len(torus().data.polygons), set(bpy.data.objects), set(bpy.data.meshes)
        xdotool("keydown", "y")
        yield from finished(original.shown)
        shown = yield from still(view_pixels)
        screenshot(f"original shown in {mode.lower()} mode")
        assert (np.abs(shown - before).max(2) > 20).mean() > 0.02
        assert torus().hide_get() and torus().mode == mode
        xdotool("keyup", "y")
        yield from finished(lambda: not original.shown())
        after = yield from still(view_pixels)
        assert (np.abs(after - before).max(2) > 20).mean() < 0.001
        assert not torus().hide_get() and torus().select_get() and torus().mode == mode
        assert len(torus().data.polygons) == count and set(bpy.data.meshes) == meshes
        assert set(bpy.data.objects) == objects
    with window_context():
        bpy.ops.object.mode_set(mode="OBJECT")


def test_the_button_of_decimate_counts_the_same_objects_while_the_original_is_shown():
    yield from decimated()
    other = scenes.torus("other")
    scenes.activate(torus())
    for selected, count in ((False, 1), (True, 2)):
        other.select_set(selected)
        xdotool("mousemove", *on_screen(region("WINDOW"), 200, 600))
        yield
        xdotool("keydown", "y")
        yield from finished(original.shown)
        yield from at_rest()
        screenshot(f"original shown beside {count - 1} other objects")
        with window_context():
            targets = decimate.targets(bpy.context)
        assert targets == [torus(), other][:count]
        xdotool("keyup", "y")
        yield from finished(lambda: not original.shown())


def test_the_original_is_shown_while_its_button_is_held_and_asks_before_it_comes_back():
    yield from decimated()
    count = len(torus().data.polygons)
    yield from move_onto_hold()
    xdotool("mousedown", 1)
    yield from finished(original.shown)
    yield from at_rest()
    screenshot("original button held")
    assert torus().hide_get()
    xdotool("mouseup", 1)
    yield from finished(lambda: not original.shown())
    yield
    assert not torus().hide_get() and torus().select_get()
    # Holding it was no step: one Ctrl Z undoes the decimation.
    yield from press("tolvol.restore_original", across=0.69)
    yield from at_rest()
    screenshot("restore asks")
    assert len(torus().data.polygons) == count
    key("Escape")
    yield
    assert len(torus().data.polygons) == count
    yield from press("tolvol.restore_original", across=0.69)
    yield
    key("Down")
    key("Return")
    yield from finished(lambda: len(torus().data.polygons) == 48 * 24)
    screenshot("restored")
    yield from scroll()
    assert mesh_io.read_mesh(torus().data).fingerprint() == torus().tolvol.snapshot_fingerprint
    xdotool("mousemove", *centre())
    yield
    key("ctrl+z")
    yield from finished(lambda: len(torus().data.polygons) == count)
    key("ctrl+z")
    yield from finished(lambda: torus().tolvol.snapshot is None)
    assert len(torus().data.polygons) == 48 * 24


def test_append_leaves_no_objects_of_references():
    yield from decimated()
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/torus.blend"
        with window_context():
            bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
            bpy.data.objects.remove(torus())
            bpy.ops.wm.append(filepath=f"{path}/Object/torus", directory=f"{path}/Object/", filename="torus")
            assert len(bpy.data.objects) > 2
        yield from finished(lambda: len([ob for ob in bpy.data.objects if ob.type == "MESH"]) == 1)
    yield
    assert torus().tolvol.snapshot and torus().tolvol.original
