# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a module of this folder in a Blender of its own, without a window.

It can be ended at any time, and the user can work on meanwhile. The module's main(folder) reads task.json and meshes.blend
there, and what it returns is written into result.json (process.py).
"""

import contextlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy

from .. import native
from ..shared.errors import Refused

_LOOK = 0.05  # The thread looks every so many seconds whether it was cancelled.


def temporary_folder(prefix):
    """Returns a folder for the files of the other Blender, as a context that removes it."""
    with _writing():
        return tempfile.TemporaryDirectory(prefix=prefix, dir=bpy.app.tempdir, ignore_cleanup_errors=True)


@contextlib.contextmanager
def _writing():
    """Says what can be done if the folder is on a full disk, was removed, or cannot be written."""
    try:
        yield
    except OSError as error:
        reason = f" ({error.strerror})" if error.strerror else ""  # Blender's own error has no reason.
        raise Refused(
            f"Files cannot be written into Blender's temporary folder {bpy.app.tempdir}{reason}: make room there, or choose "
            "another folder in Preferences > File Paths > Data > Temporary Files"
        ) from None


def write_task(folder, task):
    """Writes what the module is to do, as JSON."""
    with _writing():
        (folder / "task.json").write_text(json.dumps(task))


def write(folder, meshes):
    """Takes the materials from the meshes and writes them into the folder. Returns the names of their objects there."""
    objects = []
    try:
        for mesh in meshes:
            mesh.materials.clear()
            objects.append(bpy.data.objects.new(".appearance", mesh))
        with _writing():
            bpy.data.libraries.write(str(folder / "meshes.blend"), set(objects))
        return [ob.name for ob in objects]
    finally:
        for ob in objects:
            bpy.data.objects.remove(ob)


def command(module, folder):
    """Returns the command that runs a module. Only the main thread may call it."""
    script, told = str(Path(__file__).with_name("process.py")), ["--", module, str(folder)]
    if not bpy.app.binary_path:  # The module bpy of PyPI is no program.
        return [sys.executable, script, *told]
    return [bpy.app.binary_path, "--background", "--factory-startup", "--python", script, *told]


def run(command_line, folder, doing, progress):
    """Runs a command until it ends or the progress is cancelled. Returns what it has written into result.json.

    doing: the work, for the message of the error. Raises Cancelled, and Refused if there is no result.
    """
    log = folder / "log.txt"
    with open(log, "wb") as output:
        process = subprocess.Popen(
            command_line, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, **_without_window()
        )
    try:
        while process.poll() is None:
            if progress.cancelled:
                raise native.module.Cancelled("cancelled")
            native.module.pause(_LOOK)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    try:
        return json.loads((folder / "result.json").read_text())
    except (OSError, ValueError):
        said = log.read_text(errors="replace").strip().splitlines()[-1:] or ["it said nothing"]
        raise Refused(f"{doing} failed: the other Blender ended without a result, {said[0]}") from None


def _without_window():
    return {"creationflags": subprocess.CREATE_NO_WINDOW} if sys.platform == "win32" else {}
