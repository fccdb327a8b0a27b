# SPDX-License-Identifier: GPL-3.0-or-later
"""The angle between faces and reference in the add-on and in decimate.py: a corrugated sheet."""

import json

import bpy
import numpy as np
import pytest

from addon.proof import last_run
from addon.shared.proof import report
from commands import decimate, save, succeeded
from scenes import activate, add_object, sheet_arrays


def corrugated_arrays():
    vertices, quads = sheet_arrays()
    bent = vertices.copy()
    bent[:, 2] += 0.01 * np.ptp(vertices[:, 0]) * np.sin(25 * vertices[:, 0] / np.ptp(vertices[:, 0]))
    return bent, quads


def decimated(name, **options):
    ob = add_object(name, *corrugated_arrays())
    activate(ob)
    assert bpy.ops.tolvol.decimate(tolerance_percent=2, **options) == {"FINISHED"}
    return ob, json.loads(ob.tolvol.last_run)


def test_normals_is_an_option_and_the_report_has_the_largest_angle():
    _, by_default = decimated("by default")
    assert 0 < by_default["normals"]["largest"] <= 90
    ob, narrow = decimated("narrow", max_normal_angle=np.radians(5))
    assert 0 < narrow["normals"]["largest"] <= 5.001
    assert narrow["normals"]["exceeded_before"] == narrow["normals"]["exceeded_after"] == 0
    assert narrow["output"]["triangles"] > by_default["output"]["triangles"]
    assert ob.tolvol.max_normal_angle == pytest.approx(np.radians(5))
    _, free = decimated("free", max_normal_angle=np.pi)
    assert free["normals"] is None
    assert "Normals" not in report.counts(by_default) + report.counts(free)


def test_faces_that_exceed_the_angle_are_named_in_the_counts():
    _, run = decimated("bent")
    run["normals"] = {"largest": 4.0, "exceeded_before": 1200, "exceeded_after": 7}
    assert "7 faces beyond the angle of Normals, before 1,200" in report.counts(run)
    del run["normals"]
    assert last_run.remembered(json.dumps(run), bpy.context)[0] == report.counts(run), (
        "a file may keep a run of an earlier version"
    )


def test_the_command_has_the_option(tmp_path):
    source = save(tmp_path / "in.ply", ("sheet", *corrugated_arrays()))
    target, file = tmp_path / "out.ply", tmp_path / "report.json"
    succeeded(decimate(source, target, "--tolerance", "2%", "--report", file, "--max-normal-angle", "5"))
    assert 0 < json.loads(file.read_text())["normals"]["largest"] <= 5.001
    for angle in ("0", "181", "nan", "steep"):
        code, _, errors = decimate(source, target, "--tolerance", "2%", "--max-normal-angle", angle)
        assert code == 2 and "--max-normal-angle" in errors
