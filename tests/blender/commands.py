# SPDX-License-Identifier: GPL-3.0-or-later
"""Running decimate.py and report.py as a person does, on files that the tests write."""

import re
import subprocess
from pathlib import Path

import bpy
import numpy as np

from addon import file_io, volume
from scenes import add_object

SCRIPTS = Path(__file__).resolve().parents[2] / "blender_scripts"
LINE = re.compile(
    r"([\d,]+) -> ([\d,]+) triangles(?: \((.*)\))?, tolerance ([\d.e-]+) % = ([\d.e-]+), result within ([\d.e+-]+) %, "
    r"reference within ([\d.e+-]+) % \(certified\), [\d.]+ s"
)
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


def command(script, *arguments, **options):
    """(exit code, stdout, stderr)."""
    with running(script, *arguments, **options) as process:
        try:
            out, err = process.communicate(timeout=120)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
    return process.returncode, out, err


def decimate(*arguments, **options):
    return command("decimate.py", *arguments, **options)


def save(path, *meshes):
    """Writes a file with an object for each (name, vertices, faces)."""
    objects = [add_object(*mesh) for mesh in meshes]
    file_io.write_file(path, objects, path.parent)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


def world(path):
    """(vertices, triangles) of all objects of a file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    surface = volume.joined([volume.surface_of(ob) for ob in file_io.read_file(path).objects])
    return surface.world(), surface.arrays.triangles


def succeeded(done):
    code, out, err = done
    assert (code, err) == (0, ""), (out, err)
    match = LINE.fullmatch(out.splitlines()[-1])
    assert match, out
    return match
