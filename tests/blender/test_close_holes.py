# SPDX-License-Identifier: GPL-3.0-or-later
"""Holes are closed before the decimation, in one step, and the new faces take their attributes from the rims."""

import json
import math

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh import mesh_io
from addon.mesh.mesh_io import column
from addon.proof import last_run
from addon.shared import filling
from addon.shared.proof import report
from addon.shared.surface import to_world
from commands import decimate, save, succeeded, world
from scenes import add_object, assert_within, sheet_arrays, torus_arrays, world_triangles

MISSING = (100, 101, 215, 430, 500, 777)
EVERYTHING = 10**6  # a target at which the decimation stops at once


def holed(name="holed", arrays=None, missing=MISSING):
    vertices, quads = arrays or sheet_arrays()
    return add_object(name, vertices, np.delete(quads, missing, axis=0))


def run_of(ob):
    return json.loads(ob.tolvol.last_run)


def loops_of(ob):
    arrays = mesh_io.read_mesh(ob.data)
    return native.module.solidity(arrays.vertices, arrays.triangles)["boundary_loops"]


def test_pinholes_close_and_far_fewer_triangles_are_left():
    counts = {}
    for close in (False, True):
        ob = holed()
        reference = world_triangles(ob)
        tolerance = 0.04 * native.module.diagonal(*reference)
        assert bpy.ops.tolvol.decimate(tolerance_length=tolerance, close_holes=close) == {"FINISHED"}
        assert_within(world_triangles(ob), reference, 1.00001 * tolerance)
        counts[close] = len(ob.data.polygons)
        holes = run_of(ob)["holes"]
        if close:
            # Two of the missing squares lie beside each other. The border of the sheet is a loop, too.
            assert holes["closed"] == 5 and holes["triangles_added"] == 4 + 4 * 2
            assert sum(holes["refused"].values()) == 1 and holes["largest_perimeter"] is None
            assert loops_of(ob) == 1
            assert report.counts(run_of(ob)).startswith("1,788 -> ")
            assert "5 holes closed, the longest rim 0.401, 1 left open: 1 " in report.counts(run_of(ob))
            assert (
                "5 holes closed, the longest rim 40.1\xa0cm" in last_run.remembered(ob.tolvol.last_run, bpy.context)[0]
            )
            assert "close_holes" in run_of(ob)["seconds"] and ob.tolvol.close_holes
        else:
            assert holes is None and loops_of(ob) == 6
            assert "hole" not in report.counts(run_of(ob)) and not ob.tolvol.close_holes
    assert counts[True] < counts[False] / 2


def rims(arrays, missing, matrix):
    """Returns {centre: perimeter} of holes of one square each, in the world."""
    corners = to_world(arrays[0], np.array(matrix))[arrays[1][list(missing)]]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).sum(1)
    return {tuple(np.round(centre, 5)): side for centre, side in zip(corners.mean(1), sides)}


@pytest.mark.usefixtures("measured_once")
def test_the_report_says_where_holes_were_closed(tmp_path, monkeypatch):
    arrays, missing = sheet_arrays(), (100, 215, 430, 500)
    matrix = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.7, 4, (1, 2, 3)) @ Matrix.Scale(10, 4)
    ob = add_object("placed", arrays[0], np.delete(arrays[1], missing, axis=0), matrix)
    bpy.context.view_layer.update()
    expected = rims(arrays, missing, matrix)
    monkeypatch.setattr(filling, "MOST_PLACES", 3)
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True)
    holes = run_of(ob)["holes"]
    assert holes["closed"] == 4 and len(holes["places"]) == 3, "the number of places is limited, the count is not"
    lengths = [place["perimeter"] for place in holes["places"]]
    assert lengths == pytest.approx(sorted(expected.values(), reverse=True)[:3], rel=1e-6)
    for place, centre in zip(holes["places"], sorted(expected, key=expected.get, reverse=True)):
        assert place["centre"] == pytest.approx(centre, abs=1e-4)
    for extension in (".csv", ".html"):
        bpy.ops.tolvol.save_report(filepath=str(tmp_path / f"report{extension}"))
    table = (tmp_path / "report.csv").read_text()
    assert ",a holes closed,,4," in table and ",a holes left open," in table
    x, _, z = holes["places"][2]["centre"]
    assert f",a hole 3 centre,x,{x!r}," in table and f",a hole 3 centre,z,{z!r}," in table
    assert f",a hole 1 perimeter,,{lengths[0]!r}," in table and "hole 4" not in table
    assert f"4 holes closed, the longest rim {lengths[0]:.4g}\xa0m" in (tmp_path / "report.html").read_text()


