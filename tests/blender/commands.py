# SPDX-License-Identifier: GPL-3.0-or-later
"""Running decimate.py and report.py as a person does, on files that the tests write."""

import re
import subprocess
from pathlib import Path

import bpy

from addon import file_io, volume
from scenes import add_object

SCRIPTS = Path(__file__).resolve().parents[2] / "blender_scripts"
LINE = re.compile(
    r"([\d,]+) -> ([\d,]+) triangles(?: \((.*)\))?, tolerance ([\d.e-]+) % = ([\d.e-]+), result within ([\d.e+-]+) %, "
    r"reference within ([\d.e+-]+) % \(certified\), [\d.]+ s"
)


def command(script, *arguments, before=None):
    """(exit code, stdout, stderr); `before` is Python that runs first."""
    patch = ["--python-expr", before] if before else []
    done = subprocess.run(
        [bpy.app.binary_path, "--background", *patch, "--python", SCRIPTS / script, "--", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    return done.returncode, done.stdout, done.stderr


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
