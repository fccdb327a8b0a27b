# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user does while the result of a decimation is put into the mesh, which is done in parts."""

import contextlib

import bpy
import numpy as np

import job_time
import scenes
from addon import job
from addon.mesh import mesh_io, transfer
from addon.proof import verdict
from test_panel import assert_proved, monkey, stored, suzanne
from window import (
    at_rest,
    centre,
    finished,
    key,
    open_tab,
    press,
    reset,
    screenshot,
    status_texts,
    view,
    window_context,
    xdotool,
)

released = []


@contextlib.contextmanager
def paused():
    """While the context lasts, a decimation that has read the mesh to write it waits until `released` has an item."""
    original = transfer.Writing.prepare

    def prepare(self):
        yield from original(self)
        while not released:
            yield

    released.clear()
    transfer.Writing.prepare = prepare
    try:
        with job_time.in_background():
            yield
    finally:
        transfer.Writing.prepare = original
        released.append(True)


def begin(said):
    yield from open_tab()
    yield from press("tolvol.decimate")
    yield from finished(lambda: any(text.startswith("Writing") for text in said))


def rotation():
    return tuple(view()[1].spaces[0].region_3d.view_rotation)


def smooth_faces():
    return np.count_nonzero(mesh_io.column(suzanne().data.polygons, "use_smooth", 1, bool))


def test_the_view_is_turned_and_the_mesh_shaded_while_the_result_is_written():
    yield from reset(monkey)
    reference, said, before = scenes.world_triangles(suzanne()), status_texts(), rotation()
    with paused():
        yield from begin(said)
        screenshot("writing 1")
        xdotool("mousemove", *centre())
        yield
        key("KP_4")
        yield from finished(lambda: rotation() != before)
        assert smooth_faces() == 0
        with window_context():
            bpy.ops.object.shade_smooth()
        yield
        assert job.under_way()
        released.append(True)
        yield from finished(lambda: not job.under_way())
    yield from at_rest()
    count = len(suzanne().data.polygons)
    assert count < 3000 and smooth_faces() == count
    assert verdict.word(suzanne()) == verdict.PASS
    assert_proved(suzanne(), reference, 0.2)


def test_escape_while_the_result_is_written_changes_nothing():
    yield from reset(monkey)
    before, said = stored(), status_texts()
    with paused():
        yield from begin(said)
        key("Escape")
        yield from finished(lambda: not job.under_way())
    assert stored() == before and suzanne().tolvol.snapshot is None


def test_a_mesh_that_is_moved_while_the_result_is_written_stays():
    yield from reset(monkey)
    said = status_texts()
    with paused():
        yield from begin(said)
        # By a script, so that Blender does not tell of it.
        suzanne().data.vertices.foreach_set("co", 2 * mesh_io.column(suzanne().data.vertices, "co", 3).ravel())
        moved = stored()
        released.append(True)
        yield from finished(lambda: not job.under_way())
    assert stored() == moved and suzanne().tolvol.snapshot is None