def test_the_report_of_a_file_has_the_places_of_all_objects(tmp_path):
    arrays = sheet_arrays()
    aside = arrays[0] * np.float32([2, 2, 1]) + np.float32([5, 0, 0])
    meshes = [
        (name, co, np.delete(arrays[1], hole, axis=0))
        for name, co, hole in (("one", arrays[0], 430), ("two", aside, 500))
    ]
    path, told = save(tmp_path / "in.obj", *meshes), tmp_path / "report.json"
    succeeded(decimate(path, tmp_path / "out.obj", "--tolerance", "4%", "--close-holes", "--report", told))
    run = json.loads(told.read_text())
    expected = {}
    for co, hole in ((arrays[0], 430), (aside, 500)):
        expected |= rims((co, arrays[1]), (hole,), np.eye(4))
    assert run["holes"]["closed"] == 2
    assert [place["perimeter"] for place in run["holes"]["places"]] == pytest.approx(
        sorted(expected.values(), reverse=True), rel=1e-4
    )
    for place, centre in zip(run["holes"]["places"], sorted(expected, key=expected.get, reverse=True)):
        assert place["centre"] == pytest.approx(centre, abs=1e-4)


def test_places_of_a_damaged_file_are_none():
    ob = holed()
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True)
    run = run_of(ob)
    assert last_run.remembered_holes(json.dumps(run)) == run["holes"]
    for places in (3, [3], [{}], [{"perimeter": 1}], [{"perimeter": "long", "centre": [0, 0, 0]}]):
        damaged = json.dumps(run | {"holes": run["holes"] | {"places": places}})
        assert last_run.remembered_holes(damaged) is None, places
    del run["holes"]["places"]  # as in a run of an earlier version
    assert last_run.remembered_holes(json.dumps(run)) == run["holes"]


def test_the_largest_perimeter_leaves_longer_holes_open():
    ob = holed()
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True, largest_perimeter=0.35)
    run = run_of(ob)
    assert run["holes"]["closed"] == 4 and run["holes"]["refused"] == {"perimeter": 2}
    assert run["holes"]["largest_perimeter"] == pytest.approx(0.35)
    assert "4 holes closed, the longest rim 0.268, 2 left open: 2 beyond Largest Perimeter" in report.counts(run)
    assert loops_of(ob) == 2


def test_no_hole_closes_at_vertices_of_weight_zero():
    ob = holed()
    group = ob.vertex_groups.new(name="Loose")
    group.add([v.index for v in ob.data.vertices if v.co.x > 0], 1, "REPLACE")
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True, vertex_group="Loose")
    holes = run_of(ob)["holes"]
    # The border of the sheet is turned away, as it is without weights.
    assert holes["closed"] == 2 and holes["refused"] == {"outside": 3, "turned": 1}


def test_the_angle_of_normals_holds_for_closed_holes():
    ob = holed()
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True, max_normal_angle=math.radians(1))
    assert run_of(ob)["holes"]["refused"]["turned"] > 0


def test_holes_at_unselected_faces_stay():
    ob = holed()
    middles = column(ob.data.polygons, "center", 3)
    mesh_io.select_faces(ob.data, middles[:, 0] < 0)
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True, only_selected=True)
    holes = run_of(ob)["holes"]
    # A face at the rim of one of the three is in the middle, and is not selected.
    assert holes["closed"] == 2 and holes["refused"]["unselected"] == 3
    assert loops_of(ob) == 4
    assert "3 at unselected faces" in report.counts(run_of(ob))


def test_it_is_one_undo_step():
    ob = holed()
    before = world_triangles(ob)
    bpy.ops.ed.undo_push()
    bpy.ops.tolvol.decimate("EXEC_DEFAULT", True, tolerance_percent=4, close_holes=True)
    assert loops_of(bpy.context.active_object) == 1
    bpy.ops.ed.undo()
    after = world_triangles(bpy.context.active_object)
    assert np.array_equal(before[0], after[0]) and np.array_equal(before[1], after[1])


