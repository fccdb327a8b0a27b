# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the command as a user does, and writes the files that it reads."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import tolvol
from tolvol.command import mesh_files
from tolvol.command.mesh import Mesh

import meshes
from result_line import LINE, succeeded  # noqa: F401
from served import Served

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(tolvol.__file__).parents[1])}


def words(*arguments):
    return [sys.executable, "-m", "tolvol", *map(str, arguments)]


_served = Served([sys.executable, Path(__file__).with_name("serve_commands.py")], env=ENVIRONMENT)


def command(*arguments, **environment):
    """Returns (exit code, stdout, stderr)."""
    return _served.ask([str(argument) for argument in arguments], environment, os.getcwd())


def end_served():
    """Ends the process that runs commands, if there is one."""
    _served.end()


WITHIN = 60  # seconds in which a process ends on any machine

# In the middle of the command the main thread is in a native call that lasts minutes and does not handle signals.
_HANGS = """
import hashlib, os, tolvol

def decimate(*_, **__):
    open(os.path.join({folder!r}, str(os.getpid())), "w").close()
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2_000_000_000)

tolvol.decimate = decimate
"""


@contextlib.contextmanager
def hanging(folder, count, *arguments):
    """Gives a process of the command once `count` processes, itself or its own, hang in a decimation, and their numbers.

    folder: an empty one.
    """
    signs = folder / "signs"
    signs.mkdir()
    (folder / "sitecustomize.py").write_text(_HANGS.format(folder=str(signs)))
    environment = {**ENVIRONMENT, "PYTHONPATH": f"{folder}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"}
    process = subprocess.Popen(words(*arguments), stderr=subprocess.PIPE, text=True, env=environment)
    try:
        wait_until(lambda: len(list(signs.iterdir())) == count)
        yield process, [int(sign.name) for sign in signs.iterdir()]
    finally:
        process.kill()
        for sign in signs.iterdir():
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(sign.name), signal.SIGKILL)


def wait_until(condition):
    deadline = time.monotonic() + WITHIN
    while not condition():
        assert time.monotonic() < deadline, "nothing happened"
        time.sleep(0.01)


def refused(done, *parts, code=2):
    """The command has ended with this exit code and one line that has these parts."""
    assert done[0] == code and done[2].count("\n") == 1 and "Traceback" not in done[2], done
    for part in parts:
        assert str(part) in done[2], done[2]


def write(path, vertices, triangles, **attributes):
    mesh_files.write(path, [Mesh(path.stem, vertices, triangles.astype(np.int32), attributes)], path.parent)
    return path


def scan(path, dtype=np.float32, columns=48, rows=24):
    """Writes a rough torus of 2 * columns * rows triangles."""
    vertices, triangles = meshes.torus(columns, rows, noise=0.004)
    return write(path, vertices.astype(dtype), triangles)


def read(path):
    """Returns the Mesh of a file."""
    return mesh_files.read(path).objects[0]


def assert_within(path, reference, tolerance):
    """Every point of each file is within the tolerance of the other."""
    one, other = ((mesh.vertices.astype(np.float64), mesh.triangles) for mesh in (read(path), read(reference)))
    both = tolvol.hausdorff(*one, *other, bound=tolerance)
    assert both.forward.upper <= tolerance and both.backward.upper <= tolerance
