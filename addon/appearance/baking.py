# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the normals of the reference into an image for the mesh, by Cycles in a Blender of its own (bake_process.py).

Rays go from a cage around the mesh to the reference, which is within the tolerance of the mesh. Each vertex of the cage is
two tolerances away from its vertex of the mesh, along the normal there. Beside a sharp edge this normal is tilted against
the faces, so that the cage is lower over them.
"""

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from .. import native
from ..errors import Refused
from ..mesh.mesh_io import matrix_array
from . import normals, skirt

_LOOK = 0.05  # The thread looks every so many seconds whether it was cancelled.
# Each island of the UV map is continued beyond its border by 1 / _MARGIN of the image's width, so that no seam is seen.
_MARGIN = 128
_ABOVE = 2.0  # tolerances
_SKIRT = 3.0  # tolerances by which the reference is continued beyond its borders


@dataclass(frozen=True)
class Baked:
    path: Path  # of the image
    uvs: np.ndarray | None  # (2 * corners,) float32 if the mesh had no UV map
    covered: int  # number of pixels that the mesh covers
    missed: int  # number of these pixels whose rays have not found the reference


class Task:
    """Writes into `folder` what the other Blender needs. run() is the work for the thread."""

    def __init__(self, ob, shading, tolerance, size, threads, folder):
        self._name, self._folder = ob.name, Path(folder)
        # The meshes are baked in the space of the object, in which a tolerance is at most so long.
        longest = tolerance / np.linalg.svd(matrix_array(ob.matrix_world)[:3, :3], compute_uv=False)[-1]
        task = {
            "names": self._write(ob, shading, longest),
            "size": size,
            "margin": max(size // _MARGIN, 2),
            "tolerance": longest,
            "above": _ABOVE * longest,
            "threads": threads,
        }
        (self._folder / "task.json").write_text(json.dumps(task))
        self._command = _command(self._folder)

    def _write(self, ob, shading, tolerance):
        """Writes the mesh, the reference and its skirt to a file, and returns the names of their objects there."""
        meshes, objects = [ob.data.copy(), normals.original_in_place(ob)], []
        try:
            if meshes[0].shape_keys:
                _clear_shape_keys(meshes[0])
            if shading is not None:
                shading.write(meshes[0])
            if border := skirt.around(meshes[1], _SKIRT * tolerance):
                meshes.append(border)
            for mesh in meshes:
                mesh.materials.clear()
                objects.append(bpy.data.objects.new(".bake", mesh))
            bpy.data.libraries.write(str(self._folder / "meshes.blend"), set(objects))
            return [each.name for each in objects]
        finally:
            for each in objects:
                bpy.data.objects.remove(each)
            for mesh in meshes:
                bpy.data.meshes.remove(mesh)

    def run(self, progress):
        log = self._folder / "log.txt"
        with open(log, "wb") as output:
            process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, **_without_window()
            )
        try:
            while process.poll() is None:
                if progress.cancelled:
                    raise native.module.Cancelled("cancelled")
                time.sleep(_LOOK)
        finally:
            if process.poll() is None:
                process.kill()
                process.wait()
        try:
            result = json.loads((self._folder / "result.json").read_text())
        except (OSError, ValueError):
            said = log.read_text(errors="replace").strip().splitlines()[-1:] or ["it said nothing"]
            raise Refused(f"Baking {self._name} failed: the other Blender ended without a result, {said[0]}") from None
        if "error" in result:
            raise Refused(self._why(result["error"]))
        uvs = self._folder / "uvs.npy"
        return Baked(
            self._folder / "normals.png", np.load(uvs) if uvs.exists() else None, result["covered"], result["missed"]
        )

    def _why(self, error):
        if error == "no Cycles":
            return "This Blender has no Cycles, which bakes: install a Blender with the add-on Cycles Render Engine"
        if error == "no area":
            return f"The UV map of {self._name} has no area: unwrap it, or remove it, and one is made"
        return f"Baking {self._name} failed: {error}"


def _command(folder):
    script = str(Path(__file__).parent / "bake_process.py")
    if not bpy.app.binary_path:  # The module bpy of PyPI is no program.
        return [sys.executable, script, "--", str(folder)]
    options = ["--background", "--factory-startup", "--python", script]
    return [bpy.app.binary_path, *options, "--", str(folder)]


def _without_window():
    return {"creationflags": subprocess.CREATE_NO_WINDOW} if sys.platform == "win32" else {}


def _clear_shape_keys(mesh):
    ob = bpy.data.objects.new(".bake", mesh)
    ob.shape_key_clear()
    bpy.data.objects.remove(ob)
