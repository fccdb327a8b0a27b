# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol decimate, report and check as a user runs them: files, exit codes, messages, signals and the terminal."""

import contextlib
import csv
import json
import os
import pty
import re
import signal
import subprocess
import sys

import numpy as np
import pytest
import tolvol

import meshes
from commands import (
    ENVIRONMENT,
    LINE,
    WITHIN,
    assert_within,
    command,
    hanging,
    read,
    refused,
    scan,
    succeeded,
    words,
    write,
)


@pytest.fixture
def torus(tmp_path):
    return scan(tmp_path / "scan.ply")


# Decimating -----------------------------------------------------------------------------------------------------------


def test_the_file_on_the_disk_is_within_and_the_report_says_so(torus, tmp_path):
    target, report = tmp_path / "out.ply", tmp_path / "report.json"
    match = succeeded(command("decimate", torus, target, "--tolerance", "0.03", "--report", report))
    assert_within(target, torus, 0.03)
    run, mesh = json.loads(report.read_text()), read(target)
    assert run["tolerance"]["absolute"] == 0.03 == float(match[5])
    assert run["input"] == {"file": str(torus), "vertices": 1152, "triangles": 2304}
    assert run["output"] == {"file": str(target), "vertices": len(mesh.vertices), "triangles": len(mesh.triangles)}
    assert int(match[2]) == len(mesh.triangles) < 600
    *stages, total = run["seconds"].items()
    assert {stage for stage, _ in stages} == {"read", "transfer", "field", "decimate", "certify", "write"}
    assert total == ("total", pytest.approx(sum(took for _, took in stages)))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.ply", "report.json", "scan.ply"]


def test_options_have_their_effect(torus, tmp_path):
    found = {}
    for name, extra in {
        "plain": [],
        "one-sided": ["--one-sided"],
        "subset": ["--placement", "subset"],
        "target": ["--target-triangles", "900"],
        "thorough": ["--effort", "thorough"],
        "threads": ["--threads", "1"],
        "angle": ["--max-normal-angle", "20"],
        "crossings": ["--crossings", "allow"],
    }.items():
        out, report = tmp_path / f"{name}.ply", tmp_path / "r.json"
        succeeded(command("decimate", torus, out, "--tolerance", "2%", "--report", report, *extra))
        found[name] = json.loads(report.read_text()), read(out)
    plain = found["plain"][0]["output"]["triangles"]
    assert found["one-sided"][0]["two_sided"] is False and found["plain"][0]["two_sided"] is True
    originals = {vertex.tobytes() for vertex in read(torus).vertices}
    kept = {name: all(vertex.tobytes() in originals for vertex in mesh.vertices) for name, (_, mesh) in found.items()}
    assert kept["subset"] and not kept["plain"]
    assert 850 <= found["target"][0]["output"]["triangles"] <= 900
    assert found["thorough"][0]["output"]["triangles"] < plain and found["thorough"][0]["effort"] == "thorough"
    assert np.array_equal(found["threads"][1].vertices, found["plain"][1].vertices)
    assert found["angle"][0]["normals"]["largest"] <= 20 < found["plain"][0]["normals"]["largest"]


def test_another_reference_and_faces_outside(torus, tmp_path):
    mesh = read(torus)
    bent = mesh.vertices.copy()
    bent[100] *= 1.3
    source = write(tmp_path / "bent.ply", bent, mesh.triangles)
    arguments = "decimate", source, tmp_path / "out.ply", "--tolerance", "2%", "--reference", torus
    refused(command(*arguments), "faces are not within the tolerance")
    assert not (tmp_path / "out.ply").exists()
    match = succeeded(command(*arguments, "--outside", "keep"))
    assert re.fullmatch(r"\d+ faces outside kept", match[3])
    fine = scan(tmp_path / "fine.obj")
    succeeded(command("decimate", fine, tmp_path / "other.ply", "--tolerance", "0.05", "--reference", torus))
    assert_within(tmp_path / "other.ply", torus, 0.05)


