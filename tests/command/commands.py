# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the command as a user does, and writes the files that it reads."""

import os
import sys
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
