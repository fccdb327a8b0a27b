# SPDX-License-Identifier: GPL-3.0-or-later
"""LOD Chain by mouse and keyboard: the levels, one undo step, and Esc in the middle of a chain."""

import bpy

import job_time
import scenes
from addon import job, panels
from panels_open import unfolded
from test_panel import assert_proved, monkey, stored, suzanne
from test_writing import paused
from window import (
    at_rest,
    centre,
    finished,
    key,
    on_screen,
    open_tab,
    press,
    region,
    reset,
    screenshot,
    scroll_down,
    status_texts,
    xdotool,
)


def levels():
    return [ob.name for ob in bpy.data.objects if "_LOD" in ob.name]


def seen():
    return [ob.name for ob in bpy.context.view_layer.objects if ob.visible_get()]


def test_levels_by_mouse_and_one_ctrl_z():
    yield from reset(monkey)
    reference, before = scenes.world_triangles(suzanne()), stored()
    said = status_texts()
    with unfolded(panels.TOLVOL_PT_lod):
        yield from open_tab()
        with job_time.unending() as released:
            yield from press("tolvol.make_lods")
            yield from finished(lambda: any(text.startswith("Level 1 of 3: ") for text in said))
            released.append(True)
        yield from finished(lambda: len(levels()) == 3 and not job.under_way())
        yield from scroll_down()
        xdotool("mousemove", *on_screen(region("WINDOW"), 300, 300))
        yield from at_rest()
        screenshot("lod 1 made")
        assert seen() == ["Suzanne"]
        yield from press("tolvol.show_level(level=3)")
        yield from finished(lambda: seen() == ["Suzanne_LOD3"])
        xdotool("mousemove", *on_screen(region("WINDOW"), 300, 300))
        yield
        screenshot("lod 3 level shown")
        yield from press("tolvol.show_level(level=0)")
        yield from finished(lambda: seen() == ["Suzanne"])
    assert stored() == before
    for name, percent in zip(levels(), (0.1, 0.5, 2)):
        assert_proved(bpy.data.objects[name], reference, percent)
    xdotool("mousemove", *centre())
    yield
    for _ in range(2):  # Each choice of a level is an undo step.
        steps = seen()
        key("ctrl+z")
        yield from finished(lambda before=steps: seen() != before)
    key("ctrl+z")
    yield from finished(lambda: not levels())
    assert suzanne().tolvol.snapshot is None and not bpy.data.collections.get("Suzanne_LODs")


def test_escape_in_a_chain_leaves_nothing():
    yield from reset(monkey)
    meshes = len(bpy.data.meshes)
    suzanne().tolvol.effort = "THOROUGH"
    said = status_texts()
    with unfolded(panels.TOLVOL_PT_lod):
        yield from open_tab()
        with job_time.unending():
            yield from press("tolvol.make_lods")
            yield from finished(lambda: any(text.startswith("Level 1 of 3: ") for text in said))
            screenshot("lod 2 under way")
            for _ in range(2):  # The first Esc may keep the present result of a level.
                key("Escape")
            yield from finished(lambda: not job.under_way())
    assert not levels() and suzanne().tolvol.snapshot is None and len(bpy.data.meshes) == meshes


def test_escape_while_the_levels_are_written_leaves_nothing():
    yield from reset(monkey)
    meshes, before, said = len(bpy.data.meshes), stored(), status_texts()
    with unfolded(panels.TOLVOL_PT_lod), paused():
        yield from open_tab()
        yield from press("tolvol.make_lods")
        yield from finished(lambda: any(text.startswith("Writing") for text in said))
        key("Escape")
        yield from finished(lambda: not job.under_way())
    assert not levels() and suzanne().tolvol.snapshot is None and len(bpy.data.meshes) == meshes and stored() == before
