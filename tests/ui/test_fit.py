# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitting a modifier in a window: Blender evaluates the modifier between the jobs, and Esc leaves the object as it was."""

import bpy

import job_time
import scenes
from addon.proof import kept_warnings
from test_panel import assert_proved, large_monkey, stored, suzanne
from window import at_rest, centre, finished, key, reset, screenshot, status_texts, view, xdotool


def fit(ob, kind="DECIMATE"):
    ob.modifiers.new(kind.title(), kind)
    bpy.ops.ed.undo_push(message="modifier")
    with bpy.context.temp_override(window=view()[0], area=view()[1]), job_time.in_background():
        assert bpy.ops.tolvol.fit_modifier("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def test_escape_while_a_modifier_is_fitted_changes_nothing():
    yield from reset(large_monkey)
    before = stored()
    said = status_texts()
    fit(suzanne())
    yield from finished(lambda: said and said[-1].startswith("Fitting Decimate: Ratio"), pause=0.02)
    screenshot("10 fitting")
    xdotool("key", "Escape", "Escape")  # The first one keeps the best so far if there is one.
    yield from finished(lambda: len(bpy.data.scenes) == 1)
    assert said[0].startswith("Comparing with Decimate")
    assert stored() == before and suzanne().tolvol.snapshot is None
    assert [modifier.name for modifier in suzanne().modifiers] == ["Decimate"]
    assert len(bpy.data.objects) == 1


def test_escape_keeps_the_best_so_far():
    yield from reset(large_monkey)
    reference = scenes.world_triangles(suzanne())
    said = status_texts()
    fit(suzanne())
    yield from finished(lambda: said and "triangles, unproved    Esc: Keep Present Result" in said[-1], pause=0.02)
    key("Escape")
    yield from finished(lambda: not suzanne().modifiers)
    assert_proved(suzanne(), reference, 0.2)
    assert any(warning.startswith("The button Decimate leaves fewer") for warning in kept_warnings.of(suzanne())[0])


def test_escape_keeps_more_triangles_than_before_and_says_so():
    yield from reset(bpy.ops.mesh.primitive_cube_add)
    ob, said = bpy.data.objects["Cube"], status_texts()
    ob.tolvol.tolerance_percent = 1
    reference = scenes.world_triangles(ob)
    fit(ob, "REMESH")
    yield from finished(lambda: said and ", 12 before    Esc: Keep Present Result" in said[-1], pause=0.02)
    key("Escape")
    yield from finished(lambda: not ob.modifiers)
    left = len(scenes.world_triangles(ob)[1])
    more, fewer = kept_warnings.of(ob)[0]
    assert more.startswith(f"Remesh leaves {left:,} triangles, more than the 12 that there were: ")
    assert fewer.startswith("The button Decimate leaves fewer triangles within this tolerance: 12, ")
    assert_proved(ob, reference, 1)


def test_fitted_in_a_window_and_undone_by_one_ctrl_z():
    yield from reset(scenes.torus)
    ob = bpy.data.objects["torus"]
    reference = scenes.world_triangles(ob)
    fit(ob)
    yield from finished(lambda: not bpy.data.objects["torus"].modifiers)
    yield
    ob = bpy.data.objects["torus"]
    assert len(ob.data.polygons) < 500
    assert_proved(ob, reference, 1)
    screenshot("11 fitted")
    xdotool("mousemove", *centre())
    yield
    key("ctrl+z")
    yield from at_rest()
    ob = bpy.data.objects["torus"]
    assert len(ob.data.polygons) == 1152 and len(ob.modifiers) == 1 and ob.tolvol.snapshot is None