def test_holes_are_closed_if_asked(torus, tmp_path):
    mesh = read(torus)
    holed = write(tmp_path / "holed.ply", mesh.vertices, np.delete(mesh.triangles, [200, 900], 0))
    arguments = "decimate", holed, tmp_path / "out.ply", "--tolerance", "5%"
    assert succeeded(command(*arguments))[3] is None
    match = succeeded(command(*arguments, "--close-holes", "--report", tmp_path / "r.json"))
    assert match[3].startswith("2 holes closed")
    assert json.loads((tmp_path / "r.json").read_text())["holes"]["closed"] == 2
    out = read(tmp_path / "out.ply")
    assert tolvol.solidity(out.vertices, out.triangles)["closed"]
    assert "2 left open" in succeeded(command(*arguments, "--close-holes", "--largest-perimeter", "0.001"))[3]


def test_levels_of_detail_come_each_from_in(torus, tmp_path):
    code, out, err = command("decimate", torus, tmp_path / "out.stl", "--lod", "1%,3%", "--report", tmp_path / "r.json")
    lines = out.splitlines()[-2:]
    assert (code, err) == (0, "") and all(LINE.fullmatch(line.partition(": ")[2]) for line in lines)
    levels = json.loads((tmp_path / "r.json").read_text())["levels"]
    for i, level in enumerate(levels):
        assert level["input"]["triangles"] == 2304
        assert_within(tmp_path / f"out_LOD{i}.stl", torus, level["tolerance"]["absolute"])
    seen = command(
        "decimate", torus, tmp_path / "p.ply", "--lod-pixels", "1,4", "--distance", "300%", "--height", "200"
    )
    assert seen[0] == 0 and (tmp_path / "p_LOD1.ply").exists()


def test_a_picture(gl, torus, tmp_path):
    picture = tmp_path / "p.png"
    succeeded(command("decimate", torus, tmp_path / "out.ply", "--tolerance", "2%", "--picture", picture))
    assert picture.read_bytes().startswith(b"\x89PNG")


# Files ----------------------------------------------------------------------------------------------------------------


def test_out_may_be_in_and_links_are_followed(torus, tmp_path):
    (tmp_path / "link.ply").symlink_to(torus)
    os.chmod(torus, 0o640)
    succeeded(command("decimate", torus, tmp_path / "link.ply", "--tolerance", "2%"))
    assert (tmp_path / "link.ply").is_symlink() and len(read(torus).triangles) < 2304
    assert torus.stat().st_mode & 0o777 == 0o640


def test_nothing_that_is_read_is_overwritten(torus, tmp_path):
    other = scan(tmp_path / "other.ply")
    before = torus.read_bytes(), other.read_bytes()
    for arguments in (
        (torus, other, "--reference", other),
        (torus, tmp_path / "out.ply", "--report", torus),
        (torus, torus, "--report", torus),
    ):
        refused(command("decimate", *arguments, "--tolerance", "1%"), "is the same file as")
    refused(
        command("report", torus, other, "--report", tmp_path / "x.json", "--report", tmp_path / "x.json"), "same file"
    )
    assert before == (torus.read_bytes(), other.read_bytes()) and not (tmp_path / "out.ply").exists()


def test_a_place_where_nothing_can_be_written_is_refused_before_the_work(torus, tmp_path):
    refused(command("decimate", torus, tmp_path / "none" / "out.ply", "--tolerance", "1%"), "OUT", "does not exist")
    (tmp_path / "folder.ply").mkdir()
    refused(command("decimate", torus, tmp_path / "folder.ply", "--tolerance", "1%"), "this is a folder")
    refused(command("decimate", torus, "/proc/out.ply", "--tolerance", "1%"), "OUT /proc/out.ply", code=1)


