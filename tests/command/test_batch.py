# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol batch: many files at once, with a table and a CSV."""

import csv
import os
import signal

import numpy as np
import pytest

from commands import WITHIN, assert_within, command, hanging, read, refused, scan, wait_until


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "in").mkdir()
    for name in ("one.ply", "two.stl"):
        scan(tmp_path / "in" / name)
    return tmp_path


def rows(path):
    return {os.path.basename(row["file"]): row for row in csv.DictReader(path.open())}


def test_all_files_of_a_pattern_a_table_and_a_csv(folder):
    code, out, err = command("batch", folder / "in" / "*", "--out", folder / "out", "--jobs", "2", "--tolerance", "2%")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[-1] == "2 of 2 proved" and lines[-4].split()[:3] == ["file", "verdict", "triangles"]
    found = rows(folder / "out" / "batch.csv")
    assert found.keys() == {"one.ply", "two.stl"}
    for name, row in found.items():
        target = folder / "out" / name
        assert row["exit_code"] == "0" and int(row["triangles"]) == 2304
        assert int(row["left"]) == len(read(target).triangles) < 600
        assert float(row["result_within"]) <= float(row["tolerance"])
        assert_within(target, folder / "in" / name, float(row["tolerance"]))
    assert {path.name for path in (folder / "out").iterdir()} == {"one.ply", "two.stl", "batch.csv"}


def test_names_that_are_options_or_formulas_elsewhere(folder, monkeypatch):
    for name in ("-x.ply", "=one.ply"):
        scan(folder / name)
    monkeypatch.chdir(folder)
    code, _, err = command("batch", "*.ply", "--out", "out", "--tolerance", "2%")
    assert (code, err) == (0, "")
    # A spreadsheet would take the names for formulas without the '.
    assert rows(folder / "out" / "batch.csv").keys() == {"'-x.ply", "'=one.ply"}


def test_options_and_extension_reach_every_file(folder):
    given = "--placement", "subset", "--target-triangles", "1500", "--extension", ".obj", "--csv", folder / "t.csv"
    code, _, err = command("batch", folder / "in" / "*.ply", "--out", folder / "out", "--tolerance", "2%", *given)
    assert (code, err) == (0, "")
    mesh = read(folder / "out" / "one.obj")
    assert 1400 < len(mesh.triangles) <= 1500
    originals = {vertex.tobytes() for vertex in read(folder / "in" / "one.ply").vertices.astype(np.float64)}
    assert all(vertex.tobytes() in originals for vertex in mesh.vertices)
    assert rows(folder / "t.csv")["one.ply"]["message"].startswith("2,304 -> 1,")


def test_a_file_that_fails_does_not_keep_the_others_back(folder):
    (folder / "in" / "bad.ply").write_bytes((folder / "in" / "one.ply").read_bytes()[:5000])
    code, out, _ = command("batch", folder / "in" / "*", "--out", folder / "out", "--tolerance", "2%")
    assert code == 2 and out.splitlines()[-1] == "2 of 3 proved"
    row = rows(folder / "out" / "batch.csv")["bad.ply"]
    assert row["exit_code"] == "2" and row["message"].endswith(
        "bad.ply: the file ends inside its list of vertex elements"
    )
    assert not (folder / "out" / "bad.ply").exists() and "FAILED" in out


def test_what_makes_no_sense_is_refused_before_the_work(folder):
    (folder / "other").mkdir()
    scan(folder / "other" / "one.ply")
    both = folder / "in" / "one.ply", folder / "other" / "one.ply"
    out = "--out", folder / "out", "--tolerance", "2%"
    refused(command("batch", *both, *out), "would both be written to")
    refused(command("batch", folder / "*.none", *out), "no file has such a name")
    refused(command("batch", both[0], "--out", both[1], "--tolerance", "2%"), "--out")
    refused(command("batch", both[0], *out[:2], "--lod", "1%,2%"), "--tolerance")
    refused(command("batch", both[0], *out, "--csv", both[0]), "is the same file as")
    refused(command("batch", both[0], *out, "--jobs", "0"), "--jobs")
    (folder / "in" / "notes.txt").write_text("")
    refused(command("batch", folder / "in" / "*", *out), "notes.txt: unknown extension .txt")


def test_a_signal_ends_all_processes(folder, tmp_path_factory):
    asked = "batch", folder / "in" / "*", "--out", folder / "out", "--jobs", "2", "--tolerance", "1%"
    with hanging(tmp_path_factory.mktemp("hanging"), 2, *asked) as (process, started):
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=WITHIN)
    assert process.returncode == 128 + signal.SIGTERM and err.endswith("tolvol: ended by SIGTERM\n")
    wait_until(lambda: not any(os.path.exists(f"/proc/{pid}") for pid in started))
    assert list((folder / "out").iterdir()) == []
