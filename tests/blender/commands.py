# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs decimate.py and report.py as a user does, on files that the tests write."""

import multiprocessing
import subprocess
from pathlib import Path

import bpy
import numpy as np

from addon.files import file_io
from addon.reference import snapshots
from addon.shared.surface import joined
from result_line import LINE, succeeded  # noqa: F401
from scenes import add_object, empty_scene

FOLDER = Path(__file__).resolve().parent
SCRIPTS = FOLDER.parents[1] / "blender_scripts"
BENCHMARK, FIGURES = FOLDER.parents[1] / "benchmark", FOLDER.parents[1] / "docs" / "figures"
PATIENCE = 120  # seconds after which a command counts as stuck
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


class _Served:
    """A Blender that runs commands one after another."""

    def __init__(self):
        self._link, there = multiprocessing.Pipe()
        served = FOLDER / "serve_commands.py", "--", str(there.fileno())
        self._process = subprocess.Popen(
            [bpy.app.binary_path, "--background", "--python", *served],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=[there.fileno()],
        )
        there.close()

    def run(self, script, arguments, patches):
        self._link.send((str(SCRIPTS / script), [str(argument) for argument in arguments], patches))
        if self._link.poll(PATIENCE):
            return self._link.recv()
        self._process.kill()
        raise subprocess.TimeoutExpired(script, PATIENCE)

    def end(self):
        self._link.close()
        self._process.wait(PATIENCE)


_served = None


def command(script, *arguments, patches="", before=None, alone=False):
    """Runs a command and returns (exit code, stdout, stderr).

    With `alone`, and with `before`, it runs in a process of its own, as a user runs it. `patches` is Python that runs first in
    the Blender of all other commands, and sets attributes for this command alone: see serve_commands.py.
    """
    global _served
    assert not patches or not (before or alone)
    if not (before or alone):
        one, _served = _served or _Served(), None  # If this Blender fails, the next command gets another one.
        done = one.run(script, arguments, patches)
        _served = one
        return done
    with running(script, *arguments, before=before) as process:
        try:
            out, err = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    return process.returncode, out, err


def end_served():
    """Ends the Blender that runs commands, if there is one."""
    if _served is not None:
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
