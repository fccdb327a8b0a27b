# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol decimate with --memory, as a user runs it: files, resuming, and what is refused."""

import json
import os
import resource
import shutil
import signal
import subprocess
import time

import numpy as np
import pytest
from tolvol.command import large, main
from tolvol.shared.command.arguments import Stop
from tolvol.shared.errors import Refused
from tolvol.tiles import plan
from tolvol.tiles.mapped import MappedMesh

import meshes
from commands import ENVIRONMENT, assert_within, command, read, refused, scan, succeeded, words, write

TOLERANCE = 0.02
SMALL = f"{plan.FIXED + 800 * plan.OF_FIRST_IF_SHORT}"  # bytes, for at most 800 triangles in a cell


@pytest.fixture
def torus(tmp_path):
    return scan(tmp_path / "scan.ply", columns=64, rows=32)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The bytes of an uninterrupted run."""
    folder = tmp_path_factory.mktemp("whole")
    succeeded(decimate(scan(folder / "scan.ply", columns=64, rows=32), folder / "whole.ply", "--threads", "3"))
    return (folder / "whole.ply").read_bytes()


def decimate(source, target, *extra, memory=SMALL):
    return command("decimate", source, target, "--tolerance", TOLERANCE, "--memory", memory, *extra)


def test_the_file_is_within_and_the_report_tells_the_rounds(torus, tmp_path):
    out, report = tmp_path / "out.ply", tmp_path / "report.json"
    done = decimate(torus, out, "--report", report)
    match = succeeded(done)
    assert_within(out, torus, TOLERANCE)
    run, mesh = json.loads(report.read_text()), read(out)
    assert int(match[2].replace(",", "")) == len(mesh.triangles) == run["output"]["triangles"]
    assert run["input"] == {"file": str(torus), "triangles": 4096}
    cells, counts = zip(*((each["cells"], each["triangles"]) for each in run["rounds"]))
    assert cells[0] >= 6 and len(cells) >= 3 and counts[-1] == len(mesh.triangles)
    assert list(counts) == sorted(counts, reverse=True) and counts[0] > 2 * counts[-1]
    assert run["solidity"]["after"]["closed"] and run["solidity"]["after"]["crossing_pairs"] == 0
    assert run["forward"][1] <= TOLERANCE and run["backward"][1] <= TOLERANCE
    *stages, total = run["seconds"].items()
    assert {stage for stage, _ in stages} == {"read", "decimation", "certify", "write"}
    assert f"scratch folder {out}.tolvol" in done[1]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.ply", "report.json", "scan.ply"]


def test_enough_memory_is_one_round_and_thorough_leaves_fewer(tmp_path):
    torus, found = scan(tmp_path / "scan.ply", columns=32, rows=16), {}
    for name, extra in {"fast": [], "thorough": ["--effort", "thorough"], "subset": ["--placement", "subset"]}.items():
        out, report = tmp_path / f"{name}.ply", tmp_path / f"{name}.json"
        succeeded(decimate(torus, out, "--tolerance", 0.1, "--report", report, *extra, memory="1GB"))
        assert_within(out, torus, 0.1)
        assert [each["cells"] for each in json.loads(report.read_text())["rounds"]] == [1]
        found[name] = read(out)
    assert len(found["thorough"].triangles) < 0.9 * len(found["fast"].triangles)
    places = {tuple(p) for p in read(torus).vertices.tolist()}
    assert {tuple(p) for p in found["subset"].vertices.tolist()} <= places


def test_stl_and_float64_are_read_and_written(torus, tmp_path):
    mesh = read(torus)
    write(tmp_path / "scan.stl", mesh.vertices, mesh.triangles)
    write(tmp_path / "wide.ply", mesh.vertices.astype(np.float64) + 1e6, mesh.triangles)
    succeeded(decimate(tmp_path / "scan.stl", tmp_path / "out.stl"))
    succeeded(decimate(tmp_path / "scan.stl", tmp_path / "out.ply"))
    assert_within(tmp_path / "out.stl", torus, TOLERANCE)
    assert len(read(tmp_path / "out.stl").triangles) == len(read(tmp_path / "out.ply").triangles)
    succeeded(decimate(tmp_path / "wide.ply", tmp_path / "wide_out.ply"))
    assert read(tmp_path / "wide_out.ply").vertices.dtype == np.float64
    assert_within(tmp_path / "wide_out.ply", tmp_path / "wide.ply", TOLERANCE)
    refused(decimate(tmp_path / "wide.ply", tmp_path / "x.stl"), "float64", "use .ply for OUT")


def interrupted(torus, out, step, *extra):
    """Kills a run as soon as the record of a step is there, and returns its scratch folder."""
    folder = out.with_name(out.name + ".tolvol")
    arguments = words("decimate", torus, out, "--tolerance", TOLERANCE, "--memory", SMALL, *extra)
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=ENVIRONMENT)
    while not (folder / f"{step}.json").exists():
        assert process.poll() is None, process.stderr.read()
        time.sleep(0.001)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert folder.exists() and not out.exists()
    return folder


@pytest.mark.parametrize("step", ["run", "round0_00003", "measured_00001"])
def test_a_killed_run_goes_on_to_the_same_bytes_on_any_number_of_threads(torus, tmp_path, whole, step):
    out = tmp_path / "out.ply"
    folder = interrupted(torus, out, step, "--threads", "1")
    succeeded(decimate(torus, out, "--resume"))
    assert out.read_bytes() == whole and not folder.exists()


def test_only_the_same_run_goes_on(torus, tmp_path):
    out = tmp_path / "out.ply"
    folder = interrupted(torus, out, "round0_00001")
    refused(decimate(torus, out), folder, "go on with --resume, or remove the folder")
    larger = str(int(SMALL) + 500 * plan.OF_FIRST_IF_SHORT)
    refused(decimate(torus, out, "--resume", memory=larger), "--memory was", "run again as before", folder)
    refused(decimate(torus, out, "--resume", "--effort", "thorough"), "--effort was fast and is thorough now")
    os.utime(torus, (1, 1))
    refused(decimate(torus, out, "--resume"), "IN was", "written at")


def test_damaged_scratch_files_are_refused(torus, tmp_path):
    out = tmp_path / "out.ply"
    folder = interrupted(torus, out, "round0_00001")
    chunk = folder / "reference_00000"
    data = chunk.read_bytes()
    chunk.write_bytes(data[:-12])
    refused(decimate(torus, out, "--resume"), chunk, "is damaged: remove")
    chunk.write_bytes(data)
    for name in ("round0_00001.json", "cells0.json"):
        record = (folder / name).read_text()
        for damaged in ("{", "{}", json.dumps(json.loads(record) | {"record": {"boxes": []}})):
            (folder / name).write_text(damaged)
            refused(decimate(torus, out, "--resume"), f"{name} is damaged")
        (folder / name).write_text(record)
    assert not out.exists()


def test_two_runs_do_not_share_a_scratch_folder(torus, tmp_path):
    out, scratch = tmp_path / "out.ply", tmp_path / "scratch"
    arguments = words("decimate", torus, out, "--tolerance", TOLERANCE, "--memory", SMALL, "--scratch", scratch)
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, env=ENVIRONMENT)
    try:
        while not (scratch / "run.json").exists():
            time.sleep(0.001)
        process.send_signal(signal.SIGSTOP)
        refused(decimate(torus, tmp_path / "b.ply", "--scratch", scratch), scratch, "another run uses")
    finally:
        process.send_signal(signal.SIGCONT)
    assert process.wait() == 0 and not scratch.exists()


def test_a_run_that_was_killed_in_its_first_record_can_be_repeated(torus, tmp_path):
    scratch = tmp_path / "scratch"
    for extra in ((), ("--resume",)):
        scratch.mkdir()
        (scratch / "run.0123456789abcdef.partial").write_text('{"')
        succeeded(decimate(torus, tmp_path / "out.ply", "--scratch", scratch, *extra))
        assert not scratch.exists()


def test_what_cannot_be_done_is_refused_before_any_work(torus, tmp_path):
    out = tmp_path / "out.ply"
    other = tmp_path / "other"
    other.mkdir()
    (other / "letter.txt").touch()
    for extra, message in {
        ("--scratch", other): "holds other files (letter.txt)",
        ("--scratch", tmp_path / "no" / "folder"): "does not exist",
        ("--one-sided",): "--one-sided cannot be used with --memory",
        ("--close-holes",): "--close-holes cannot be used with --memory",
        ("--reference", torus): "--reference cannot be used with --memory",
        ("--report", torus): "is the same file as IN",
    }.items():
        refused(decimate(torus, out, *extra), message)
    refused(decimate(torus, tmp_path / "out.obj"), "IN and OUT are files of the extension .ply or .stl")
    refused(decimate(torus, out, memory="20MB"), "--memory: 20 MB is too little", "need")
    for wrong in ("much", "9" * 400, "9999999999TB"):
        refused(decimate(torus, out, memory=wrong), "is not a number of bytes such as 500MB or 4GB")
    refused(decimate(torus, out, "--threads", 10**20), "--threads: 100000000000000000000 is more than 2147483647")
    refused(command("decimate", torus, out, "--tolerance", "1%", "--resume"), "--resume needs --memory")
    refused(command("decimate", torus, out, "--tolerance", "900%", "--memory", "1GB"), "more than the size")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", "scan.ply"]
    assert [path.name for path in other.iterdir()] == ["letter.txt"]


def test_a_full_disk_is_said_and_the_run_goes_on_with_more_space(torus, tmp_path, whole):
    out = tmp_path / "out.ply"
    folder = interrupted(torus, out, "round0_00001")
    limited = subprocess.run(
        words("decimate", torus, out, "--tolerance", TOLERANCE, "--memory", SMALL, "--resume"),
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1500, 1500)),
    )
    refused((limited.returncode, limited.stdout, limited.stderr), folder, "go on with --resume", code=1)
    succeeded(decimate(torus, out, "--resume"))
    assert out.read_bytes() == whole


def test_too_small_a_disk_is_refused_before_any_work(torus, tmp_path, monkeypatch):
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=400_000))
    options = main.parser().parse(
        ["decimate", str(torus), str(tmp_path / "out.ply"), "--tolerance", "1%", "--memory", SMALL]
    )
    with pytest.raises(Stop, match="the disk has 0.4 MB free, and 0.6 MB may be needed; choose a folder on another"):
        large.decimate(options)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scan.ply"]


def test_a_mesh_of_large_faces_and_a_small_one_are_done_as_well(tmp_path):
    for name, mesh in {"box": meshes.box(), "plate": meshes.plate(n=65), "tetrahedron": meshes.sphere(0)}.items():
        path, out = tmp_path / f"{name}.ply", tmp_path / f"{name}_out.ply"
        write(path, *mesh)
        match = succeeded(decimate(path, out))
        assert_within(out, path, TOLERANCE)
        assert name != "plate" or int(match[2]) <= 600


def test_out_may_be_in(torus, tmp_path, whole):
    succeeded(decimate(torus, torus))
    assert torus.read_bytes() == whole
    assert [path.name for path in tmp_path.iterdir()] == ["scan.ply"]


def test_the_scratch_folder_may_be_a_link_and_a_run_goes_on_from_another_folder(torus, tmp_path, whole):
    real, link, out = tmp_path / "real", tmp_path / "link", tmp_path / "out.ply"
    real.mkdir()
    link.symlink_to(real)
    arguments = words("decimate", torus, out, "--tolerance", TOLERANCE, "--memory", SMALL, "--scratch", "link")
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, cwd=tmp_path, env=ENVIRONMENT)
    while not (real / "round0_00001.json").exists():
        assert process.poll() is None
        time.sleep(0.001)
    process.kill()
    process.wait()
    succeeded(decimate(torus, out, "--scratch", link, "--resume"))
    assert out.read_bytes() == whole and not real.exists()


def test_a_scratch_folder_that_cannot_be_made_is_no_full_disk(torus, tmp_path):
    (tmp_path / "file").touch()
    error = decimate(torus, tmp_path / "out.ply", "--scratch", tmp_path / "file")[2]
    assert "File exists" in error and "free some space" not in error


def test_a_file_that_changes_while_it_is_read_is_refused(torus):
    mesh = MappedMesh(torus)
    mesh.require_unchanged()
    os.truncate(torus, torus.stat().st_size - 1300)
    with pytest.raises(Refused, match="scan.ply was changed while it was read: start again"):
        list(mesh.blocks())
    os.utime(torus, (1, 1))
    with pytest.raises(Refused, match="was changed"):
        mesh.require_unchanged()
