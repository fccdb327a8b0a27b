# SPDX-License-Identifier: GPL-3.0-or-later
"""Shades a mesh by the normals of its reference at the nearest points.

Blender's Data Transfer reads the normals, from the original with its own shading. Each corner looks from a place slightly
inside its face: exactly at a sharp edge the nearest face of the reference would be any of those that meet there. Where the
normals of two faces at a common edge differ much, the edge is marked as sharp, and all other corners at a vertex get one
normal.
"""

import contextlib
import math
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..mesh.carry import fans, mean
from ..mesh.mesh_io import column, faces_of_corners, following_corners, matrix_array
from ..reference import originals, snapshots
from ..shared.errors import Refused
from . import other_blender, transfer_process

# A corner looks from a place that is this share of the way to the centre of its face.
_INSIDE = 0.02
# Edges are sharp where the normals of their faces differ by more.
_SHARP = math.radians(20)
# An original that is shaded flat everywhere counts as smooth, but for edges of more than this angle.
_FLAT = math.radians(30)

# Meshes with more corners together are looked at by another Blender, which takes about a second more: with so many, this
# one would stand still for half a second.
_AT_ONCE = 300_000


@dataclass(frozen=True)
class Shading:
    """Normals for the corners of a mesh, (corners, 3), and the edges that are sharp, (edges,) bool."""

    normals: np.ndarray
    sharp: np.ndarray

    def write(self, mesh):
        mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
        mesh.edges.foreach_set("use_edge_sharp", self.sharp | column(mesh.edges, "use_edge_sharp", 1, bool))
        if bpy.app.version < (4, 1):
            mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.pi
        mesh.update()
        normals = mean(self.normals, fans(mesh)).astype(np.float64)
        mesh.normals_split_custom_set(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))


def original_in_place(ob):
    """Returns a new mesh: the original of `ob` in the space of `ob`, shaded as it shall be looked at."""
    mesh = originals.kept(ob).copy()
    apart = Matrix(np.linalg.solve(matrix_array(ob.matrix_world), snapshots.reference_matrix(ob)))
    if apart != Matrix():
        mesh.transform(apart)
        if apart.determinant() < 0:
            mesh.flip_normals()
    if not mesh.has_custom_normals and not column(mesh.polygons, "use_smooth", 1, bool).any():
        mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
        if bpy.app.version < (4, 1):
            mesh.use_auto_smooth, mesh.auto_smooth_angle = True, _FLAT
        else:
            mesh.set_sharp_from_angle(angle=_FLAT)
    return mesh


def shading(ob):
    """A generator for the steps of an operator, which changes nothing: returns the Shading of the mesh of `ob` by its
    reference. For large meshes it yields work for a thread."""
    if len(originals.kept(ob).loops) + len(ob.data.loops) <= _AT_ONCE:
        normals = _read(ob)
    else:
        with other_blender.temporary_folder("shade-") as folder:
            normals = yield _Task(ob, Path(folder)).run
    return Shading(normals, _sharp(ob.data, normals))


@contextlib.contextmanager
def _compared(ob):
    """Gives the mesh that is looked at and the one that looks, as long as the context lasts."""
    meshes = original_in_place(ob), _separate_faces(ob.data)
    try:
        yield meshes
    finally:
        for mesh in meshes:
            bpy.data.meshes.remove(mesh)


def _read(ob):
    """Returns the normals of the reference for each corner of the mesh of `ob`, (corners, 3)."""
    with _compared(ob) as meshes:
        return transfer_process.transferred(*meshes)


class _Task:
    """Writes into `folder` what another Blender needs to read the same normals, and run() returns them: Blender does not let
    a thread evaluate a modifier."""

    def __init__(self, ob, folder):
        self._name, self._folder = ob.name, folder
        with _compared(ob) as meshes:
            other_blender.write_task(folder, other_blender.write(folder, meshes))
        self._command = other_blender.command("transfer_process", folder)

    def run(self, progress):
        doing = f"Reading the normals for {self._name}"
        result = other_blender.run(self._command, self._folder, doing, progress)
        if "error" in result:
            raise Refused(f"{doing} failed: {result['error']}")
        return np.load(self._folder / "normals.npy")


def _sharp(mesh, normals):
    """Returns (edges,) bool: the edges whose two faces have normals that differ much there."""
    edges, starts = (column(mesh.loops, name, 1, np.int32) for name in ("edge_index", "vertex_index"))
    following = following_corners(mesh)
    order = np.argsort(edges, kind="stable")
    one, two = order[(np.bincount(edges, minlength=len(mesh.edges)) == 2)[edges[order]]].reshape(-1, 2).T
    turned = starts[one] == starts[two]  # The two faces run along the edge in the same direction.
    sharp = np.zeros(len(mesh.edges), bool)
    for first, second in (
        (one, np.where(turned, two, following[two])),
        (following[one], np.where(turned, following[two], two)),
    ):
        apart = np.einsum("ij,ij->i", normals[first], normals[second]) < math.cos(_SHARP)
        sharp[edges[one[apart]]] = True
    return sharp


def _separate_faces(mesh):
    """Returns a new mesh with the faces of `mesh`, each on vertices of its own that are slightly inside it."""
    sizes, begins = (column(mesh.polygons, name, 1, np.int32) for name in ("loop_total", "loop_start"))
    places = column(mesh.vertices, "co", 3)[column(mesh.loops, "vertex_index", 1, np.int32)]
    faces = faces_of_corners(mesh)
    centres = np.stack([np.bincount(faces, axis, len(sizes)) for axis in places.T], 1) / sizes[:, None]
    places += _INSIDE * (centres[faces] - places)
    apart = bpy.data.meshes.new(".appearance")
    apart.vertices.add(len(places))
    apart.vertices.foreach_set("co", places.ravel())
    apart.loops.add(len(places))
    apart.loops.foreach_set("vertex_index", np.arange(len(places), dtype=np.int32))
    apart.polygons.add(len(sizes))
    apart.polygons.foreach_set("loop_start", begins)
    if bpy.app.version < (4, 0):
        apart.polygons.foreach_set("loop_total", sizes)
    if bpy.app.version < (4, 1):
        apart.use_auto_smooth = True
    apart.update(calc_edges=True)
    return apart
