# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossing faces in the add-on and in decimate.py: a thin wall, whose two sides would cross."""

import json

import bpy
import numpy as np

from addon import native
from addon.proof import report
from commands import decimate, save, succeeded, world
from scenes import activate, add_object, sheet_arrays, world_triangles


def wall_arrays():
    """Returns two sheets, one a hair above the other."""
    vertices, quads = sheet_arrays()
    above = vertices + np.float32([0, 0, 0.004])
    return np.concatenate([vertices, above]), np.concatenate([quads, quads + len(vertices)])


def wall(name):
    ob = add_object(name, *wall_arrays())
    activate(ob)
    return ob


def pairs(surface):
    return len(native.module.crossing_pairs(*surface))


def test_no_faces_cross_unless_they_are_allowed_to():
    ob = wall("kept out")
    assert bpy.ops.tolvol.decimate(tolerance_percent=1) == {"FINISHED"}
    run = json.loads(ob.tolvol.last_run)
    assert run["crossings"] == {"before": 0, "after": 0} and pairs(world_triangles(ob)) == 0
    assert "cross" not in report.counts(run)
    ob = wall("allowed")
    assert bpy.ops.tolvol.decimate(tolerance_percent=1, crossings="ALLOW") == {"FINISHED"}
    run = json.loads(ob.tolvol.last_run)
    assert run["crossings"] == {"before": 0, "after": pairs(world_triangles(ob))} and run["crossings"]["after"] > 0
    assert f"{run['crossings']['after']:,} pairs of faces cross, before 0" in report.counts(run)
    assert ob.tolvol.crossings == "ALLOW"


def test_a_run_of_an_earlier_version_is_still_shown():
    ob = wall("wall")
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    run = json.loads(ob.tolvol.last_run)
    del run["crossings"], run["solidity"]
    assert report.remembered(json.dumps(run)) == [report.counts(run)]


def test_the_command_keeps_crossings_out_of_the_written_file(tmp_path):
    source = save(tmp_path / "in.ply", ("wall", *wall_arrays()))
    for choice in ("keep_out", "allow"):
        target, file = tmp_path / f"{choice}.ply", tmp_path / "report.json"
        extra = [] if choice == "keep_out" else ["--crossings", choice]
        match = succeeded(decimate(source, target, "--tolerance", "1%", "--report", file, *extra))
        run = json.loads(file.read_text())
        assert run["crossings"] == {"before": 0, "after": pairs(world(target))}
        assert (run["crossings"]["after"] > 0) == (choice == "allow")
        assert (match[3] is None) == (choice == "keep_out")
        found = run["solidity"]
        assert (
            not found["before"]["closed"] and found["after"]["boundary_loops"] == found["before"]["boundary_loops"] == 2
        )
        assert found["after"]["crossing_pairs"] == run["crossings"]["after"]
        assert found["change"]["area"] == found["after"]["area"] / found["before"]["area"] - 1


def test_objects_that_come_to_cross_each_other_are_reported(tmp_path):
    vertices, quads = sheet_arrays()
    above = vertices + np.float32([0, 0, 0.004])
    source = save(tmp_path / "in.obj", ("one", vertices, quads), ("other", above, quads))
    file, target = tmp_path / "report.json", tmp_path / "out.stl"  # which holds one object
    _, out, _ = decimate(source, target, "--tolerance", "1%", "--report", file)
    run = json.loads(file.read_text())
    assert run["crossings"] == {"before": 0, "after": pairs(world(target))} and run["crossings"]["after"] > 0
    assert "objects are decimated one by one" in out
