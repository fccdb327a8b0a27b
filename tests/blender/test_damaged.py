# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged .blend files: the panels read run, measurement and reference at every draw and must not fail."""

import json
import math

import bpy
import pytest

from addon import estimate, reference
from addon.background import queue
from addon.proof import kept_warnings, last_run, verdict
from addon.reference import measurements, snapshots
from scenes import torus


@pytest.fixture
def decimated():
    ob = torus()
    bpy.ops.tolvol.decimate()
    measurements.forget_kept()  # as when the file is opened
    assert last_run.remembered(ob.tolvol.last_run, bpy.context) and measurements.measurement_of(ob)
    return ob


def damaged_runs(text):
    run = json.loads(text)
    yield from ("{", text[: len(text) // 2], "null", "7", "[]", "{}", '"run"', "[" * 100_000, "\udcff")
    for key in ("input", "output", "target_triangles", "stopped_by", "outside"):
        yield json.dumps({name: value for name, value in run.items() if name != key})
    for key in ("input", "output", "outside", "solidity"):
        for value in (None, [], 3, "text", {}, {"triangles": None, "faces": "x"}, {"triangles": [], "faces": [1]}):
            yield json.dumps(run | {key: value})
    for zeros in (400, 5000):  # no float can hold the first number, and JSON is not read with the second
        yield text.replace(json.dumps(run["solidity"]["change"]["area"]), "1" + zeros * "0", 1)


def test_a_damaged_run_is_no_run(decimated):
    for text in damaged_runs(decimated.tolvol.last_run):
        assert last_run.remembered(text, bpy.context) is None, text[:200]


def test_damaged_holes_are_none(decimated):
    for holes in ({}, {"closed": 1}, {"closed": "x", "refused": 0}, {"closed": 1, "refused": {"outside": [10**400]}}):
        assert last_run.remembered_holes(json.dumps({"holes": holes})) is None


@pytest.mark.parametrize("count", ["Infinity", "-Infinity", "NaN", "1" * 5000, "[]", '"x"'])
def test_damaged_warnings_are_none(decimated, count):
    decimated.tolvol.warnings = f'{{"warnings": ["a"], "staying": {{"UV islands meet": {count}}}}}'
    assert kept_warnings.of(decimated) == ([], {})


@pytest.mark.parametrize("digits", ["", "x", "nan", "inf", "1e999", "-inf", "-1"])
@pytest.mark.parametrize("name", ["tolerance", "size", "forward", "backward"])
def test_a_damaged_measurement_is_none(decimated, name, digits):
    setattr(decimated.tolvol.measurement, f"{name}_digits", digits)
    assert measurements.measurement_of(decimated) is None


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0])
def test_against_a_damaged_reference_nothing_is_known(decimated, value):
    assert verdict.of(decimated).passed
    vertices = decimated.tolvol.snapshot.vertices
    vertices.foreach_set("co", [value] * 3 * len(vertices))
    snapshots._boxes.clear()  # as when the file is opened
    assert verdict.of(decimated) is None and verdict.word(decimated) == verdict.NOT_CHECKED


def test_a_measurement_of_nothing_is_none(decimated):
    for name in ("tolerance", "size"):
        setattr(decimated.tolvol.measurement, f"{name}_digits", "0")
        assert measurements.measurement_of(decimated) is None


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -1.0])
def test_a_damaged_percentage_is_the_default(decimated, value):
    default = 0.2  # of the preferences
    decimated.tolvol["percent_choice"] = value  # past the range of the property, as a file does it
    assert decimated.tolvol.tolerance_percent == pytest.approx(default) and verdict.of(decimated).margin_percent()
    assert bpy.ops.tolvol.check() == {"FINISHED"}


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -1.0, 0.0])
def test_a_damaged_length_has_no_verdict_and_no_check(decimated, value, tmp_path):
    decimated.tolvol.tolerance_mode = "LENGTH"
    assert verdict.of(decimated).passed
    decimated.tolvol["tolerance_length"] = value
    assert measurements.measurement_of(decimated) is not None and verdict.of(decimated) is None
    decimated.modifiers.new("smooth", "SMOOTH")
    decimated.modifiers.new("fit", "DECIMATE")
    for refuses, options in (
        (bpy.ops.tolvol.check, {}),
        (bpy.ops.tolvol.save_report, {"filepath": str(tmp_path / "report.json")}),
        (bpy.ops.tolvol.smooth, {}),
        (bpy.ops.tolvol.bake_normals, {}),
        (bpy.ops.tolvol.apply_modifier, {"modifier": "smooth"}),
        (bpy.ops.tolvol.fit_modifier, {"modifier": "fit"}),
        (bpy.ops.tolvol.worst_point, {}),
        (bpy.ops.tolvol.add_label, {"position": (0, 0, 0)}),
    ):
        with pytest.raises(RuntimeError, match=f"tolerance of {decimated.name} in the file is damaged: enter it again"):
            refuses(**options)
    decimated.tolvol.tolerance_length = 0.1
    assert bpy.ops.tolvol.check() == {"FINISHED"} and verdict.of(decimated).passed


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -1.0, 0.0])
def test_a_damaged_length_has_no_estimate(value):
    ob = torus()
    ob.tolvol.tolerance_mode = "LENGTH"
    ob.tolvol["tolerance_length"] = value
    assert estimate.shown(bpy.context) == "" and not queue._waiting


@pytest.mark.parametrize("name", ["forward", "backward"])
@pytest.mark.parametrize("digits", ["1e308", "1e-322"])
def test_distances_that_cannot_be_compared_have_no_verdict(decimated, name, digits):
    decimated.tolvol.tolerance_percent = 1e-9
    setattr(decimated.tolvol.measurement, f"{name}_digits", digits)
    assert verdict.of(decimated) is None


def test_a_damaged_reference_has_to_be_set_anew(decimated):
    decimated.tolvol.snapshot.clear_geometry()
    reference.forget_all()
    assert measurements.shown_size(decimated) is None
    assert snapshots.stale_reason(decimated) == "the snapshot in the file is damaged"
    with pytest.raises(RuntimeError, match="damaged"):
        bpy.ops.tolvol.check()
    bpy.ops.tolvol.set_reference()
    assert bpy.ops.tolvol.check() == {"FINISHED"}


def test_a_damaged_reference_is_replaced_by_the_mesh_it_was_taken_of():
    ob = torus()
    bpy.ops.tolvol.set_reference()
    ob.tolvol.snapshot.clear_geometry()
    reference.forget_all()
    assert snapshots.stale_reason(ob) == "the snapshot in the file is damaged"
    bpy.ops.tolvol.set_reference()
    assert snapshots.stale_reason(ob) is None and bpy.ops.tolvol.check() == {"FINISHED"}