def with_attributes():
    """A sheet with holes, whose attributes all depend on the place."""
    ob = holed()
    mesh = ob.data
    places = column(mesh.vertices, "co", 3)[column(mesh.loops, "vertex_index", 1, np.int32)]
    layer = mesh.uv_layers.new(name="UV")
    layer.data.foreach_set("uv", (places[:, :2] * (2, 3)).astype(np.float32).ravel())
    colour = mesh.attributes.new("Colour", "FLOAT_COLOR", "CORNER")
    colour.data.foreach_set("color", np.hstack([places, np.ones((len(places), 1))]).astype(np.float32).ravel())
    label = mesh.attributes.new("label", "INT", "CORNER")
    label.data.foreach_set("value", column(mesh.loops, "vertex_index", 1, np.int32))
    for name in ("left", "right"):
        mesh.materials.append(bpy.data.materials.new(name))
    middles = column(mesh.polygons, "center", 3)
    mesh.polygons.foreach_set("material_index", (middles[:, 0] > 0).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", middles[:, 1] > 0)
    group = ob.vertex_groups.new(name="weights")
    for vertex in mesh.vertices:
        group.add([vertex.index], float(vertex.co.x + 1) / 2, "REPLACE")
    return ob


@pytest.mark.parametrize("placement", ["SUBSET", "OPTIMAL"])
def test_the_new_faces_take_their_attributes_from_the_rim(placement):
    ob = with_attributes()
    polygons = len(ob.data.polygons)
    bpy.ops.tolvol.decimate(
        tolerance_percent=4, close_holes=True, target_triangles=EVERYTHING, placement=placement, keep="BOTH"
    )
    mesh, run = ob.data, run_of(ob)
    assert run["stopped_by"] == "target" and run["holes"]["closed"] == 5
    assert len(mesh.polygons) == 2 * polygons + 12
    vertices = column(mesh.loops, "vertex_index", 1, np.int32)
    places = column(mesh.vertices, "co", 3)[vertices]
    assert np.allclose(column(mesh.uv_layers["UV"].data, "uv", 2), places[:, :2] * (2, 3), atol=1e-6)
    assert np.allclose(column(mesh.attributes["Colour"].data, "color", 4)[:, :3], places, atol=1e-6)
    assert np.array_equal(column(mesh.attributes["label"].data, "value", 1, np.int32), vertices)
    middles = column(mesh.polygons, "center", 3)
    apart = np.abs(middles[:, :2]) > 0.1  # near the axes a new face may be like either side
    material = column(mesh.polygons, "material_index", 1, np.int32)
    assert np.array_equal(material[apart[:, 0]], (middles[:, 0] > 0)[apart[:, 0]])
    smooth = column(mesh.polygons, "use_smooth", 1, bool)
    assert np.array_equal(smooth[apart[:, 1]], (middles[:, 1] > 0)[apart[:, 1]])
    for vertex in mesh.vertices:
        assert vertex.groups[0].weight == pytest.approx((vertex.co.x + 1) / 2, abs=1e-6)


def test_attributes_of_a_decimated_mesh_with_closed_holes():
    ob = with_attributes()
    reference = world_triangles(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=2, close_holes=True, placement="OPTIMAL")
    mesh = ob.data
    assert len(mesh.polygons) < 200
    places = column(mesh.vertices, "co", 3)[column(mesh.loops, "vertex_index", 1, np.int32)]
    uv = column(mesh.uv_layers["UV"].data, "uv", 2)
    assert np.abs(uv - places[:, :2] * (2, 3)).max() < 0.1
    assert_within(world_triangles(ob), reference, 1.00001 * 0.02 * native.module.diagonal(*reference))


def test_islands_of_a_uv_map_that_meet_at_a_hole_stay_apart():
    ob = holed(missing=(430, 431, 460, 461, 435, 465, 440, 470, 200))
    mesh = ob.data
    places = column(mesh.vertices, "co", 3)[column(mesh.loops, "vertex_index", 1, np.int32)]
    right = np.repeat(column(mesh.polygons, "center", 3)[:, 0] > 0, 4)
    layer = mesh.uv_layers.new(name="UV")
    uvs = places[:, :2] + np.stack([10 * right, 0 * right], 1)
    layer.data.foreach_set("uv", uvs.astype(np.float32).ravel())
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True, placement="OPTIMAL")
    assert run_of(ob)["holes"]["closed"] == 4
    vertices = column(mesh.loops, "vertex_index", 1, np.int32)
    offset = (column(mesh.uv_layers["UV"].data, "uv", 2) - column(mesh.vertices, "co", 3)[vertices][:, :2])[:, 0]
    island = np.round(offset / 10).reshape(-1, 3)
    mixed = (island != island[:, :1]).any(1)
    # Only faces within the three holes on the seam take their corners from both sides.
    middles = column(mesh.polygons, "center", 3)[mixed]
    assert len(middles) <= 3 * 8 and (np.abs(middles[:, 0]) < 0.08).all()
    assert np.abs(offset.reshape(-1, 3)[~mixed] - 10 * island[~mixed]).max() < 0.1
    assert len(mesh.polygons) < 120


