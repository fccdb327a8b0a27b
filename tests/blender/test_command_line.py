# SPDX-License-Identifier: GPL-3.0-or-later
"""decimate.py and report.py as a user runs them: the files, the exit codes and the last line of the output."""

import json
import re

import bpy
import numpy as np
import pytest

from addon import native
from addon.files import file_io
from commands import SCRIPTS, command, decimate, save, succeeded, world
from scenes import assert_within, sheet_arrays, torus_arrays

# Decimating ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("extension", [".ply", ".obj", ".stl"])
def test_result_is_within_as_the_file_that_was_written(tmp_path, extension):
    source = save(tmp_path / f"in{extension}", ("torus", *torus_arrays()))
    target, report = tmp_path / f"out{extension}", tmp_path / "report.json"
    match = succeeded(decimate(source, target, "--tolerance", "1%", "--report", report, alone=True))
    reference, stored = world(source), world(target)
    tolerance = 0.01 * native.module.diagonal(*reference)
    assert_within(stored, reference, tolerance)
    run = json.loads(report.read_text())
    assert run["tolerance"] == {"absolute": pytest.approx(tolerance, rel=1e-6), "percent": pytest.approx(1)}
    for way, pair in (("forward", (stored, reference)), ("backward", (reference, stored))):
        judged = native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance)
        assert judged.upper <= tolerance and judged.lower <= run[way][1] <= tolerance and run[way][0] <= judged.upper
    assert run["input"] == {
        "file": str(source),
        "vertices": len(np.unique(reference[1])),
        "triangles": len(reference[1]),
    }
    assert run["output"] == {"file": str(target), "vertices": len(np.unique(stored[1])), "triangles": len(stored[1])}
    assert match[1].replace(",", "") == str(len(reference[1])) and match[2] == str(len(stored[1]))
    assert len(stored[1]) < 700
    assert run.keys() >= {"version", "two_sided", "placement", "method", "renderer", "precision", "repairs", "objects"}
    *stages, total = run["seconds"].items()
    assert {stage for stage, _ in stages} == {"read", "transfer", "field", "decimate", "certify", "write"}
    assert total == ("total", pytest.approx(sum(took for _, took in stages))) and min(took for _, took in stages) > 0
    assert (run["two_sided"], run["placement"], run["method"]) == (True, "optimal", "certificate")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([source.name, target.name, "report.json"])


def test_last_line_says_what_the_report_says(scan, tmp_path):
    report = tmp_path / "report.json"
    match = succeeded(decimate(scan, tmp_path / "out.ply", "--tolerance", "0.03", "--report", report))
    run = json.loads(report.read_text())
    assert float(match[5]) == run["tolerance"]["absolute"] == 0.03
    size = 100 * run["tolerance"]["absolute"] / run["tolerance"]["percent"]
    for group, way in ((6, "forward"), (7, "backward")):
        # Rounded up in the third digit.
        assert 0 <= float(match[group]) / (100 * run[way][1] / size) - 1 < 0.01


def test_one_sided_placement_target_threads_and_effort(scan, tmp_path):
    reports = {}
    for name, extra in {
        "plain": [],
        "one-sided": ["--one-sided"],
        "subset": ["--placement", "subset"],
        "target": ["--target-triangles", "900"],
        "out of reach": ["--target-triangles", "4"],
        "threads": ["--threads", "1"],
        "thorough": ["--effort", "thorough"],
    }.items():
        match = succeeded(
            decimate(scan, tmp_path / "out.ply", "--tolerance", "1%", "--report", tmp_path / "r.json", *extra)
        )
        reports[name] = json.loads((tmp_path / "r.json").read_text()), match[3], world(tmp_path / "out.ply")
    plain = reports["plain"][0]["output"]["triangles"]
    assert reports["one-sided"][0]["two_sided"] is False
    # One way asks for less and leaves fewer triangles, but another order of collapses may change counts by up to 4 %.
    assert reports["one-sided"][0]["output"]["triangles"] <= 1.04 * plain
    assert reports["one-sided"][0]["backward"] != reports["plain"][0]["backward"]
    originals = {vertex.tobytes() for vertex in world(scan)[0]}
    assert all(vertex.tobytes() in originals for vertex in reports["subset"][2][0])
    assert not all(vertex.tobytes() in originals for vertex in reports["plain"][2][0])
    assert 850 <= reports["target"][0]["output"]["triangles"] <= 900 and reports["target"][1] is None
    assert reports["out of reach"][1] == "target 4 not reached within the tolerance"
    assert np.array_equal(reports["threads"][2][0], reports["plain"][2][0])
    assert reports["thorough"][0]["output"]["triangles"] < plain
    assert [reports[name][0]["effort"] for name in ("plain", "thorough")] == ["fast", "thorough"]


def test_a_time_limit_is_for_both_efforts(scan, tmp_path):
    arguments = scan, tmp_path / "out.ply", "--tolerance", "2%", "--max-seconds", "60"
    succeeded(decimate(*arguments))
    succeeded(decimate(*arguments, "--effort", "thorough"))