@pytest.mark.parametrize(
    "arguments, parts",
    [
        (["decimate", "IN"], ["the following arguments are required: OUT"]),
        (["decimate", "IN", "OUT"], ["--tolerance", "--lod", "is required"]),
        (["decimate", "IN", "OUT", "--tolerance", "x"], ["--tolerance", "'x' is neither a length nor a percentage"]),
        (["decimate", "IN", "OUT", "--tolerance", "-1%"], ["--tolerance", "'-1%' is not a finite number above 0"]),
        (["decimate", "IN", "OUT", "--tolerance", "nan"], ["--tolerance", "'nan' is not a finite number"]),
        (["decimate", "IN", "OUT", "--tolerance", "101%"], ["--tolerance", "is more than the size of the reference"]),
        (["decimate", "IN", "out.xyz", "--tolerance", "1%"], ["out.xyz: unknown extension .xyz"]),
        (["decimate", "none.ply", "OUT", "--tolerance", "1%"], ["none.ply: No such file or directory"]),
        (["decimate", "IN", "OUT", "--tolerance", "1%", "--fov", "50"], ["--fov needs --lod-pixels"]),
        (["decimate", "IN", "OUT", "--tolerance", "1%", "--largest-perimeter", "1"], ["needs --close-holes"]),
        (["check", "IN", "IN"], ["--tolerance"]),
        (["check", "IN", "IN", "--tolerance", "200%"], ["is more than the size of the reference"]),
        (["report", "IN", "IN", "--report", "x.txt"], ["'x.txt' does not end in .json, .csv, .html"]),
        (["nonsense"], ["invalid choice: 'nonsense'"]),
        ([], ["COMMAND"]),
    ],
)
def test_bad_usage_is_one_line(torus, tmp_path, arguments, parts):
    named = {"IN": torus, "OUT": tmp_path / "out.ply"}
    refused(command(*(named.get(word, word) for word in arguments)), "tolvol", *parts)
    assert not (tmp_path / "out.ply").exists()


# Measuring --------------------------------------------------------------------------------------------------------------


def test_check_passes_and_fails_in_both_directions(torus, tmp_path):
    mesh = read(torus)
    near = write(tmp_path / "near.obj", mesh.vertices + np.float32([0, 0, 0.01]), mesh.triangles)
    code, out, err = command("check", near, torus, "--tolerance", "0.011")
    assert (code, err) == (0, "") and out.startswith("PASS: tolerance ") and "(both ways, proved)" in out
    code, out, _ = command("check", near, torus, "--tolerance", "0.004")
    assert code == 3 and out.startswith("FAIL: ")
    # A part is within the whole, and the whole is not within the part.
    part = write(tmp_path / "part.stl", mesh.vertices, mesh.triangles[:1000])
    code, out, _ = command("check", part, torus, "--tolerance", "0.01")
    assert code == 3 and "(the reference)" in out
    assert out.startswith("note: part.stl: 3,000 corners were welded to ")
    code, out, _ = command("check", part, torus, "--tolerance", "0.01", "--one-sided")
    assert code == 0 and "(one way, proved)" in out


def test_report_writes_every_format_and_requires(tmp_path):
    torus = scan(tmp_path / "scan.ply", columns=24, rows=12)
    box = write(tmp_path / "box.ply", *(part.astype(np.float32) for part in meshes.box()))
    files = [tmp_path / f"r.{extension}" for extension in ("html", "csv", "json")]
    asked = [word for file in files for word in ("--report", file)]
    code, out, err = command(
        "report", torus, box, "--tolerance", "1%", "--bounds", "2%,3%", "--require", "closed,oriented", *asked
    )
    assert (code, err) == (0, "") and out.count("largest") == 2
    document = json.loads(files[2].read_text())
    pair = [(mesh.vertices.astype(np.float64), mesh.triangles) for mesh in map(read, (torus, box))]
    judged = tolvol.hausdorff(*pair[0], *pair[1])
    for way in ("forward", "backward"):
        lower, upper = document[way]["largest"]
        assert lower <= getattr(judged, way).upper and getattr(judged, way).lower <= upper
    assert document["verdict"] == "FAIL" and len(document["forward"]["beyond"]) == 3
    assert {row["quantity"] for row in csv.DictReader(files[1].open())} >= {"largest", "mean", "verdict"}
    assert "<svg" in files[0].read_text() and "scan.ply" in files[0].read_text()
    sheet = write(tmp_path / "sheet.stl", read(box).vertices, read(box).triangles[:4])
    done = command("report", sheet, box, "--require", "closed")
    refused(done, "A is not closed (1 boundary loop)", code=3)
    assert "note: sheet.stl: 12 corners were welded to " in done[1]


