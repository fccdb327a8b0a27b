# SPDX-License-Identifier: GPL-3.0-or-later
"""Check, Select Outside and what is known of a mesh by them."""

import datetime
import re
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from addon import overlay
from addon.mesh import mesh_io
from addon.operators import blocked, check
from addon.overlay import draw, reasons
from addon.panels import notes
from addon.proof import statistics, verdict
from addon.reference import measurements, tolerances
from addon.shared import package
from addon.shared.proof import known, report
from scenes import activate, moved_up, sheet, torus


def lifted_exactly(height):
    """Makes a flat square at z = 0 and the same square at `height`, which float32 stores exactly."""
    ob = sheet(count=1, bumps=0.0)
    bpy.ops.tolvol.set_reference()
    for vertex in ob.data.vertices:
        vertex.co.z = height
    ob.data.update()
    activate(ob)
    ob.tolvol.tolerance_mode = "LENGTH"
    return ob


def test_check_measures_both_ways_and_the_share_outside():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    bpy.ops.tolvol.check()
    measured = ob.tolvol.measurement
    assert measured.forward == pytest.approx(0.1, rel=0.011)
    assert not verdict.of(ob).forward_within and not verdict.of(ob).backward_within
    # Outside are the quarter of the sheet that is lifted by 0.1, and half of the slope to it, which is 0.1 wide.
    area = 2 * 2 * 0.75 - 2 * 0.1 + 2 * np.hypot(0.1, 0.1) + 2 * 2 * 0.25
    assert measured.share_outside == pytest.approx((2 * 2 * 0.25 + np.hypot(0.1, 0.1)) / area, abs=0.01)
    assert measurements.measurement_of(ob) is not None
    ob.tolvol.tolerance_length = 0.2
    bpy.ops.tolvol.check()
    assert verdict.of(ob).forward_within and verdict.of(ob).backward_within


def test_only_check_measures_again_what_was_measured_before(monkeypatch):
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    calls, measure = [], package.module.directed_hausdorff
    monkeypatch.setattr(
        package.module, "directed_hausdorff", lambda *args, **kw: (calls.append(kw), measure(*args, **kw))[1]
    )
    bpy.ops.tolvol.check()
    whole = len(calls)
    assert whole >= 2
    for again in (bpy.ops.tolvol.measure_statistics, bpy.ops.tolvol.worst_point, bpy.ops.tolvol.select_outside):
        again()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(calls) == whole
    bpy.ops.tolvol.check()
    assert len(calls) == 2 * whole


def test_measurement_is_dropped_when_mesh_place_or_reference_change():
    other = torus("other")
    ob = torus()
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", other
    bpy.ops.tolvol.set_reference()
    bpy.ops.tolvol.check()
    assert measurements.measurement_of(ob) is not None
    ob.location.x = 1
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is None
    ob.location.x = 0
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is not None
    ob.data.vertices[5].co.z += 0.01
    ob.data.update()
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is None
    bpy.ops.tolvol.check()
    assert measurements.measurement_of(ob) is not None
    other.data.vertices[5].co.z += 0.01
    bpy.ops.tolvol.set_reference()
    assert measurements.measurement_of(ob) is None


def test_nothing_is_known_of_a_mesh_that_is_being_edited():
    ob = torus()
    bpy.ops.tolvol.set_reference()
    bpy.ops.tolvol.check()
    for mode in ("EDIT", "SCULPT"):
        bpy.ops.object.mode_set(mode=mode)
        assert measurements.measurement_of(ob) is None
        bpy.ops.object.mode_set(mode="OBJECT")
        assert measurements.measurement_of(ob) is not None


def test_own_measurement_moves_along():
    ob = torus()
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    ob.rotation_euler.x = 1
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is not None


def test_select_outside_selects_those_faces_in_edit_mode():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "EDIT" and tuple(bpy.context.tool_settings.mesh_select_mode) == (False, False, True)
    bpy.ops.object.mode_set(mode="OBJECT")
    highest = np.array([max(ob.data.vertices[v].co.z for v in face.vertices) for face in ob.data.polygons])
    selected = mesh_io.column(ob.data.polygons, "select", 1, bool)
    assert np.array_equal(selected, highest > 0.05) and selected.any() and not selected.all()
    assert blocked.check_blocked(ob) is None


def test_select_outside_leaves_an_object_that_is_inside_alone():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.2
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "OBJECT"


