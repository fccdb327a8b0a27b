# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossing faces in the add-on and in decimate.py: a thin wall, whose two sides would cross."""

import json

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import guard, native
from addon.mesh import mesh_io
from addon.proof import kept_warnings, last_run, verdict
from addon.shared.proof import report, solidity
from commands import decimate, save, succeeded, world
from modified import modified
from scenes import activate, add_object, link, sheet_arrays, world_triangles


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
    assert last_run.remembered(json.dumps(run), bpy.context) == (report.counts(run), None)


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


# Operations that move vertices -------------------------------------------------------------------------------------


def rough_wall(choice):
    """Returns two sheets that do not cross, the lower one bumpy and the upper one flat; Crossings is set as chosen."""
    vertices, quads = sheet_arrays(bumps=0.0)
    lower, upper = vertices.copy(), vertices + np.float32([0, 0, 0.03])
    lower[:, 2] = -0.06 * np.clip(1 - np.hypot(lower[:, 0], lower[:, 1]) / 0.4, 0, None)
    upper[:, 2] += 0.05 * np.random.default_rng(1).random(len(upper))
    ob = add_object(choice, np.concatenate([lower, upper]), np.concatenate([quads, quads + len(vertices)]))
    activate(ob)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.2
    ob.tolvol.crossings = choice
    assert not pairs(world_triangles(ob))
    return ob


