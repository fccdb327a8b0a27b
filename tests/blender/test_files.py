# SPDX-License-Identifier: GPL-3.0-or-later
"""No file is lost: where decimate.py writes its files, and which files it leaves alone."""

import json
import os
import stat

import pytest

from commands import decimate, save, succeeded, world
from scenes import sheet_arrays
from written import failed, names, painted, unchanged

# Links --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("there", [True, False])
def test_out_as_a_link_is_written_where_it_points(scan, tmp_path, there):
    store = tmp_path / "store"
    store.mkdir()
    if there:
        (store / "real.ply").write_text("old")
    (tmp_path / "link.ply").symlink_to("chain.ply")
    (tmp_path / "chain.ply").symlink_to("store/real.ply")
    (tmp_path / "link.json").symlink_to("store/real.json")
    match = succeeded(decimate(scan, tmp_path / "link.ply", "--tolerance", "1%", "--report", tmp_path / "link.json"))
    assert [(tmp_path / name).is_symlink() for name in ("link.ply", "chain.ply", "link.json")] == [True] * 3
    assert names(store) == ["real.json", "real.ply"]
    assert len(world(store / "real.ply")[1]) == int(match[2])
    assert json.loads((store / "real.json").read_text())["output"]["file"] == str(tmp_path / "link.ply")


def test_a_link_may_lead_to_any_name(tmp_path):
    source = painted(tmp_path / "in.obj")
    store = tmp_path / "store"
    store.mkdir()
    (store / "blob").write_text("old")
    (tmp_path / "out.obj").symlink_to(store / "blob")
    match = succeeded(decimate(source, tmp_path / "out.obj", "--tolerance", "1%"))
    assert names(store) == ["blob", "blob.mtl"] and "mtllib blob.mtl" in (store / "blob").read_text()
    assert len(world(tmp_path / "out.obj")[1]) == int(match[2])


def test_a_side_file_may_be_a_link_into_another_folder(tmp_path):
    source = painted(tmp_path / "in.obj")
    store = tmp_path / "store"
    store.mkdir()
    (tmp_path / "out.mtl").symlink_to(store / "materials")
    succeeded(decimate(source, tmp_path / "out.obj", "--tolerance", "1%"))
    assert (tmp_path / "out.mtl").is_symlink() and "newmtl red" in (store / "materials").read_text()
    assert names(store) == ["materials"]


def test_links_that_lead_in_a_circle_or_nowhere_are_refused(scan, tmp_path):
    (tmp_path / "a.ply").symlink_to("b.ply")
    (tmp_path / "b.ply").symlink_to("a.ply")
    (tmp_path / "lost.ply").symlink_to("nowhere/real.ply")
    with unchanged(tmp_path):
        failed(decimate(scan, tmp_path / "a.ply", "--tolerance", "1%"), 2, "OUT", "a.ply", "circle")
        failed(decimate(scan, tmp_path / "lost.ply", "--tolerance", "1%"), 2, "nowhere", "does not exist")
        for option, path, word in (("--report", "a.ply", "circle"), ("--report", "lost.ply", "does not exist")):
            failed(decimate(scan, tmp_path / "o.ply", "--tolerance", "1%", option, tmp_path / path), 2, option, word)
        failed(decimate(tmp_path / "a.ply", tmp_path / "o.ply", "--tolerance", "1%"), 2, "a.ply")


# One file for two purposes ------------------------------------------------------------------------------------------


def alias(tmp_path, path, kind):
    """Returns another name of a file with the extension .json, or the file itself."""
    other = tmp_path / f"{path.stem} {kind}.json"
    if kind == "itself":
        return path
    if kind == "link":
        other.symlink_to(path.name)
    elif kind == "hard link":
        os.link(path, other)
    else:
        (tmp_path / "folder").mkdir()
        other = tmp_path / "folder" / ".." / path.name
    return other


@pytest.mark.parametrize("kind", ["itself", "link", "hard link", "other way"])
def test_a_report_is_never_a_file_that_is_read(scan, tmp_path, kind):
    source = save(tmp_path / "in.ply", ("in", *sheet_arrays()))
    paths = [alias(tmp_path, source, kind), scan]
    with unchanged(tmp_path):
        for path, what in zip(paths, ("IN", "--reference")):
            arguments = source, tmp_path / "out.ply", "--tolerance", "1%", "--reference", scan
            code, out, _ = failed(decimate(*arguments, "--report", path), 2, "--report", f"is the same file as {what}")
            assert "triangles" not in out