def test_verdicts_agree_about_what_float32_cannot_tell_from_the_tolerance():
    """The distance is above and below the tolerance by less than a step of Blender's float32 numbers."""
    height = float(np.float32(0.1))  # 0.100000001490116
    ob = lifted_exactly(height)
    ob.tolvol.tolerance_length = 0.1
    bpy.ops.tolvol.check()
    assert np.float32(verdict.of(ob).tolerance) == np.float32(verdict.of(ob).forward.upper)
    assert verdict.of(ob).kind == verdict.BEYOND and "Beyond" in verdict.of(ob).line()
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.tolvol.tolerance_length = 0.3
    ob.tolvol.tolerance_length = 0.1
    ob.tolvol.tolerance_length_converted = repr(height * (1 + 1e-9))  # as converted from a percentage
    assert tolerances.tolerance_length(ob.tolvol, 1.0) > height
    assert verdict.of(ob).kind == verdict.WITHIN, "of what was measured, before it is measured again"
    bpy.ops.tolvol.check()
    assert verdict.of(ob).kind == verdict.WITHIN
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "OBJECT"


@pytest.mark.parametrize("measure", ("check", "measure_statistics", "worst_point", "save_report"))
def test_what_was_measured_is_no_undo_step_and_stays_known(measure, tmp_path):
    def lift():
        ob = bpy.data.objects["sheet"]
        ob.data.vertices[0].co.z += 0.01
        ob.data.update()
        bpy.ops.ed.undo_push(message="lift")

    moved_up()
    bpy.ops.ed.undo_push(message="start")
    lift()
    operator = getattr(bpy.ops.tolvol, measure)
    options = {"filepath": str(tmp_path / "r.json")} if measure == "save_report" else {}
    assert operator("EXEC_DEFAULT", True, **options) == {"FINISHED"}
    found = verdict.of(bpy.data.objects["sheet"])
    assert found.share_outside > 0
    lift()
    assert verdict.of(bpy.data.objects["sheet"]) is None
    bpy.ops.ed.undo()
    ob = bpy.data.objects["sheet"]
    assert verdict.of(ob) == found
    assert (statistics.of(ob) is not None) == (measure == "measure_statistics")
    height = ob.data.vertices[0].co.z
    bpy.ops.ed.undo()
    assert bpy.data.objects["sheet"].data.vertices[0].co.z < height, "the measurement was no step"


def test_notes_say_when_the_mesh_was_measured():
    ob = moved_up()

    def when():
        return [line for line, _ in notes.notes(bpy.context, ob)[0] if line.startswith("Measured")]

    assert when() == []
    before = datetime.datetime.now()
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    assert when() in ([f"Measured at {time:%H:%M}"] for time in (before, datetime.datetime.now()))
    measurements.forget_kept()  # as when the file is opened
    ob.tolvol.measurement.time = datetime.datetime(2024, 2, 3, 4, 5).astimezone().isoformat()
    assert when() == ["Measured at 04:05 on 2024-02-03"]
    for time in ("", "yesterday"):
        ob.tolvol.measurement.time = time
        assert when() == []


def test_exactly_at_the_tolerance_is_not_called_beyond():
    ob = lifted_exactly(0.25)
    ob.tolvol.tolerance_length = 0.25
    bpy.ops.tolvol.check()
    found = verdict.of(ob)
    assert found.forward.lower <= 0.25 < found.forward.upper and found.kind == verdict.UNDECIDED
    assert report.percent(found.forward.upper, found.tolerance) == "100 %"
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "EDIT", "what is not proved counts as outside"


def test_a_measurement_that_cannot_be_read_is_none():
    ob = torus()
    bpy.ops.tolvol.decimate()
    measurements.forget_kept()  # as when the file is opened
    assert verdict.of(ob).kind == verdict.WITHIN
    ob.tolvol.measurement.forward_digits = "much"
    assert verdict.of(ob) is None
    ob.tolvol.measurement.forward_digits = ""
    assert verdict.of(ob) is None


def test_a_little_more_than_the_tolerance_is_not_shown_as_a_percent_more():
    assert report.percent(1 + 4.75e-8, 1) == "100.0000048 %"
    assert report.percent(1.005, 1) == "100.50 %"


def test_tiny_percentages_are_bounds_without_an_exponent():
    assert report.percent(1.41e-15, 1) == report.percent(0.999e-6, 1) == "<0.0001 %"
    assert report.percent(1.001e-6, 1) == "0.000101 %" and report.percent(0, 1) == "0 %"
    assert report.all_digits(1.41e-15, 1) == "1.41e-13 %"  # in the line that programs read