# Signals and the terminal -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_in_a_native_call_with_nothing_written(tmp_path, number):
    folder = tmp_path / "out"
    folder.mkdir()
    asked = "decimate", scan(tmp_path / "in.ply"), folder / "out.ply", "--tolerance", "1%"
    with hanging(tmp_path, 1, *asked) as (process, _):
        assert list(folder.iterdir())  # a temporary folder
        process.send_signal(number)
        _, err = process.communicate(timeout=WITHIN)
    assert (process.returncode, err) == (128 + number, f"tolvol: ended by {number.name}\n")
    assert not list(folder.iterdir())


def on_a_terminal(*arguments, until=None):
    """Runs the command with stderr on a terminal. Returns (exit code, stdout, what the terminal was sent).

    until: what the terminal is to show before SIGINT ends the command, or None.
    """
    terminal, end = pty.openpty()
    environment = ENVIRONMENT | {"TERM": "xterm"}
    process = subprocess.Popen(words(*arguments), stdout=subprocess.PIPE, stderr=end, env=environment)
    os.close(end)
    shown = b""
    with contextlib.suppress(OSError):  # The other end is closed.
        while chunk := os.read(terminal, 4096):
            shown += chunk
            if until and until in shown:
                process.send_signal(signal.SIGINT)
                until = None
    return process.wait(60), process.stdout.read().decode(), shown


def test_a_bar_on_a_terminal_and_none_in_a_pipe(torus, tmp_path):
    vertices, triangles = meshes.torus(columns=200, rows=100, noise=0.004)
    source = write(tmp_path / "in.ply", vertices.astype(np.float32), triangles)
    asked = "decimate", source, tmp_path / "out.ply", "--tolerance", "0.4%"
    code, out, shown = on_a_terminal(*asked)
    assert code == 0 and LINE.fullmatch(out.splitlines()[-1])
    assert b"decimating" in shown and b"triangles left" in shown and b"%" in shown
    code, out, shown = on_a_terminal(*asked, "--effort", "thorough", until=b"decimating")
    assert code == 130 and b"ended by SIGINT" in shown
    hidden, visible = (shown.rindex(word) for word in (b"\x1b[?25l", b"\x1b[?25h"))
    assert hidden < visible, "the cursor is visible again"
    assert command("decimate", torus, tmp_path / "out.ply", "--tolerance", "1%")[2] == ""


def test_a_missing_package_is_named(tmp_path):
    (tmp_path / "in.glb").write_bytes(b"glTF")
    code = "import sys; sys.modules['trimesh'] = None; from tolvol.command import run; sys.exit(run(sys.argv[1:]))"
    asked = [sys.executable, "-c", code, "check", tmp_path / "in.glb", tmp_path / "in.glb", "--tolerance", "1%"]
    done = subprocess.run(asked, capture_output=True, text=True, env=ENVIRONMENT)
    refused((done.returncode, done.stdout, done.stderr), "the package trimesh is missing: pip install trimesh")


def test_help_has_three_examples_of_every_command():
    for name in ("decimate", "report", "check", "batch"):
        code, out, _ = command(name, "--help")
        assert code == 0 and out.count(f"\n  tolvol {name} ") == 3 and "Exit codes:" in out
    code, out, _ = command("--help")
    assert code == 0 and "register-python-argcomplete" in out
    assert command("--version")[1] == f"tolvol {tolvol.__version__}\n"


def test_examples_are_understood():
    from tolvol.command import main

    top = main.parser()
    for examples in main._EXAMPLES.values():
        for line in examples.splitlines():
            arguments = [word.strip("'") for word in line.split("&&")[0].split()[1:]]
            assert top.parse(arguments).command == arguments[0]


@pytest.mark.parametrize("line, found", [("tolvol de", "decimate"), ("tolvol decimate a b --eff", "--effort")])
def test_the_shell_completes(tmp_path, line, found):
    answer = tmp_path / "answer"
    command(
        _ARGCOMPLETE="1",
        COMP_LINE=line,
        COMP_POINT=str(len(line)),
        _ARGCOMPLETE_STDOUT_FILENAME=str(answer),
    )
    assert answer.read_text().strip() == found