@pytest.mark.parametrize("kind", ["itself", "link", "hard link"])
def test_a_report_is_never_out(scan, tmp_path, kind):
    target = tmp_path / "out.ply"
    target.write_text("kept")
    path = alias(tmp_path, target, kind)
    with unchanged(tmp_path):
        failed(decimate(scan, target, "--tolerance", "1%", "--report", path), 2, "--report", "is the same file as OUT")


def test_files_to_come_are_told_apart_as_well(scan, tmp_path):
    (tmp_path / "r.json").symlink_to("out.ply")  # Neither file exists.
    (tmp_path / "p.png").symlink_to("s.json")
    for extra, words in (
        (("--report", "r.json"), ("--report", "OUT")),
        (("--report", "s.json", "--picture", "p.png"), ("--picture", "--report")),
    ):
        arguments = [tmp_path / word if "." in word else word for word in extra]
        with unchanged(tmp_path):
            failed(decimate(scan, tmp_path / "out.ply", "--tolerance", "1%", *arguments), 2, *words)


def test_side_files_are_looked_at_as_well(scan, tmp_path):
    source = painted(tmp_path / "in.obj", image="skin.png")
    (tmp_path / "skin.png").write_bytes(b"a texture")
    (tmp_path / "link.mtl").symlink_to("in.obj")
    save(tmp_path / "link.ply", ("link", *sheet_arrays()))
    for out, extra, words in (
        ("out.obj", ("--report", "out.mtl"), ("--report", "out.mtl", "side file")),
        ("out.obj", ("--report", "in.mtl"), ("--report", "in.mtl", "which is read")),
        ("out.obj", ("--picture", "skin.png"), ("--picture", "skin.png", "which is read")),
        ("link.obj", (), ("side file", "link.mtl", "IN")),
    ):
        arguments = [tmp_path / word if "." in word else word for word in extra]
        with unchanged(tmp_path):
            failed(decimate(source, tmp_path / out, "--tolerance", "1%", *arguments), 2, *words)
    # The file of materials of IN has the name of OUT's.
    source.write_text(source.read_text().replace("mtllib in.mtl", "mtllib other.mtl"))
    (tmp_path / "in.mtl").rename(tmp_path / "other.mtl")
    with unchanged(tmp_path):
        failed(decimate(source, tmp_path / "other.obj", "--tolerance", "1%"), 2, "other.mtl", "which is read")


def test_out_is_no_reference_and_no_pipe(scan, tmp_path):
    source = save(tmp_path / "in.ply", ("in", *sheet_arrays()))
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "out.ply").symlink_to("pipe")
    with unchanged(tmp_path):
        failed(decimate(source, scan, "--tolerance", "50%", "--reference", scan), 2, "OUT", "--reference")
        failed(decimate(source, tmp_path / "out.ply", "--tolerance", "1%"), 2, "OUT", "not a file")


@pytest.mark.parametrize("kind", ["itself", "link", "hard link"])
def test_out_may_be_in_and_keeps_its_mode(tmp_path, kind):
    source = painted(tmp_path / "in.obj")
    source.chmod(0o640)
    original = source.read_bytes()
    target = source
    if kind != "itself":
        target = tmp_path / "same.obj"
        target.symlink_to(source.name) if kind == "link" else os.link(source, target)
    succeeded(decimate(source, target, "--tolerance", "1%", "--reference", source))
    assert stat.S_IMODE(target.stat().st_mode) == 0o640 and target.read_bytes() != original
    assert target.is_symlink() == (kind == "link")
    # A hard link to OUT keeps the old content: from then on it is another file.
    assert (source.read_bytes() == original) == (kind == "hard link")


def test_a_new_file_has_the_mode_of_new_files(scan, tmp_path):
    (tmp_path / "other").write_text("")
    arguments = scan, tmp_path / "out.ply", "--tolerance", "1%", "--report", tmp_path / "r.json"
    succeeded(decimate(*arguments))
    assert {stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("other", "out.ply", "r.json")} == {
        stat.S_IMODE((tmp_path / "other").stat().st_mode)
    }
