# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the normals of the reference into an image for the mesh, by Cycles in a Blender of its own (bake_process.py).

Rays go from a cage around the mesh to the reference, which is within the tolerance of the mesh. Each vertex of the cage is
two tolerances away from its vertex of the mesh, along the normal there. Beside a sharp edge this normal is tilted against
the faces, so that the cage is lower over them.
"""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ..mesh.mesh_io import matrix_array
from ..shared.errors import Refused
from . import normals, other_blender, skirt

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
        other_blender.write_task(self._folder, task)
        self._command = other_blender.command("bake_process", self._folder)

    def _write(self, ob, shading, tolerance):
        """Writes the mesh, the reference and its skirt to a file, and returns the names of their objects there."""
        meshes = [ob.data.copy(), normals.original_in_place(ob)]
        try:
            if meshes[0].shape_keys:
                _clear_shape_keys(meshes[0])
            if shading is not None:
                shading.write(meshes[0])
            if border := skirt.around(meshes[1], _SKIRT * tolerance):
                meshes.append(border)
            return other_blender.write(self._folder, meshes)
        finally:
            for mesh in meshes:
                bpy.data.meshes.remove(mesh)

    def run(self, progress):
        result = other_blender.run(self._command, self._folder, f"Baking {self._name}", progress)
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


def _clear_shape_keys(mesh):
    ob = bpy.data.objects.new(".bake", mesh)
    ob.shape_key_clear()
    bpy.data.objects.remove(ob)
