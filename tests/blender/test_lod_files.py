# SPDX-License-Identifier: GPL-3.0-or-later
"""decimate.py --lod and --lod-pixels: a file for each level, each proved as it is on the disk, and all files or none."""

import json
import math

import pytest

from addon import native
from addon.shared.files import gltf_check
from commands import LINE, decimate, save, succeeded, world
from gltf_files import SQUARE, document, needs_gltf, picture, write
from scenes import torus_arrays
from test_command_line import PATCH
from written import FAILING_REPLACE, failed, names, painted, unchanged


def lines(done, count):
    """Returns the matches of the last lines of a command that has succeeded, one for each level."""
    code, out, err = done
    assert (code, err) == (0, ""), (out, err)
    found = [line.split(": ", 1) for line in out.splitlines()[-count:]]
    return {name: LINE.fullmatch(line) for name, line in found}


def nodes(path):
    return gltf_check.parts(path.read_bytes())[0]["nodes"]


def judged(path, reference, tolerance):
    found = native.module.hausdorff(*world(path), *reference, bound=tolerance)
    assert found.upper <= tolerance
    return found


@pytest.mark.parametrize("extension", [".ply", ".obj"])
def test_each_level_is_the_file_of_a_run_of_its_own(scan, tmp_path, extension):
    out, report = tmp_path / f"out{extension}", tmp_path / "report.json"
    done = decimate(scan, out, "--lod", "0.2%,1%,3%", "--report", report)
    levels = [f"out_LOD{i}{extension}" for i in range(3)]
    assert list(lines(done, 3)) == levels
    assert names(tmp_path) == sorted([*levels, "report.json", "scan.ply"])
    run, reference = json.loads(report.read_text()), world(scan)
    size = native.module.diagonal(*reference)
    assert run.keys() == {"version", "levels", "seconds"}
    for level, percent, name in zip(run["levels"], (0.2, 1, 3), levels):
        found = judged(tmp_path / name, reference, percent / 100 * size)
        assert found.lower <= level["geometricError"] <= percent / 100 * size
        assert level["geometricError"] == max(level["forward"][1], level["backward"][1])
        alone = tmp_path / f"alone{extension}"
        succeeded(decimate(scan, alone, "--tolerance", f"{percent}%"))
        assert alone.read_bytes() == (tmp_path / name).read_bytes()
        assert level["output"]["file"] == str(tmp_path / name)
        assert level["output"]["triangles"] == len(world(alone)[1])
    seconds = [level["seconds"] for level in run["levels"]]
    for one in (*seconds, run["seconds"]):
        assert one["total"] == pytest.approx(sum(took for stage, took in one.items() if stage != "total"))
    assert run["seconds"]["total"] == pytest.approx(sum(one["total"] for one in seconds))


def test_by_pixels(scan, tmp_path):
    report = tmp_path / "report.json"
    view = ("--distance", 5, "--fov", 60, "--height", 500)
    lines(decimate(scan, tmp_path / "out.ply", "--lod-pixels", "2,8", *view, "--report", report), 2)
    for level, pixels in zip(json.loads(report.read_text())["levels"], (2, 8)):
        limit = pixels / 500 * 2 * 5 * math.tan(math.radians(30))
        assert level["tolerance"]["absolute"] == pytest.approx(limit, rel=1e-12)
        judged(level["output"]["file"], world(scan), limit)
    default = decimate(scan, tmp_path / "default.ply", "--lod-pixels", "1,2", "--distance", 5)
    limit = 2 * 5 * math.tan(math.radians(25)) / 1080
    assert float(lines(default, 2)["default_LOD0.ply"][5]) == pytest.approx(limit, rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--lod", "1%"), "argument --lod: '1%' is not a list of 2 to 6 values"),
        (("--lod", "1%,2%,3%,4%,5%,6%,7%"), "is not a list of 2 to 6 values"),
        (("--lod", "1%,x"), "argument --lod: 'x' is neither a length nor a percentage"),
        (("--lod", "1%,-2%"), "argument --lod: '-2%' is not a finite number above 0"),
        (("--lod", "1%,"), "argument --lod: '' is neither"),
        (("--lod", "1%,0.5%"), "--lod: level 1: 0.0180604 is not more than 0.0361209 of level 0"),
        (("--lod", "1%,200%"), "--lod: level 1: 7.22418 is more than the size of the reference"),
        (("--lod", "1%,2%", "--tolerance", "1%"), "not allowed with argument"),
        (("--lod", "1%,2%", "--distance", "3"), "--distance needs --lod-pixels"),
        (("--lod", "1%,2%", "--height", "3"), "--height needs --lod-pixels"),
        (("--lod", "1%,2%", "--one-sided"), "--one-sided cannot be used with levels of detail"),
        (("--lod", "1%,2%", "--target-triangles", "9"), "--target-triangles cannot be used with levels of detail"),
        (("--lod-pixels", "1,2"), "--lod-pixels needs --distance"),
        (("--lod-pixels", "1%,2", "--distance", "3"), "argument --lod-pixels: '1%' is not a plain number"),
        (("--lod-pixels", "1,2", "--distance", "3", "--fov", "180"), "--fov"),
        (("--lod-pixels", "2,1", "--distance", "3"), "--lod-pixels: level 1"),
    ],
)
def test_bad_options_are_refused_by_name(scan, tmp_path, arguments, said):
    with unchanged(tmp_path):
        failed(decimate(scan, tmp_path / "out.ply", *arguments), 2, said)


