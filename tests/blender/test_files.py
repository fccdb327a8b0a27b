# SPDX-License-Identifier: GPL-3.0-or-later
"""No file is lost: the files that decimate.py, report.py and Save Report write, replace and leave alone."""

import contextlib
import fcntl
import json
import os
import signal
import stat
import threading
import time

import bpy
import pytest

from addon.files import file_io
from addon.shared.errors import NotWritten, Refused
from addon.shared.files import safe_files
from commands import READS_GLTF, SCRIPTS, command, decimate, running, save, succeeded, world
from scenes import sheet, sheet_arrays

WITHIN = 60  # seconds in which anything here ends on any machine

# Python code that runs in a command before the command itself. patch() is that of serve_commands.py.
FAILING_REPLACE = """
import os
replace = os.replace
def failing(source, place):
    if os.path.basename(place) == {name!r} and not str(source).endswith(".replaced"):
        raise PermissionError(1, "Operation not permitted")
    replace(source, place)
patch(os, "replace", failing)
"""
# This code simulates a full disk by a limit of the length of files: from the export of OUT on, or after the export.
FULL_DISK = f"""
import resource, signal, sys
sys.path.insert(0, {str(SCRIPTS.parent)!r})
from addon.files import file_io
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
write = file_io.write_file
def limited(*arguments):
    {{0}}
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
    {{1}}
file_io.write_file = limited
"""
PROTECTED = (
    "import os; access = os.access; "
    "patch(os, 'access', lambda path, mode: access(path, mode) and '{name}' not in str(path))"
)


@contextlib.contextmanager
def unchanged(folder):
    """Asserts at the end that the folder holds the same files with the same content, and that none was replaced or added."""

    def found():
        return {
            path.name: (path.lstat().st_ino, path.readlink() if path.is_symlink() else path.read_bytes())
            for path in folder.iterdir()
            if path.is_symlink() or path.is_file()
        }

    before, folders = found(), sorted(path.name for path in folder.iterdir())
    yield
    assert found() == before and sorted(path.name for path in folder.iterdir()) == folders


def failed(done, code, *words):
    """Asserts this exit code, and one line on stderr with all these words."""
    assert done[0] == code, done
    # Under FULL_DISK a library prints a line of its own.
    assert len([line for line in done[2].splitlines() if not line.startswith("ftruncate() failed")]) == 1, done
    for word in words:
        assert str(word) in done[2], done
    return done


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def painted(path, name="sheet", image=None):
    """Writes an OBJ file with a material, and with a texture if an image is given."""
    vertices, quads = sheet_arrays(count=8)
    lines = [f"mtllib {path.stem}.mtl", f"o {name}", *("v %f %f %f" % tuple(v) for v in vertices)]
    lines += ["vt %f %f" % (v[0] / 2 + 0.5, v[1] / 2 + 0.5) for v in vertices]
    lines += ["usemtl red", *("f " + " ".join(f"{i + 1}/{i + 1}" for i in quad) for quad in quads)]
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".mtl").write_text("newmtl red\nKd 1 0 0\n" + (f"map_Kd {image}\n" if image else ""))
    return path


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


# What cannot be written ---------------------------------------------------------------------------------------------


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


# Ends and other runs ------------------------------------------------------------------------------------------------

# In the middle of the command the main thread is in a native call that lasts minutes and does not handle signals.
HANGS = f"""
import signal, sys
signal.signal({{number}}, signal.SIG_DFL)  # whoever runs the tests in the background has it ignored
sys.path.insert(0, {str(SCRIPTS.parent)!r})
from addon.files import file_io
def hang(*_):
    import hashlib
    open({{sign!r}}, "w").close()
    hashlib.pbkdf2_hmac("sha256", b"", b"", 1_000_000_000)
file_io.read_file = hang
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_removes_temporary_files(scan, tmp_path, number):
    out, sign = tmp_path / "out", tmp_path / "sign"
    out.mkdir()
    (out / "out.ply").write_text("kept")
    started = ("decimate.py", scan, out / "out.ply", "--tolerance", "1%", "--report", out / "r.json")
    with running(*started, before=HANGS.format(sign=str(sign), number=int(number))) as process:
        until(sign.exists)
        assert len(list(out.glob(".tolvol-*"))) == 2
        process.send_signal(number)
        _, err = process.communicate(timeout=WITHIN)
    assert process.returncode == 128 + number and err == f"decimate.py: ended by {number.name}\n"
    assert names(out) == ["out.ply"] and (out / "out.ply").read_text() == "kept"


def until(condition):
    deadline = time.monotonic() + WITHIN
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_two_runs_that_write_one_out(tmp_path):
    """Two runs write the same files. Afterwards OUT, its side file and its report are all of the same run."""
    sources = []
    for name in ("first", "second"):
        source = painted(tmp_path / f"{name}.obj", name)
        for path in (source, source.with_suffix(".mtl")):
            path.write_text(path.read_text().replace("red", f"colour_of_{name}"))
        sources.append(source)
    out = tmp_path / "out"
    out.mkdir()
    both = [
        ("decimate.py", source, out / "out.obj", "--tolerance", "1%", "--report", out / "r.json") for source in sources
    ]
    with running(*both[0]) as first, running(*both[1]) as second:
        assert [process.wait(120) for process in (first, second)] == [0, 0]
    name = json.loads((out / "r.json").read_text())["objects"][0]["name"]
    assert f"newmtl colour_of_{name}" in (out / "out.mtl").read_text()
    assert f"usemtl colour_of_{name}" in (out / "out.obj").read_text() and f"o {name}" in (out / "out.obj").read_text()
    assert names(out) == ["out.mtl", "out.obj", "r.json"]


def test_moves_of_two_runs_do_not_mix(tmp_path, monkeypatch):
    """One run stops between its two moves until the other run tries to move its files as well."""
    staged = {name: safe_files.Staged() for name in ("first", "second")}
    for name, one in staged.items():
        for file in ("a", "b"):
            one.write(safe_files.Target(tmp_path / file), name.encode())
    between, refused = threading.Event(), threading.Event()
    replace, flock = os.replace, fcntl.flock

    def slow(source, place):
        replace(source, place)
        if not between.is_set():
            between.set()
            refused.wait(WITHIN)

    def lock(descriptor, how):
        try:
            flock(descriptor, how | fcntl.LOCK_NB)
        except BlockingIOError:
            refused.set()
            flock(descriptor, how)

    monkeypatch.setattr(os, "replace", slow)
    monkeypatch.setattr(fcntl, "flock", lock)
    monkeypatch.setattr(safe_files, "_lock", contextlib.nullcontext())  # Another process has a lock of its own.
    thread = threading.Thread(target=staged["first"].publish)
    thread.start()
    assert between.wait(WITHIN)
    staged["second"].publish()
    thread.join()
    assert refused.is_set()
    assert [(tmp_path / file).read_text() for file in ("a", "b")] == ["second", "second"]


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


# safe_files itself --------------------------------------------------------------------------------------------------


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
