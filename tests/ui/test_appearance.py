# SPDX-License-Identifier: GPL-3.0-or-later
"""The look of the reference by mouse and keyboard: its normals, a normal map, one undo step each, and Esc."""

import contextlib
import time

import bpy

from addon import job, panels
from addon.appearance import normals, other_blender
from addon.proof import verdict
from panels_open import unfolded
from test_panel import monkey, suzanne
from window import centre, finished, key, on_screen, open_tab, press, region, reset, screenshot, scroll, xdotool


def aside():
    xdotool("mousemove", *on_screen(region("WINDOW"), 300, 100))


@contextlib.contextmanager
def slow_other_blender():
    """Has large and small references read by another Blender, which begins only after some seconds: a test that looks at
    the job meanwhile must not depend on how fast the machine is."""
    at_once, command = normals._AT_ONCE, other_blender.command
    normals._AT_ONCE = 0
    other_blender.command = lambda *given: ["sh", "-c", 'sleep 4; exec "$@"', "sh", *command(*given)]
    try:
        yield
    finally:
        normals._AT_ONCE, other_blender.command = at_once, command


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
    with unfolded(panels.TOLVOL_PT_appearance):
        yield 0.5
        yield from press("tolvol.shade_by_reference")
        yield from finished(lambda: suzanne().data.has_custom_normals)
        aside()
        yield 1.0
        screenshot("look 1 shaded")
        assert verdict.word(suzanne()) == verdict.PASS
        xdotool("mousemove", *centre())
        yield
        key("ctrl+z")
        yield from finished(lambda: not suzanne().data.has_custom_normals)
        # As with a large reference, another Blender reads the normals, and Esc ends it.
        with slow_other_blender():
            yield from press("tolvol.shade_by_reference")
            yield from finished(job.under_way, pause=0.05)
            yield 0.3
            screenshot("look 2 reading")
            xdotool("mousemove", *centre())
            key("Escape")
            yield from finished(lambda: not job.under_way(), pause=0.05)
            assert not suzanne().data.has_custom_normals
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
        yield from scroll(4)
        aside()
        yield 0.5
        screenshot("look 2 baking")
        yield from finished(lambda: not job.under_way())
        yield 1.0
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
        suzanne().tolvol.bake.image_size = 8192
        yield from press("tolvol.bake_normals")
        yield from finished(job.under_way)
        yield 2.0
        xdotool("mousemove", *centre())
        key("Escape")
        began = time.monotonic()
        yield from finished(lambda: not job.under_way(), pause=0.05)
        assert time.monotonic() - began < 2
        assert not suzanne().data.has_custom_normals and "Suzanne normals" not in bpy.data.images