def test_large_percentages_have_all_their_digits():
    assert report.percent(30.391, 1) == "3,040 %" and report.percent(9.998, 1) == "1,000 %"
    assert report.percent(9.98, 1) == "998 %"
    assert report.percent(1 + 1e-13, 1) == "100 %" == report.percent(0.99999, 1)


def test_legend_says_what_no_proof_covers():
    ob = torus()
    assert draw.note(ob) == "Colours not proved" and draw.judged(bpy.context, [ob]) == ""
    ob.modifiers.new("wave", "WAVE")
    ob.shape_key_add()
    assert draw.note(ob) == "Colours with its modifiers and shape keys, not proved"
    assert draw.judged(bpy.context, [ob]) == "without modifiers and shape keys"
    bpy.ops.object.mode_set(mode="SCULPT")
    assert draw.note(ob) == "Colours without its modifiers, not proved" and draw.judged(bpy.context, [ob]) == ""
    bpy.ops.object.mode_set(mode="OBJECT")
    sheet()  # It is the active object now, whose verdict the panel shows.
    assert draw.judged(bpy.context, [ob]) == "of another object, without modifiers and shape keys"


def test_drawing_that_was_refused_is_asked_for_again_once_it_is_turned_on_anew(chosen_preferences):
    reasons.broken[:] = ["no such texture"]
    overlay.refresh()
    assert reasons.broken
    chosen_preferences.use_gl = False
    assert not reasons.broken


def measure_less_narrowly(monkeypatch):
    measure = package.module.directed_hausdorff

    def less_narrow(*surfaces, **options):
        found = measure(*surfaces, **options)
        ends = {"lower": 0.9991 * found.lower, "upper": 1.0009 * found.upper}
        return SimpleNamespace(**ends, position=found.position, triangle=found.triangle)

    monkeypatch.setattr(package.module, "directed_hausdorff", less_narrow)


@pytest.mark.parametrize("file_was_opened_again", (False, True))
def test_a_second_measurement_of_the_same_mesh_never_shows_less_than_the_first(
    file_was_opened_again, monkeypatch, capfd
):
    ob = torus()
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    before = verdict.of(ob)
    if file_was_opened_again:
        measurements.forget_kept()
        known._kept.clear()
    measure_less_narrowly(monkeypatch)
    capfd.readouterr()
    bpy.ops.tolvol.check()
    now = verdict.of(ob)
    for way in ("forward", "backward"):
        first, second = getattr(before, way), getattr(now, way)
        assert (second.lower, second.upper) == (first.lower, first.upper)
    assert report.percent(before.largest, before.tolerance) in capfd.readouterr().out
    # What is better than before counts, and what cannot be true of a damaged file does not.
    monkeypatch.undo()
    ob.tolvol.measurement.forward = ob.tolvol.measurement.forward_lower = before.forward.lower / 2
    measurements.forget_kept()
    bpy.ops.tolvol.check()
    assert verdict.of(ob).forward.upper >= before.forward.lower


def test_a_narrower_measurement_of_the_same_mesh_is_shown(monkeypatch):
    ob = torus()
    measure_less_narrowly(monkeypatch)
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    monkeypatch.undo()
    before = verdict.of(ob)
    bpy.ops.tolvol.check()
    now = verdict.of(ob)
    assert now.forward.upper < before.forward.upper and now.backward.lower > before.backward.lower


def test_what_was_known_to_be_within_is_not_selected_as_outside(monkeypatch, capfd):
    ob = torus()
    ob.tolvol.keep = "ONE"
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    before = verdict.of(ob)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", before.forward.upper * 1.00001
    measurements.forget_kept()
    known._kept.clear()
    measure_less_narrowly(monkeypatch)
    capfd.readouterr()
    assert bpy.ops.tolvol.select_outside() == {"CANCELLED"}
    assert "No face of the mesh is outside. PASS" in capfd.readouterr().out


@pytest.mark.parametrize("by", [0.5, 2])
def test_a_tolerance_that_is_changed_while_the_mesh_is_measured_is_not_that_of_the_message(by, monkeypatch, capfd):
    ob = torus()
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    ob.data.vertices[0].co *= 1.3
    ob.data.update()
    judge = check.Comparison.judge

    def judge_and_change(*arguments):
        ob.tolvol.tolerance_percent = by
        return judge(*arguments)

    monkeypatch.setattr(check.Comparison, "judge", judge_and_change)
    capfd.readouterr()
    bpy.ops.tolvol.check()
    said = capfd.readouterr().out
    share = re.search(r"FAIL: beyond the tolerance.* about ([0-9.]+).% of the area is outside", said)
    assert share and float(share[1]) > 0, said
