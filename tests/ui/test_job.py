# SPDX-License-Identifier: GPL-3.0-or-later
"""Actions of the user or of a script while a job runs."""

import tempfile
from pathlib import Path
from unittest import mock

import bpy

import job_time
from addon import job, status_bar
from addon.job import operator
from scenes import world_triangles
from test_panel import assert_proved, monkey, stored, suzanne
from window import (
    at_rest,
    centre,
    finished,
    key,
    open_tab,
    pixels,
    reset,
    screenshot,
    status_texts,
    view,
    window_context,
    xdotool,
)


def begin():
    """Starts a decimation that goes on. Returns the number of reports before it: all later reports are of the decimation."""
    with window_context(), job_time.unending():
        suzanne().tolvol.tolerance_percent = 0.05
        bpy.ops.ed.undo_push(message="ready")
        suzanne().location.x = 1
        bpy.ops.ed.undo_push(message="moved")
        said = len(reports())
        assert bpy.ops.tolvol.decimate("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    assert job.under_way()
    return said


def reports():
    """Returns the lines of Blender's info area."""
    window, area = view()
    kind, area.type = area.type, "INFO"
    try:
        with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
            bpy.ops.info.select_all(action="SELECT")
            bpy.ops.info.report_copy()
            bpy.ops.info.select_all(action="DESELECT")
        return bpy.context.window_manager.clipboard.splitlines()
    finally:
        area.type = kind


def ends(said, text):
    yield from finished(lambda: not job.under_way())
    yield
    assert any(text in line for line in reports()[said:]), reports()[said:]


def test_an_undo_ends_a_job():
    yield from reset(monkey)
    said = begin()
    before = stored()
    with window_context():
        bpy.ops.ed.undo()
    yield from ends(said, "Decimate in Tolerance was stopped, because a step was undone. It has changed nothing")
    assert stored() == before and suzanne().tolvol.snapshot is None


def begin_large(soon):
    """Presses Decimate as if its mesh were so large that Blender waits for it. soon: the seconds until it is read."""
    with window_context(), mock.patch.multiple(operator, LARGE=1, _SOON=soon):
        assert bpy.ops.tolvol.decimate("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    assert not job.under_way()


def test_that_an_operator_has_begun_is_shown_before_a_large_mesh_is_read():
    yield from reset(monkey)
    before, reference, percent = stored(), world_triangles(suzanne()), suzanne().tolvol.tolerance_percent
    with mock.patch.object(status_bar, "show", wraps=status_bar.show) as show:
        begin_large(0.02)
        assert [call.args for call in show.call_args_list] == [("Preparing    Esc: Cancel",)]
    yield from finished(lambda: suzanne().tolvol.snapshot is not None and not job.under_way())
    assert_proved(suzanne(), reference, percent)
    xdotool("mousemove", *centre())
    yield
    key("ctrl+z")
    yield from finished(lambda: stored() == before)
    assert suzanne().tolvol.snapshot is None


def test_esc_before_a_large_mesh_is_read_cancels_the_operator():
    yield from reset(monkey)
    said = len(reports())
    begin_large(60)
    xdotool("mousemove", *centre())
    yield
    screenshot("job 4 preparing")
    assert status_bar.showing()
    xdotool("key", "Escape")
    yield from ends(said, "Decimate in Tolerance was cancelled. It has changed nothing")
    assert suzanne().tolvol.snapshot is None


def test_an_operator_does_not_begin_on_something_else_than_what_it_was_asked_for():
    def activate(other):
        bpy.context.view_layer.objects.active = other

    changes = (
        lambda other: activate(None),
        activate,
        lambda other: other.select_set(True),
        lambda other: bpy.ops.ed.undo(),
    )
    for change in changes:
        yield from reset(monkey)
        bpy.ops.mesh.primitive_cube_add(location=(0, 4, 0))
        other = bpy.context.object
        bpy.context.view_layer.objects.active = suzanne()
        other.select_set(False)
        with window_context():
            bpy.ops.ed.undo_push(message="ready")
            suzanne().data.vertices[0].co.x += 0.1
            bpy.ops.ed.undo_push(message="moved")
        said = len(reports())
        begin_large(0.2)
        with window_context():
            change(other)
        yield from finished(lambda said=said: len(reports()) > said)
        yield from ends(said, "Decimate in Tolerance did not begin, because something has changed since it was pressed")
        assert suzanne().tolvol.snapshot is None and not status_bar._given


def test_another_operator_that_has_begun_meanwhile_is_not_disturbed():
    yield from reset(monkey)
    begin_large(0.5)
    said = begin()
    yield from finished(lambda: len(reports()) > said)
    assert "Decimate in Tolerance is at work: wait until it ends, or press Esc" in reports()[-1]
    assert job.under_way()
    xdotool("mousemove", *centre())
    yield
    xdotool("key", "Escape")
    yield from ends(said, "Decimate in Tolerance was cancelled")


def rotation():
    return tuple(view()[1].spaces[0].region_3d.view_rotation)


def test_the_view_is_turned_while_a_job_runs():
    yield from reset(monkey)
    yield from open_tab()
    begin()
    before = rotation()
    xdotool("mousemove", *centre())
    yield
    xdotool("key", "KP_4")
    yield from finished(lambda: rotation() != before, pause=0.05)
    assert job.under_way()
    screenshot("job 1 turned")
    xdotool("key", "Escape")
    yield from finished(lambda: not job.under_way())
    assert rotation() != before and suzanne().tolvol.snapshot is None


def drag(button, start, end):
    """Drags the mouse over the view, as slowly as Blender needs to see that it is a drag."""
    xdotool("mousemove", *start)
    yield
    xdotool("mousedown", button)
    for step in range(1, 6):
        yield
        xdotool("mousemove", *(a + (b - a) * step // 5 for a, b in zip(start, end)))
    yield
    xdotool("mouseup", button)


def test_the_mouse_turns_and_zooms_the_view_and_moves_another_object_while_a_job_runs():
    yield from reset(monkey)
    bpy.ops.mesh.primitive_cube_add(location=(0, 4, 0))
    cube = bpy.context.object
    bpy.context.view_layer.objects.active = suzanne()
    cube.select_set(False)
    suzanne().select_set(True)
    camera = view()[1].spaces[0].region_3d
    x, y = centre()
    begin()
    before = rotation()
    yield from drag(2, (x, y), (x + 120, y + 60))
    yield from finished(lambda: rotation() != before)
    assert job.under_way()
    distance = camera.view_distance
    xdotool("mousemove", x, y, "click", 4)
    yield from finished(lambda: camera.view_distance < distance)
    assert job.under_way()
    # Another object is chosen and moved by keys and mouse.
    suzanne().select_set(False)
    cube.select_set(True)
    bpy.context.view_layer.objects.active = cube
    xdotool("mousemove", x, y)
    yield
    key("g")
    for step in range(1, 5):
        yield
        xdotool("mousemove", x + 30 * step, y)
    yield from finished(lambda: tuple(cube.location) != (0, 4, 0))
    xdotool("click", 1)
    yield
    moved = tuple(cube.location)
    xdotool("mousemove", x, y)
    yield
    assert tuple(cube.location) == moved != (0, 4, 0) and job.under_way()
    screenshot("job 3 another object moved")
    xdotool("key", "Escape")
    yield from finished(lambda: not job.under_way())
    assert tuple(cube.location) == moved and suzanne().tolvol.snapshot is None


def status_bar_pixels():
    return pixels()[-18:, :600]


def test_no_workspace_keeps_the_text_of_a_job():
    yield from reset(monkey)
    window, plain = view()[0], {}
    xdotool("mousemove", 5, 5)
    workspaces = [bpy.data.workspaces["Scripting"], window.workspace]
    for workspace in workspaces:
        window.workspace = workspace
        yield from at_rest()
        plain[workspace] = status_bar_pixels()
    begin()
    for workspace in workspaces[::-1]:
        window.workspace = workspace
        yield from finished(lambda before=plain[workspace]: (status_bar_pixels() != before).any())
    xdotool("key", "Escape")
    yield from finished(lambda: not job.under_way())
    # For some seconds the status bar shows what the job has reported.
    yield from finished(lambda: (status_bar_pixels() == plain[window.workspace]).all(), pause=1.0)
    for workspace in workspaces:
        window.workspace = workspace
        yield from at_rest()
        screenshot(f"job 2 {workspace.name}")
        assert (status_bar_pixels() == plain[workspace]).all()


def test_the_keyboard_ends_a_job_by_an_edit_of_its_mesh():
    yield from reset(monkey)
    said = begin()
    before = stored()
    xdotool("mousemove", *centre(), "key", "Tab")
    yield from ends(said, "The mesh or the mode of Suzanne was changed meanwhile: nothing more was changed")
    with window_context():
        bpy.ops.object.mode_set(mode="OBJECT")
    assert stored() == before and suzanne().tolvol.snapshot is None


def test_a_job_whose_object_is_deleted_ends():
    yield from reset(monkey)
    said = begin()
    bpy.data.objects.remove(suzanne())
    yield from ends(said, "Suzanne was deleted meanwhile: nothing was changed")


def test_a_job_whose_object_is_renamed_ends():
    yield from reset(monkey)
    said = begin()
    before = stored()
    suzanne().name = "Susan"
    yield from ends(said, "Suzanne was renamed to Susan meanwhile: nothing was changed")
    bpy.data.objects["Susan"].name = "Suzanne"
    assert stored() == before and suzanne().tolvol.snapshot is None


def test_opening_a_file_ends_a_job():
    yield from reset(monkey)
    before, shown, say = stored(), [], status_bar.say
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "monkey.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
        begin()
        status_bar.say = lambda text: shown.append(text) or say(text)
        try:
            with window_context():
                bpy.ops.wm.open_mainfile(filepath=path)
            assert not job.under_way()
            yield from at_rest()  # Nothing but an estimate may go on.
        finally:
            status_bar.say = say
    assert shown == ["Decimate in Tolerance was stopped, because another file was opened. It has changed nothing"]
    assert stored() == before and suzanne().tolvol.snapshot is None


# Adjust Last Operation -----------------------------------------------------------------------------------------------


def adjust(**settings):
    """Does to the last operation as its panel does when settings are changed there."""
    last = bpy.context.window_manager.operators[-1]
    for name, value in settings.items():
        setattr(last.properties, name, value)
    with window_context(), job_time.in_background():
        assert bpy.ops.ed.undo_redo("EXEC_DEFAULT", True) == {"FINISHED"}  # True: with an undo step, as there


def decimated():
    """Decimates. Returns the number of triangles that are left, and the triangles of the reference."""
    with window_context():
        suzanne().tolvol.tolerance_percent = 0.2
        bpy.ops.ed.undo_push(message="ready")
        reference = world_triangles(suzanne())
        # True: with an undo step, and as the last operation, even if it ends at once on a quick machine.
        bpy.ops.tolvol.decimate("INVOKE_DEFAULT", True)
    yield from finished(lambda: not job.under_way())
    return len(suzanne().data.polygons), reference


def test_adjust_last_operation_shows_progress_and_is_one_undo_step():
    yield from reset(monkey)
    left, reference = yield from decimated()
    said = status_texts()
    with job_time.unending() as released:
        adjust(tolerance_percent=0.1)
        assert job.under_way() and len(suzanne().data.polygons) > 3 * left
        yield from finished(lambda: any("triangles left" in text and "Esc: Cancel" in text for text in said))
        released.append(True)
    yield from finished(lambda: not job.under_way())
    more = len(suzanne().data.polygons)
    assert left < more < 3 * left
    assert_proved(suzanne(), reference, 0.1)
    adjust(tolerance_percent=0.4)  # It begins with the original again.
    yield from finished(lambda: not job.under_way())
    assert len(suzanne().data.polygons) < left
    with window_context():
        bpy.ops.ed.undo()
    assert suzanne().tolvol.snapshot is None and len(suzanne().data.polygons) > 3 * left


def test_escape_while_adjusting_leaves_the_mesh_as_before_the_operation():
    yield from reset(monkey)
    left, _ = yield from decimated()
    said = len(reports())
    with job_time.unending():
        adjust(tolerance_percent=0.1)
    xdotool("mousemove", *centre(), "key", "Escape")
    yield from ends(said, "Decimate in Tolerance was cancelled. The mesh is as it was before that operation")
    assert suzanne().tolvol.snapshot is None and len(suzanne().data.polygons) > 3 * left
    adjust(tolerance_percent=0.2)
    yield from finished(lambda: not job.under_way())
    assert len(suzanne().data.polygons) == left


def test_adjusting_ends_once_blender_has_forgotten_the_operator():
    yield from reset(monkey)
    left, _ = yield from decimated()
    said = len(reports())
    adjust(tolerance_percent=0.02)
    with window_context():
        for _ in range(33):
            bpy.ops.object.select_all("EXEC_DEFAULT", True, action="TOGGLE")
            assert job.under_way()
    yield from ends(said, "because Blender keeps only 32 operations, and as many have followed. The mesh is as it was")
    assert suzanne().tolvol.snapshot is None and len(suzanne().data.polygons) > 3 * left


def test_adjusting_again_while_a_job_runs_begins_anew():
    yield from reset(monkey)
    left, _ = yield from decimated()
    said = len(reports())
    with job_time.unending():
        adjust(tolerance_percent=0.1)
    adjust(tolerance_percent=0.4)
    yield from finished(lambda: not job.under_way())
    assert len(suzanne().data.polygons) < left
    yield
    assert not any("stopped" in line for line in reports()[said:])
    with window_context():
        bpy.ops.ed.undo()
    assert suzanne().tolvol.snapshot is None and len(suzanne().data.polygons) > 3 * left


def test_check_is_repeated_with_progress_and_leaves_the_decimation_to_be_adjusted():
    yield from reset(monkey)
    left, _ = yield from decimated()
    with window_context():
        bpy.ops.tolvol.check("INVOKE_DEFAULT", True)
    yield from finished(lambda: not job.under_way())
    said = len(reports())
    with window_context(), job_time.in_background():
        bpy.ops.screen.repeat_last("EXEC_DEFAULT", True)
    assert job.under_way()
    yield from ends(said, "PASS: within the tolerance both ways")
    decimation = [last for last in bpy.context.window_manager.operators if last.name == "Decimate in Tolerance"][-1]
    decimation.properties.tolerance_percent = 0.1
    with window_context(), job_time.in_background():
        assert bpy.ops.ed.undo_redo("EXEC_DEFAULT", True) == {"FINISHED"}
    yield from finished(lambda: not job.under_way())
    assert left < len(suzanne().data.polygons) < 3 * left
    with window_context():
        bpy.ops.ed.undo()
    assert suzanne().tolvol.snapshot is None and len(suzanne().data.polygons) > 3 * left