def test_all_files_or_none(scan, tmp_path):
    (tmp_path / "out_LOD0.ply").write_text("old")
    with unchanged(tmp_path):
        patches = FAILING_REPLACE.format(name="out_LOD1.ply")
        failed(decimate(scan, tmp_path / "out.ply", "--lod", "1%,2%", patches=patches), 1, "out_LOD1.ply")


def test_a_level_that_cannot_be_proved_leaves_no_file(scan, tmp_path):
    """The second file is changed after it was written."""
    spoil = PATCH.format('objects[0].data.vertices[5].co *= 1.1 if "LOD1" in str(path) else 1')
    with unchanged(tmp_path):
        done = decimate(scan, tmp_path / "out.ply", "--lod", "1%,2%", patches=spoil)
        failed(done, 3, "Not proved", "out_LOD1.ply was not written")


def test_a_level_must_not_be_a_file_that_is_read_unless_it_is_in(scan, tmp_path):
    reference = tmp_path / "out_LOD1.ply"
    reference.write_bytes(scan.read_bytes())
    with unchanged(tmp_path):
        done = decimate(scan, tmp_path / "out.ply", "--lod", "1%,2%", "--reference", reference)
        failed(done, 2, "out_LOD1.ply is the same file as --reference")
    done = decimate(reference, tmp_path / "out.ply", "--lod", "1%,2%")
    assert len(lines(done, 2)) == 2 and len(world(reference)[1]) < len(world(scan)[1])


def test_pictures_and_materials_of_each_level(tmp_path, gl):
    source = painted(tmp_path / "in.obj")
    done = decimate(source, tmp_path / "out.obj", "--lod", "1%,2%", "--picture", tmp_path / "p.png")
    assert len(lines(done, 2)) == 2
    pairs = [f"out_LOD{i}.{extension}" for i in range(2) for extension in ("mtl", "obj")]
    assert names(tmp_path) == sorted([*pairs, "in.mtl", "in.obj", "p_LOD0.png", "p_LOD1.png"])
    assert "mtllib out_LOD1.mtl" in (tmp_path / "out_LOD1.obj").read_text()


@needs_gltf
@pytest.mark.parametrize("extension", [".glb", ".gltf"])
def test_extras_of_gltf_hold_the_deviation(tmp_path, extension):
    source = save(tmp_path / "in.ply", ("torus", *torus_arrays()))
    report = tmp_path / "report.json"
    lines(decimate(source, tmp_path / f"out{extension}", "--lod", "1%,3%", "--report", report), 2)
    levels = json.loads(report.read_text())["levels"]
    for i, level in enumerate(levels):
        path = tmp_path / f"out_LOD{i}{extension}"
        (node,) = [node for node in nodes(path) if "mesh" in node]
        assert node["extras"].keys() == {"geometricError"}
        error = node["extras"]["geometricError"]
        found = judged(path, world(source), level["tolerance"]["absolute"])
        assert found.lower <= error <= 1.01 * found.upper
    plain = tmp_path / f"plain{extension}"
    succeeded(decimate(source, plain, "--tolerance", "1%"))
    assert not any("extras" in node for node in nodes(plain))


@needs_gltf
def test_levels_share_the_textures_beside_them(tmp_path):
    picture(tmp_path / "red.png", (1, 0, 0))
    write(tmp_path / "in.gltf", *document(uvs=SQUARE[:, :2], image="red.png"))
    (tmp_path / "to").mkdir()
    lines(decimate(tmp_path / "in.gltf", tmp_path / "to" / "out.gltf", "--lod", "1%,2%"), 2)
    pairs = [f"out_LOD{i}.{end}" for i in range(2) for end in ("bin", "gltf")]
    assert names(tmp_path / "to") == sorted([*pairs, "red.png"])