def test_another_file_as_reference(scan, tmp_path):
    fine = save(tmp_path / "fine.ply", ("fine", *torus_arrays(seed=2, around=64, across=32)))
    succeeded(decimate(fine, tmp_path / "out.ply", "--tolerance", "0.04", "--reference", scan))
    assert_within(world(tmp_path / "out.ply"), world(scan), 0.04)


def test_faces_outside_are_refused_or_kept(scan, tmp_path):
    vertices, quads = torus_arrays()
    vertices[100] *= 1.3
    bent = save(tmp_path / "bent.ply", ("bent", vertices, quads))
    code, _, err = decimate(bent, tmp_path / "out.ply", "--tolerance", "1%", "--reference", scan)
    assert code == 2 and re.search(r"\d+ faces are not within the tolerance.* first is face \d+", err)
    assert not (tmp_path / "out.ply").exists()
    arguments = bent, tmp_path / "out.ply", "--tolerance", "1%", "--reference", scan, "--outside", "keep"
    match = succeeded(decimate(*arguments, "--report", tmp_path / "r.json"))
    assert re.fullmatch(r"\d+ faces outside kept", match[3])
    run = json.loads((tmp_path / "r.json").read_text())
    assert run["outside"]["rest"][1] <= run["tolerance"]["absolute"] < run["forward"][1]
    stored = world(tmp_path / "out.ply")
    assert vertices[100].astype(np.float64).tobytes() in {vertex.tobytes() for vertex in stored[0]}


@pytest.mark.parametrize("extension", [".obj", ".ply"])
def test_file_of_several_objects(tmp_path, extension):
    vertices, quads = torus_arrays()
    small = vertices * 0.002 + np.float32(2)  # smaller than the tolerance of the whole
    objects = (("Zebra", vertices, quads), ("Alpha", *sheet_arrays()), ("screw", small.astype(np.float32), quads))
    source, target = save(tmp_path / "in.obj", *objects), tmp_path / f"out{extension}"
    succeeded(decimate(source, target, "--tolerance", "1%", "--report", tmp_path / "r.json"))
    reference = world(source)
    run = json.loads((tmp_path / "r.json").read_text())
    assert run["tolerance"]["absolute"] == pytest.approx(0.01 * native.module.diagonal(*reference), rel=1e-6)
    assert sorted(part["name"] for part in run["objects"]) == ["Alpha", "Zebra", "screw"]
    assert sum(part["output"]["triangles"] for part in run["objects"]) == run["output"]["triangles"]
    assert_within(world(target), reference, run["tolerance"]["absolute"])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    names = sorted(ob.name for ob in file_io.read_file(target).objects)
    assert names == (["Alpha", "Zebra", "screw"] if extension == ".obj" else ["out"])


def test_materials_uvs_and_textures_of_an_obj(tmp_path):
    vertices, quads = sheet_arrays(count=20)
    lines = ["mtllib in.mtl", "o sheet", *("v %f %f %f" % tuple(v) for v in vertices)]
    lines += ["vt %f %f" % (v[0] / 2 + 0.5, v[1] / 2 + 0.5) for v in vertices]
    lines += ["usemtl red", *("f " + " ".join(f"{i + 1}/{i + 1}" for i in quad) for quad in quads)]
    (tmp_path / "in.obj").write_text("\n".join(lines) + "\n")
    (tmp_path / "in.mtl").write_text("newmtl red\nKd 1 0 0\nmap_Kd skin.png\n")
    image = bpy.data.images.new("skin", 4, 4)
    image.filepath_raw, image.file_format = str(tmp_path / "skin.png"), "PNG"
    image.save()
    match = succeeded(decimate(tmp_path / "in.obj", tmp_path / "out.obj", "--tolerance", "0.5%"))
    assert int(match[2]) < 200
    assert "mtllib out.mtl" in (tmp_path / "out.obj").read_text()
    assert "map_Kd skin.png" in (tmp_path / "out.mtl").read_text()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    (ob,) = file_io.read_file(tmp_path / "out.obj").objects
    assert [material.name for material in ob.data.materials] == ["red"]
    for loop, uv in zip(ob.data.loops, ob.data.uv_layers[0].data):
        place = ob.data.vertices[loop.vertex_index].co
        assert np.allclose(uv.uv, (place[0] / 2 + 0.5, place[1] / 2 + 0.5), atol=2e-6)
        assert np.abs(vertices - place).max(1).min() < 2e-6  # with UVs the default is original vertices


def test_in_may_be_out(scan):
    before = world(scan)
    succeeded(decimate(scan, scan, "--tolerance", "1%"))
    assert_within(world(scan), before, 0.01 * native.module.diagonal(*before))