def press(ob, depth=0.1):
    """Returns the coordinates of the wall with its upper sheet pressed down in the middle, through the lower one."""
    wish = mesh_io.column(ob.data.vertices, "co", 3)
    hill = np.clip(1 - np.hypot(wish[:, 0], wish[:, 1]) / 0.5, 0, None)
    wish[len(wish) // 2 :, 2] -= depth * 2 * hill[len(wish) // 2 :]
    return wish


@pytest.mark.parametrize("choice", ["KEEP_OUT", "ALLOW"])
def test_an_applied_modifier_makes_no_crossings_unless_they_are_allowed(choice):
    ob = rough_wall(choice)
    ob.shape_key_add(name="Basis")
    modifier = ob.modifiers.new("Displace", "DISPLACE")
    modifier.strength, modifier.mid_level, modifier.direction = -0.06, 0.0, "Z"
    group = ob.vertex_groups.new(name="upper")
    group.add(list(range(len(ob.data.vertices) // 2, len(ob.data.vertices))), 1.0, "REPLACE")
    modifier.vertex_group = "upper"
    assert bpy.ops.tolvol.apply_modifier(modifier="Displace") == {"FINISHED"}
    assert bool(pairs(world_triangles(ob))) == (choice == "ALLOW")


def test_a_fit_passes_over_values_that_make_faces_cross():
    ob = modified("DECIMATE")
    before, seen = pairs(world_triangles(ob)), []
    with pytest.MonkeyPatch.context() as patch:
        crossing_pairs = solidity.crossing_pairs

        def first_cross(arrays, *options):
            seen.append(len(arrays.triangles))
            return np.zeros((1, 2), np.int32) if len(seen) == 1 else crossing_pairs(arrays, *options)

        patch.setattr(solidity, "crossing_pairs", first_cross)
        assert bpy.ops.tolvol.fit_modifier() == {"FINISHED"}
    left = world_triangles(ob)
    assert seen[0] <= seen[1] and pairs(left) == before == 0 and verdict.of(ob).kind == verdict.WITHIN


@pytest.mark.parametrize(("percent", "most"), [(0.5, 420), (1, 420), (2, 420)])
def test_a_fit_finds_values_at_which_no_faces_cross(percent, most):
    """Of 150 ratios, 53 keep the sheets within 1 % and apart; the best one leaves 320 triangles."""
    ob = wall("wall")
    ob.tolvol.tolerance_percent = percent
    ob.modifiers.new("Collapse", "DECIMATE")
    assert bpy.ops.tolvol.fit_modifier() == {"FINISHED"}
    assert not pairs(world_triangles(ob)) and len(world_triangles(ob)[1]) <= most


def test_a_value_at_which_faces_would_cross_is_refused():
    ob = wall("wall")
    ob.modifiers.new("Collapse", "DECIMATE")
    with pytest.raises(
        RuntimeError, match="At the Ratio 0.05 of Collapse, [0-9,]+ pairs of faces would cross: press Decimate"
    ):
        bpy.ops.tolvol.fit_modifier(value=0.05)
    assert len(world_triangles(ob)[1]) == 3600 and len(ob.modifiers) == 1


def test_a_fitted_modifier_that_may_make_faces_cross_says_so(capfd):
    for result in ("REPLACE", "OBJECT"):
        ob = wall(result)
        ob.tolvol.crossings = "ALLOW"
        ob.modifiers.new("Collapse", "DECIMATE")
        assert bpy.ops.tolvol.fit_modifier(result=result) == {"FINISHED"}
        fitted = bpy.context.active_object
        count = pairs(world_triangles(fitted))
        warning = f"Collapse makes faces cross: the number of crossing pairs of faces is {count:,}, and was 0 before"
        assert (
            count > 0 and kept_warnings.of(fitted)[0] == [warning] and f"Warning: {warning}" in capfd.readouterr().out
        )
    activate(fitted)
    fitted.modifiers.new("Collapse", "DECIMATE")
    # Again with all triangles: the same pairs cross, and none of them is new.
    bpy.ops.tolvol.fit_modifier(value=1, result="REPLACE")
    assert kept_warnings.of(fitted) == ([], {}) and "Warning" not in capfd.readouterr().out


@pytest.mark.parametrize("choice", ["KEEP_OUT", "ALLOW"])
def test_smoothing_makes_no_crossings_unless_they_are_allowed(choice):
    ob = rough_wall(choice)
    # The bumpy part of the lower sheet becomes flat, while its upper neighbour is locked just above it.
    count = len(ob.data.vertices) // 2
    positions = mesh_io.column(ob.data.vertices, "co", 3)
    positions[count:, 2] = positions[:count, 2] + 0.004
    ob.data.vertices.foreach_set("co", positions.ravel())
    assert not pairs(world_triangles(ob))
    group = ob.vertex_groups.new(name="lower")
    group.add(list(range(count)), 1.0, "REPLACE")
    options = {"iterations": 20, "method": "LAPLACIAN", "vertex_group": "lower"}
    assert bpy.ops.tolvol.smooth(**options) == {"FINISHED"}
    assert bool(pairs(world_triangles(ob))) == (choice == "ALLOW")


@pytest.mark.parametrize("mode", ["BLOCKED", "FARTHEST", "PULL_BACK"])
def test_a_deformation_makes_no_crossings_unless_they_are_allowed(mode):
    for choice in ("ALLOW", "KEEP_OUT"):
        ob = rough_wall(choice)
        data = bpy.data.lattices.new("cage")
        data.points_u = data.points_v = 4
        data.points_w = 2
        cage = link(bpy.data.objects.new("cage", data), Matrix.Diagonal((0.8, 0.8, 0.4, 1)))
        activate(ob)
        for point in data.points:  # in the middle the upper layer goes down and the lower one up: the sheets cross
            if max(abs(point.co.x), abs(point.co.y)) < 1:
                point.co_deform.z *= -2
        options = {"lattice": cage.name, "mode": mode}
        if mode == "BLOCKED" and choice == "KEEP_OUT":
            with pytest.raises(
                RuntimeError, match=r"faces of KEEP_OUT\S* would cross others. \d+\.\d % of the way is permitted"
            ):
                bpy.ops.tolvol.deform(**options)
            continue
        assert bpy.ops.tolvol.deform(**options) == {"FINISHED"}
        assert bool(pairs(world_triangles(ob))) == (choice == "ALLOW")


@pytest.mark.parametrize("kind", ["sculpting", "editing"])
def test_a_guard_keeps_crossings_out_only_if_it_is_asked_to(kind):
    for keeps_out in (False, True):
        ob = rough_wall("KEEP_OUT")
        assert not ob.tolvol.guard.crossings
        assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
        setattr(ob.tolvol.guard, kind, True)
        bpy.ops.object.mode_set(mode="SCULPT" if kind == "sculpting" else "EDIT")
        update(ob)
        ob.tolvol.guard.crossings = keeps_out
        update(ob)
        if kind == "sculpting":
            ob.data.vertices.foreach_set("co", press(ob).ravel())
        else:
            wish = press(ob)
            edited = bmesh.from_edit_mesh(ob.data)
            for vertex, place in zip(edited.verts, wish):
                vertex.co = place
            bmesh.update_edit_mesh(ob.data)
        update(ob)
        bpy.ops.object.mode_set(mode="OBJECT")
        assert bool(pairs(world_triangles(ob))) == (not keeps_out)
        moved = mesh_io.column(ob.data.vertices, "co", 3)[len(ob.data.vertices) // 2 :, 2]
        assert moved.min() < 0.02


def update(ob):
    ob.update_tag()
    bpy.context.view_layer.update()


def test_a_guard_keeps_large_faces_from_crossing():
    angles = np.arange(12) * np.pi / 6
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1)
    vertices = np.concatenate([ring, ring + [0, 0, 0.01]])
    ob = add_object("plates", vertices, [range(12), range(12, 24)])
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    ob.tolvol.guard.sculpting = ob.tolvol.guard.crossings = True
    bpy.ops.object.mode_set(mode="SCULPT")
    update(ob)
    state = {kind: text for kind, text, _ in guard.states(ob)}
    assert state["sculpting"] == "Guarding both ways"
    for keeps_out in (True, False):
        ob.tolvol.guard.crossings = keeps_out
        update(ob)
        wish = mesh_io.column(ob.data.vertices, "co", 3)
        wish[0:12:3, 2] += 0.02
        ob.data.vertices.foreach_set("co", wish.ravel())
        update(ob)
        assert bool(pairs(world_triangles(ob))) == (not keeps_out)
