# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs decimate.py and report.py as a user does, on files that the tests write."""

import subprocess
from pathlib import Path

import bpy
import numpy as np

from addon.files import file_io
from addon.reference import snapshots
from addon.shared.surface import joined
from result_line import LINE, succeeded  # noqa: F401
from scenes import add_object, empty_scene
from served import PATIENCE, Served

FOLDER = Path(__file__).resolve().parent
SCRIPTS = FOLDER.parents[1] / "blender_scripts"
BENCHMARK, FIGURES = FOLDER.parents[1] / "benchmark", FOLDER.parents[1] / "docs" / "figures"
READS_GLTF = bpy.app.version >= (4, 0) or "bool" in vars(np)


def running(script, *arguments, before=None):
    """The process of a command; `before` is Python that runs first."""
    patch = ["--python-expr", before] if before else []
    return subprocess.Popen(
        [bpy.app.binary_path, "--background", *patch, "--python", SCRIPTS / script, "--", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


_served = Served(
    [bpy.app.binary_path, "--background", "--python", FOLDER / "serve_commands.py", "--"],
    stdout=subprocess.DEVNULL,
    stderr=subprocess.DEVNULL,
)


def command(script, *arguments, patches="", before=None, alone=False):
    """Runs a command and returns (exit code, stdout, stderr).

    With `alone`, and with `before`, it runs in a process of its own, as a user runs it. `patches` is Python that runs first in
    the Blender of all other commands, and sets attributes for this command alone: see serve_commands.py.
    """
    assert not patches or not (before or alone)
    if not (before or alone):
        return _served.ask(str(SCRIPTS / script), [str(argument) for argument in arguments], patches)
    with running(script, *arguments, before=before) as process:
        try:
            out, err = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    return process.returncode, out, err


def end_served():
    """Ends the Blender that runs commands, if there is one."""
    _served.end()


def decimate(*arguments, **options):
    return command("decimate.py", *arguments, **options)


def save(path, *meshes):
    """Writes a file with an object for each (name, vertices, faces)."""
    objects = [add_object(*mesh) for mesh in meshes]
    file_io.write_file(path, objects, path.parent)
    empty_scene()
    return path


def world(path):
    """Returns (vertices, triangles) of all objects of a file."""
    empty_scene()
    surface = joined([snapshots.surface_of(ob) for ob in file_io.read_file(path).objects])
    return surface.world(), surface.arrays.triangles
