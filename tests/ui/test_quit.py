# SPDX-License-Identifier: GPL-3.0-or-later
"""Quitting Blender while the add-on is at work: Blender waits for the threads and does not abort."""

import subprocess
from pathlib import Path

import bpy

from window import finished

SCRIPT = Path(__file__).resolve().parent / "quitting.py"
_WITHIN = 240  # seconds in which it quits on any machine


def quits(what):
    command = [
        bpy.app.binary_path,
        "--factory-startup",
        "--window-geometry",
        "0",
        "0",
        "600",
        "400",
        "--python",
        SCRIPT,
    ]
    blender = subprocess.Popen(
        [*command, "--", what], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True
    )
    try:
        yield from finished(lambda: blender.poll() is not None, _WITHIN)
    finally:
        blender.kill()
    said = blender.communicate()[0]
    assert "at work" in said and "Blender quit" in said and blender.returncode == 0, (blender.returncode, said)
    for sign in ("terminate called", "Aborted", "Segmentation", "Error"):
        assert sign not in said, said


def test_quitting_while_a_job_works():
    yield from quits("decimating")


def test_quitting_while_a_modifier_is_fitted():
    yield from quits("fitting")


def test_quitting_while_the_overlay_is_prepared():
    yield from quits("showing")


def test_quitting_while_a_guard_on_a_million_triangles_is_prepared():
    yield from quits("guarding")
