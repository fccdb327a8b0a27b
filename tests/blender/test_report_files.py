# SPDX-License-Identifier: GPL-3.0-or-later
"""No file is lost: the files that report.py and Save Report write, replace and leave alone."""

import os
import stat

import bpy
import pytest

from commands import command
from scenes import sheet
from written import FAILING_REPLACE, failed, names, painted, unchanged

# report.py ----------------------------------------------------------------------------------------------------------


def test_report_overwrites_nothing_that_it_reads(scan, tmp_path):
    (tmp_path / "r.json").symlink_to(scan.name)
    source = painted(tmp_path / "b.obj", image="skin.png")
    (tmp_path / "skin.png").write_bytes(b"a texture")
    os.link(source, tmp_path / "r.html")
    (tmp_path / "twice.csv").symlink_to("new.json")
    for extra, words in (
        (("--report", "r.json"), ("--report", "same file as A")),
        (("--report", "r.html"), ("--report", "same file as B")),
        (("--picture", "skin.png"), ("--picture", "skin.png of B")),
        (("--report", "new.json", "--report", "twice.csv"), ("twice.csv", "new.json")),
    ):
        arguments = [tmp_path / word if "." in word else word for word in extra]
        with unchanged(tmp_path):
            _, out, _ = failed(command("report.py", scan, source, *arguments), 2, *words)
            assert "largest" not in out


def test_reports_are_written_all_or_none(scan, tmp_path):
    (tmp_path / "full.csv").symlink_to("/dev/full")
    (tmp_path / "a.json").write_text("kept")
    arguments = "report.py", scan, scan, "--report", tmp_path / "a.json", "--report"
    with unchanged(tmp_path):
        failed(command(*arguments, tmp_path / "full.csv"), 1, "--report", "full.csv: No space left")
        _, out, _ = failed(command(*arguments, "/proc/b.csv"), 1, "--report /proc/b.csv")
        assert "largest" not in out
        spoiled = FAILING_REPLACE.format(name="b.csv")
        failed(command(*arguments, tmp_path / "b.csv", patches=spoiled), 1, "b.csv: Operation not permitted")


def test_a_report_follows_links_and_keeps_the_mode(scan, tmp_path):
    (tmp_path / "store").mkdir()
    real = tmp_path / "store" / "real.csv"
    real.write_text("old")
    real.chmod(0o600)
    (tmp_path / "r.csv").symlink_to(real)
    assert command("report.py", scan, scan, "--report", tmp_path / "r.csv")[::2] == (0, "")
    assert (tmp_path / "r.csv").is_symlink() and "forward,largest" in real.read_text()
    assert stat.S_IMODE(real.stat().st_mode) == 0o600 and names(real.parent) == ["real.csv"]


# Save Report --------------------------------------------------------------------------------------------------------


@pytest.fixture
def measured(measured_once):
    ob = sheet(count=6)
    bpy.ops.tolvol.set_reference()
    return ob


def save_report(path):
    return bpy.ops.tolvol.save_report(filepath=str(path))


def test_save_report_follows_links_and_writes_whole_files(measured, tmp_path, monkeypatch):
    (tmp_path / "store").mkdir()
    real = tmp_path / "store" / "real.csv"
    real.write_text("old")
    (tmp_path / "r.csv").symlink_to(real)
    with monkeypatch.context() as patch, pytest.raises(RuntimeError, match="r.csv: Input/output error"):
        patch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError(5, "Input/output error")))
        save_report(tmp_path / "r.csv")
    assert real.read_text() == "old" and names(real.parent) == ["real.csv"]
    assert save_report(tmp_path / "r.csv") == {"FINISHED"}
    assert (tmp_path / "r.csv").is_symlink() and "forward,largest" in real.read_text()


def test_save_report_refuses_what_cannot_be_written(measured, tmp_path):
    (tmp_path / "a.csv").symlink_to("a.csv")
    (tmp_path / "full.csv").symlink_to("/dev/full")
    for path, words in (
        (tmp_path / "a.csv", "circle"),
        (tmp_path / "full.csv", "No space left"),
        ("/proc/r.csv", "r.csv"),
    ):
        with pytest.raises(RuntimeError, match=words) as error:
            save_report(path)
        assert "Traceback" not in str(error.value)


def test_save_report_spares_the_files_of_the_scene(measured, tmp_path):
    image = bpy.data.images.new("skin", 4, 4)
    image.filepath_raw, image.file_format = str(tmp_path / "skin.png"), "PNG"
    image.save()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    (tmp_path / "r.csv").symlink_to("scene.blend")
    os.link(tmp_path / "skin.png", tmp_path / "r.json")
    with unchanged(tmp_path):
        for name, words in (("r.csv", "same file as .*scene.blend"), ("r.json", "same file as .*skin.png")):
            with pytest.raises(RuntimeError, match=words):
                save_report(tmp_path / name)