def test_repeated_faces_are_counted(tmp_path):
    vertices, quads = torus_arrays()
    lines = ["v %f %f %f" % tuple(v) for v in vertices]
    lines += ["f " + " ".join(str(i + 1) for i in quad) for quad in [*quads, *quads[:7]]]
    (tmp_path / "in.obj").write_text("\n".join(lines) + "\n")
    code, out, _ = decimate(
        tmp_path / "in.obj", tmp_path / "out.obj", "--tolerance", "1%", "--report", tmp_path / "r.json"
    )
    assert code == 0 and "note: 7 faces that repeat" in out
    assert json.loads((tmp_path / "r.json").read_text())["repairs"][0]["count"] == 7


def test_help():
    code, out, err = decimate("--help", alone=True)
    assert code == 0 and err == "" and "--tolerance" in out


# Not proved, and bugs -----------------------------------------------------------------------------------------------

PATCH = f"""
import sys
sys.path[:0] = [{str(SCRIPTS.parent)!r}, {str(SCRIPTS)!r}]
import blender_files
write = blender_files.write
def spoiled(path, objects, folder):
    {{}}; write(path, objects, folder)
patch(blender_files, "write", spoiled)
"""


def test_file_that_is_not_what_was_certified_is_not_published(scan, tmp_path):
    target = tmp_path / "out.ply"
    target.write_text("kept")
    spoil = PATCH.format("objects[0].data.vertices[5].co *= 1.1; objects[0].data.update()")
    code, _, err = decimate(scan, target, "--tolerance", "1%", "--report", tmp_path / "r.json", patches=spoil)
    assert code == 3 and len(err.splitlines()) == 1
    assert re.search(r"Not proved: the result is between [\d.]+ % and [\d.]+ % of the size from the reference", err)
    assert target.read_text() == "kept" and not (tmp_path / "r.json").exists() and not list(tmp_path.glob(".tolvol*"))


def test_a_bug_exits_with_1_and_its_traceback(scan, tmp_path):
    code, _, err = decimate(scan, tmp_path / "out.ply", "--tolerance", "1%", patches=PATCH.format("1 / 0"))
    assert code == 1 and "ZeroDivisionError" in err
    assert not (tmp_path / "out.ply").exists() and not list(tmp_path.glob(".tolvol*"))


def test_a_bug_inside_the_operator_is_a_bug(scan, tmp_path):
    spoil = PATCH.format("pass") + "from addon.mesh import transfer; patch(transfer, 'Writing', None)"
    code, _, err = decimate(scan, tmp_path / "out.ply", "--tolerance", "1%", patches=spoil)
    assert code == 1 and "TypeError" in err


# report.py ----------------------------------------------------------------------------------------------------------


def test_report_of_two_plates(tmp_path):
    vertices, quads = sheet_arrays(count=10, bumps=0.0)
    flat = save(tmp_path / "flat.ply", ("flat", vertices, quads))
    raised = vertices + np.where(vertices[:, :1] > 0.15, np.float32(0.1), np.float32(0)) * np.array(
        [0, 0, 1], np.float32
    )
    bent = save(tmp_path / "bent.ply", ("bent", raised, quads))
    code, out, err = command(
        "report.py", bent, flat, "--bounds", "1%,0.05", "--report", tmp_path / "r.json", alone=True
    )
    assert (code, err) == (0, "")
    result = json.loads((tmp_path / "r.json").read_text())
    assert result["size"] == pytest.approx(8**0.5)
    forward = result["forward"]
    assert forward["largest"][0] <= 0.1 + 1e-7 and 0.1 - 1e-7 <= forward["largest"][1] <= 0.1011
    # 0.8 of 2 wide at height 0.1, then a slope 0.2 wide.
    slope = (0.2**2 + 0.1**2) ** 0.5
    area = 1.0 + 0.8 + slope
    assert forward["mean"] == pytest.approx((0.8 * 0.1 + slope * 0.05) / area, rel=0.02)
    assert forward["rms"] == pytest.approx(((0.8 * 0.01 + slope * 0.01 / 3) / area) ** 0.5, rel=0.02)
    for bound, entry in zip((0.01 * 8**0.5, 0.05), forward["beyond"]):
        assert entry["bound"] == pytest.approx(bound)
        assert entry["share"] == pytest.approx((0.8 + slope * (1 - bound / 0.1)) / area, abs=0.01)
    assert result["backward"]["largest"][1] > 0.05
    assert [line[:6] for line in out.splitlines()][-2:] == ["A from", "B from"]


def test_report_refuses_bad_bounds_and_files(scan, tmp_path):
    for arguments, word in (
        ((scan, scan, "--bounds", "1%,x"), "'x'"),
        ((scan, scan, "--bounds", ","), "no bound"),
        ((scan, tmp_path / "no.ply"), "no.ply"),
        ((scan,), "B"),
        ((scan, ""), "name of the file is empty"),
        ((scan, scan, "--report", ""), "--report"),
        ((scan, scan, "--picture", ""), "name of the file is empty"),
    ):
        code, _, err = command("report.py", *arguments)
        assert code == 2 and word in err and len(err.splitlines()) == 1
