# SPDX-License-Identifier: GPL-3.0-or-later
"""No file is lost where one cannot be written: all are as they were before."""

import json
import os
import stat
import threading

import pytest

from addon.files import file_io
from addon.shared.errors import NotWritten, Refused
from addon.shared.files import safe_files
from commands import READS_GLTF, decimate, succeeded
from written import FAILING_REPLACE, FULL_DISK, PROTECTED, WITHIN, failed, names, painted, unchanged


@pytest.mark.parametrize("option", ["--report", "OUT"])
def test_a_place_that_takes_no_files(scan, tmp_path, option):
    """Nobody can write a file to /proc, not even root."""
    target = tmp_path / "out.ply"
    target.write_text("kept")
    arguments = (target, "--report", "/proc/x.json") if option == "--report" else ("/proc/out.ply",)
    with unchanged(tmp_path):
        done = failed(decimate(scan, *arguments, "--tolerance", "1%"), 1, f"{option} /proc/", "was not written")
    assert "triangles" not in done[1]  # The command ended before the work.


def test_a_report_to_a_full_disk(scan, tmp_path):
    target = tmp_path / "out.ply"
    target.write_text("kept")
    with unchanged(tmp_path):
        arguments = scan, target, "--tolerance", "1%", "--report"
        failed(decimate(*arguments, "/dev/full"), 1, "--report /dev/full: No space", "out.ply was not written")
        full = FULL_DISK.format("write(*arguments)", "")
        failed(decimate(*arguments, tmp_path / "r.json", before=full), 1, "--report", "r.json: File too large")


def test_out_to_a_full_disk(scan, tmp_path):
    for extension in file_io.EXTENSIONS[: 5 if READS_GLTF else 3]:
        target = tmp_path / f"out{extension}"
        target.write_text("kept")
        with unchanged(tmp_path):
            full = FULL_DISK.format("", "write(*arguments)")
            failed(decimate(scan, target, "--tolerance", "1%", before=full), 1, f"OUT {target}", "was not written")


def test_a_protected_file_is_not_replaced(scan, tmp_path):
    (tmp_path / "out.ply").write_text("kept")
    protected = PROTECTED.format(name="out.ply")  # A mode without write permission would not protect it from root.
    with unchanged(tmp_path):
        failed(decimate(scan, tmp_path / "out.ply", "--tolerance", "1%", patches=protected), 1, "OUT", "protected")


@pytest.mark.parametrize("name", ["out.obj", "r.json", "out.mtl"])
def test_a_failing_move_undoes_those_before_it(tmp_path, name):
    source = painted(tmp_path / "in.obj")
    for other in ("out.mtl", "out.obj"):
        (tmp_path / other).write_text("kept")
    arguments = source, tmp_path / "out.obj", "--tolerance", "1%", "--report", tmp_path / "r.json"
    with unchanged(tmp_path):
        failed(decimate(*arguments, patches=FAILING_REPLACE.format(name=name)), 1, name, "not permitted", "not written")


def test_reports_may_be_pipes(scan, tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    text = []
    reader = threading.Thread(target=lambda: text.append(pipe.read_text()))
    reader.start()
    succeeded(decimate(scan, tmp_path / "out.ply", "--tolerance", "1%", "--report", pipe))
    reader.join(WITHIN)
    assert json.loads(text[0])["output"]["file"] == str(tmp_path / "out.ply")
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_what_is_left_is_removed(tmp_path):
    with pytest.raises(NotWritten, match="later: .*written this file"), safe_files.Staged() as staged:
        target = safe_files.Target(tmp_path / "later")
        staged.write(safe_files.Target(tmp_path / "first"), b"1")
        file = staged.folder(target) / "later"
        file.write_bytes(b"2")
        staged.add(target, file, new=True)
        (tmp_path / "later").write_text("somebody else's")
        staged.publish()
    assert names(tmp_path) == ["later"] and (tmp_path / "later").read_text() == "somebody else's"


def test_a_file_system_without_hard_links(tmp_path, monkeypatch):
    def no_links(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(os, "link", no_links)
    (tmp_path / "a").write_text("old")
    (tmp_path / "b").mkdir()
    with pytest.raises(NotWritten, match="b/c"), safe_files.Staged() as staged:
        staged.write(safe_files.Target(tmp_path / "a"), b"new")
        staged.write(safe_files.Target(tmp_path / "b" / "c"), b"new")
        (tmp_path / "b" / "c").mkdir()
        staged.publish()
    assert (tmp_path / "a").read_text() == "old"


def test_a_name_that_is_too_long(tmp_path):
    with pytest.raises(Refused, match="too long"):
        safe_files.Target(tmp_path / ("x" * 300))