def test_n_gons_and_several_objects():
    """Faces of more than four corners beside holes, and two objects in one step."""
    objects = [holed("one"), holed("two", torus_arrays(), (3, 700))]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.dissolve_limited(angle_limit=0.05)
    bpy.ops.object.mode_set(mode="OBJECT")
    for ob in objects:
        ob.select_set(True)
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True)
    assert run_of(objects[0])["holes"]["closed"] == 5
    assert run_of(objects[1])["holes"] == {
        "closed": 2,
        "triangles_added": run_of(objects[1])["holes"]["triangles_added"],
        "refused": {},
        "places": run_of(objects[1])["holes"]["places"],
        "largest_perimeter": None,
        "max_normal_angle": None,
    }
    assert loops_of(objects[1]) == 0


@pytest.mark.usefixtures("measured_once")
def test_save_report_tells_it(tmp_path):
    ob = holed()
    bpy.ops.tolvol.decimate(tolerance_percent=4, close_holes=True)
    for name in ("report.json", "report.html"):
        bpy.ops.tolvol.save_report(filepath=str(tmp_path / name))
    assert json.loads((tmp_path / "report.json").read_text())["a"]["holes"] == run_of(ob)["holes"]
    longest = run_of(ob)["holes"]["places"][0]["perimeter"]
    page = (tmp_path / "report.html").read_text()
    assert f"; 5 holes closed, the longest rim {longest:.4g}\xa0m, 1 left open: 1 " in page
    # Of a mesh that has changed since, the last decimation tells nothing.
    ob.data.vertices[0].co.z += 0.001
    bpy.ops.tolvol.save_report(filepath=str(tmp_path / "report.json"))
    assert "holes" not in json.loads((tmp_path / "report.json").read_text())["a"]


def test_on_the_command_line(tmp_path):
    vertices, quads = torus_arrays()
    tube = np.delete(quads, np.r_[0:24, 300:306, 700, 900], axis=0)
    path = save(tmp_path / "in.ply", ("in", vertices, tube))
    out, told = tmp_path / "out.ply", tmp_path / "report.json"
    plain = succeeded(decimate(path, out, "--tolerance", "3%"))
    done = succeeded(decimate(path, out, "--tolerance", "3%", "--close-holes", "--report", told))
    assert "holes closed" in done[3] and "hole" not in (plain[3] or "")
    holes = json.loads(told.read_text())["holes"]
    assert holes["closed"] == len(holes["places"]) >= 2
    assert_within(world(out), world(path), 0.03001 * native.module.diagonal(*world(path)))
    limited = succeeded(
        decimate(path, out, "--tolerance", "3%", "--close-holes", "--largest-perimeter", "0.01%", "--report", told)
    )
    holes = json.loads(told.read_text())["holes"]
    assert holes["closed"] == 0 and "beyond Largest Perimeter" in limited[3]
    assert holes["largest_perimeter"] == pytest.approx(1e-4 * native.module.diagonal(*world(path)), rel=1e-3)
    code, _, error = decimate(path, out, "--tolerance", "3%", "--largest-perimeter", "1")
    assert code == 2 and "--largest-perimeter needs --close-holes" in error
    code, _, error = decimate(path, out, "--tolerance", "3%", "--close-holes", "--largest-perimeter", "-1")
    assert code == 2 and "--largest-perimeter" in error
