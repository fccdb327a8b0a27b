# SPDX-License-Identifier: GPL-3.0-or-later
"""No file is lost if a command is ended, or if two write the same files at the same time."""

import contextlib
import fcntl
import json
import os
import signal
import threading
import time

import pytest

from addon.shared.files import safe_files
from commands import SCRIPTS, running
from written import WITHIN, names, painted

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
