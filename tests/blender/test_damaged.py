# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged .blend files: the panels read run, measurement and reference at every draw and must not fail."""

import json
import math

import bpy
import pytest

from addon import reference
from addon.proof import report
from addon.reference import measurements, snapshots
from scenes import torus


@pytest.fixture
def decimated():
    ob = torus()
    bpy.ops.tolvol.decimate()
    assert report.remembered(ob.tolvol.last_run) and measurements.measurement_of(ob)
    return ob


def damaged_runs(text):
    run = json.loads(text)
    yield from ("{", text[: len(text) // 2], "null", "7", "[]", "{}", '"run"', "[" * 100_000, "\udcff")
    for key in ("input", "output", "target_triangles", "stopped_by", "outside"):
        yield json.dumps({name: value for name, value in run.items() if name != key})
    for key in ("input", "output", "outside", "solidity"):
        for value in (None, [], 3, "text", {}, {"triangles": None, "faces": "x"}, {"triangles": [], "faces": [1]}):
            yield json.dumps(run | {key: value})


def test_a_damaged_run_is_no_run(decimated):
    for text in damaged_runs(decimated.tolvol.last_run):
        assert report.remembered(text) is None, text[:200]


@pytest.mark.parametrize("value", [math.nan, -1.0])
@pytest.mark.parametrize("name", ["tolerance", "forward", "backward"])
def test_a_damaged_measurement_is_none(decimated, name, value):
    setattr(decimated.tolvol.measurement, name, value)
    assert measurements.measurement_of(decimated) is None


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
