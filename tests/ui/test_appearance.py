# SPDX-License-Identifier: GPL-3.0-or-later
"""The look of the reference by mouse and keyboard: its normals, a normal map, one undo step each, and Esc."""

import contextlib
import subprocess
from unittest import mock

import bpy

from addon import job, panels
from addon.appearance import normals, other_blender
from addon.proof import verdict
from panels_open import alone
from test_panel import monkey, suzanne
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
    xdotool,
)


def aside():
    xdotool("mousemove", *on_screen(region("WINDOW"), 300, 100))


@contextlib.contextmanager
def unending_other_blender():
    """Has a process that never ends take the place of the other Blender. Gives a list of those that were started."""
    command, start, started = other_blender.command, subprocess.Popen, []
    other_blender.command = lambda *_: ["sleep", "infinity"]
    subprocess.Popen = lambda *a, **options: started.append(start(*a, **options)) or started[-1]
    try:
        yield started
    finally:
        other_blender.command, subprocess.Popen = command, start


def ended_by_escape(operator, picture):
    """Presses the button of an operator that has another Blender work, and Esc, which ends it with nothing changed."""
    with unending_other_blender() as started:
        yield from press(operator)
        yield from finished(lambda: started)
        yield
        screenshot(picture)
        assert job.under_way()
        xdotool("mousemove", *centre())
        yield
        key("Escape")
        yield from finished(lambda: not job.under_way())
        assert started[0].poll() is not None
    assert not suzanne().data.has_custom_normals


def test_normals_and_a_normal_map_by_mouse():
    yield from reset(monkey)
    ob = suzanne()
    ob.tolvol.tolerance_percent = 1
    ob.tolvol.bake.image_size = 512
    ob.tolvol.show_deviation = False
    ob.data.polygons.foreach_set("use_smooth", [False] * len(ob.data.polygons))
    yield from open_tab()
    yield from press("tolvol.decimate")
    yield from finished(lambda: verdict.word(suzanne()) == verdict.PASS)
    with alone(panels.TOLVOL_PT_appearance):
        yield
        yield from press("tolvol.shade_by_reference")
        yield from finished(lambda: suzanne().data.has_custom_normals)
        aside()
        yield from at_rest()
        screenshot("look 1 shaded")
        assert verdict.word(suzanne()) == verdict.PASS
        xdotool("mousemove", *centre())
        yield
        key("ctrl+z")
        yield from finished(lambda: not suzanne().data.has_custom_normals)
        # As with a large reference, another Blender reads the normals, and Esc ends it.
        with mock.patch.object(normals, "_AT_ONCE", 0):
            yield from ended_by_escape("tolvol.shade_by_reference", "look 2 reading")
            yield from press("tolvol.shade_by_reference")
            yield from finished(lambda: suzanne().data.has_custom_normals)
            assert verdict.word(suzanne()) == verdict.PASS
            xdotool("mousemove", *centre())
            yield
            key("ctrl+z")
            yield from finished(lambda: not suzanne().data.has_custom_normals)
        engine, uvs = bpy.context.scene.render.engine, len(suzanne().data.uv_layers)
        yield from press("tolvol.bake_normals")
        yield from finished(job.under_way)
        aside()
        yield
        screenshot("look 2 baking")
        yield from finished(lambda: not job.under_way())
        yield from at_rest()
        screenshot("look 3 baked")
        image = bpy.data.images["Suzanne normals"]
        assert image.packed_file and tuple(image.size) == (512, 512)
        assert bpy.context.scene.render.engine == engine and len(suzanne().data.uv_layers) == uvs
        assert suzanne().data.has_custom_normals and len(bpy.data.scenes) == 1
        xdotool("mousemove", *centre())
        yield
        key("ctrl+z")
        yield from finished(lambda: not suzanne().data.has_custom_normals)
        assert "Suzanne normals" not in bpy.data.images and not suzanne().data.materials
        yield from ended_by_escape("tolvol.bake_normals", "look 4 baking")
        assert "Suzanne normals" not in bpy.data.images
