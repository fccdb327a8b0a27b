# SPDX-License-Identifier: GPL-3.0-or-later
"""Adjust Last Operation of an operation that goes on in the background: its panel stays, and there is one undo step."""

import bpy

import job_time
from addon import job
from test_job import adjust, decimated
from test_panel import TRIANGLES, assert_proved, monkey, suzanne
from window import (
    finished,
    fold_adjust,
    key,
    on_screen,
    open_tab,
    press,
    region,
    reset,
    screenshot,
    sent,
    unfold_adjust,
    window_context,
    xdotool,
)


def left():
    return len(suzanne().data.polygons)


def adjusted():
    """Returns the tolerance in the panel of the last operation."""
    return bpy.context.window_manager.operators[-1].tolerance_percent


def dragged(x, y):
    """Drags the tolerance in the panel of the last operation until it has grown, and waits there for the outcome."""
    before = adjusted()
    yield from sent("mousemove", x, y)
    xdotool("mousedown", 1)

    def moved():
        nonlocal x
        x += 2
        xdotool("mousemove", x, y)
        return adjusted() > before

    yield from finished(moved)
    yield from finished(lambda: not job.under_way())
    screenshot(f"adjust 1 at {adjusted():.1f} %")
    xdotool("mouseup", 1)
    yield from finished(lambda: not job.under_way() and suzanne().tolvol.tolerance_percent == adjusted())


def test_the_tolerance_is_dragged_again_and_again_in_the_panel_of_the_last_operation():
    yield from reset(monkey)
    yield from open_tab()
    yield from press("tolvol.decimate")
    yield from finished(lambda: left() < TRIANGLES // 4)
    yield from unfold_adjust()
    hud = region("HUD")
    place = on_screen(hud, hud.width // 2, 50)
    found = [(adjusted(), -left())]
    with job_time.in_background():
        for _ in range(3):
            yield from dragged(*place)
            found.append((adjusted(), -left()))
    assert found == sorted(found) and len({tolerance for tolerance, _ in found}) == 4, found
    assert [each.name for each in bpy.context.window_manager.operators] == ["Decimate in Tolerance"]
    yield from fold_adjust()
    key("ctrl+z")
    yield from finished(lambda: suzanne().tolvol.snapshot is None)


def test_what_happens_to_another_object_while_an_operation_is_adjusted_stays():
    yield from reset(monkey)
    bpy.ops.mesh.primitive_cube_add(location=(0, 4, 0))
    bpy.context.view_layer.objects.active = suzanne()
    before, reference = yield from decimated()
    with job_time.unending() as released:
        adjust(tolerance_percent=0.4)
        bpy.data.objects["Cube"].location.x = 3
        bpy.ops.ed.undo_push(message="moved")
        yield from finished(lambda: job.under_way().something_else)
        released.append(True)
        yield from finished(lambda: not job.under_way())
    assert left() < before and bpy.data.objects["Cube"].location.x == 3
    assert_proved(suzanne(), reference, 0.4)
    with window_context():
        bpy.ops.ed.undo()
    assert bpy.data.objects["Cube"].location.x == 3 and suzanne().tolvol.snapshot is None
