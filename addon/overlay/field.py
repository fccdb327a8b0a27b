# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps a tree of triangles for each surface from which distances are shown: the shader finds distances in it.

A tree of a reference is made in a thread and kept while an object shows its deviation from the reference. Where the reference
is shown by its distance from the mesh, the tree is of the mesh, and is made anew after each change. No tree depends on the
tolerance.
"""

import functools

import bpy
import gpu
import numpy as np

from .. import native, preferences
from ..background import queue
from ..mesh import mesh_io
from ..reference import measurements, snapshots
from ..shared import volumes
from ..shared.errors import Refused
from . import shaders

# A tolerance below so many times the rounding error of the shader cannot be shown.
_FINEST = 4

# A tree of a mesh needs little of the volume from which it is made: a grid of so many nodes per tolerance.
_COARSE = 1 / 64
_EVERY = 0.1  # seconds between two trees of a mesh that goes on changing

_REFERENCE, _MESH = TASKS = "tree of a reference", "tree of a mesh"  # kinds of tasks in the queue

_fields = {}  # key -> Field
_failed = {}  # key -> the reason why the Field could not be made
_of_meshes = {}  # name of an object -> Field of its mesh
_meshes_failed = {}  # name of an object -> (number of the change, the reason why the Field could not be made)


class Field:
    """A surface on the GPU, from which distances are measured."""

    def __init__(self, tree, matrix, change=0):
        self.tree = tree
        self.to_frame = tree.to_frame
        self.matrix = matrix  # the matrix of the surface to the world when the tree was made
        self.change = change  # which change of the surface the tree is of
        self.leaves = len(tree.nodes) // 4
        self._textures = None

    def bind(self, shader):
        """Gives the textures of the tree to a shader. It may be called only while a 3D view is drawn."""
        if self._textures is None:
            self._textures = {"nodes": _texture(self.tree.nodes), "corners": _texture(self.tree.corners)}
        for name, texture in self._textures.items():
            shader.uniform_sampler(name, texture)


def _texture(rows):
    """Returns a texture with rows of shaders.ROW texels that holds (k, 4) float32."""
    texels = np.zeros((-(-len(rows) // shaders.ROW), shaders.ROW, 4), np.float32)
    texels.reshape(-1, 4)[: len(rows)] = rows
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    return gpu.types.GPUTexture((shaders.ROW, len(texels)), format="RGBA32F", data=data)


def key_of(ob):
    """Returns a key that is equal for equal references at the same place.

    A reference that moves along with its object keeps its key: the place is the one where it was set.
    """
    settings = ob.tolvol
    return settings.snapshot_fingerprint, tuple(settings.snapshot_matrix)


def field_of(ob, tolerance, changed):
    """Returns (Field, None), or (None, why there is no Field yet).

    A missing Field is made in a thread, and then changed() is called.
    """
    key = key_of(ob)
    field = _fields.get(key)
    if reason := _failed.get(key):
        return None, reason
    own = ob.tolvol.snapshot_kind == "SELF"
    # A tree of a reference that was scaled since it was made has wrong distances.
    if field is None or own and not measurements.same_shape(field.matrix, snapshots.reference_matrix(ob)):
        queue.later(
            (_REFERENCE, key),
            0,
            functools.partial(_prepare, ob.name, tolerance),
            functools.partial(_finish, key, changed),
        )
        return None, "Preparing"
    if tolerance < finest(field.tree):
        return None, "The tolerance is too small to be shown by colours"
    return field, None


def field_of_mesh(ob, surface, tolerance, changed):
    """Returns (Field, None) of the mesh that the 3D view shows, or (None, why there is no Field yet).

    surface: the Surface of `ob`. The Field may be of the mesh before its last change: is_of() tells. A missing Field is made
    in a thread, and then changed() is called.
    """
    name, field = ob.name, _of_meshes.get(ob.name)
    failed = _meshes_failed.get(name)
    if failed is not None and failed[0] == surface.changes:
        return None, failed[1]
    if field is None or not is_of(field, ob, surface):
        queue.later(
            (_MESH, name),
            _EVERY if field else 0,
            functools.partial(_prepare_mesh, name, surface, tolerance),
            functools.partial(_finish_mesh, name, surface.changes, changed),
        )
    if field is None:
        return None, "Preparing"
    if tolerance < finest(field.tree):
        return None, "The tolerance is too small to be shown by colours"
    return field, None


def is_of(field, ob, surface):
    """Whether a Field of a mesh is of the mesh as it is now."""
    return field.change == surface.changes and measurements.same_shape(
        field.matrix, mesh_io.matrix_array(ob.matrix_world)
    )


def _prepare_mesh(name, surface, tolerance):
    ob = bpy.data.objects.get(name)
    if ob is None or surface.all_triangles is None:
        return None
    matrix, threads = mesh_io.matrix_array(ob.matrix_world), preferences.threads(bpy.context)
    vertices, triangles, change = surface.vertices, surface.all_triangles, surface.changes

    def make(progress):
        volume = native.module.ToleranceVolume(
            vertices, triangles, tolerance, to_world=matrix, precision=_COARSE, threads=threads, progress=progress
        )
        return Field(native.module.DisplayTree(volume, progress=progress), matrix, change)

    return make


def _finish_mesh(name, change, changed, field, error):
    if error is None:
        _of_meshes[name] = field
    elif not isinstance(error, native.module.Cancelled):
        _meshes_failed[name] = change, str(error) or "not enough memory"
    changed()


def keep_only_meshes(names):
    """Forgets the fields of all meshes except those of the objects with these names."""
    for kept in (_of_meshes, _meshes_failed):
        for name in kept.keys() - names:
            del kept[name]


def finest(tree):
    """Returns the least distance that colours can show, in world units."""
    return _FINEST * tree.ROUNDING / tree.scale


def at_hand(ob):
    """Returns the Field of the object's reference if it has been made, else None."""
    return _fields.get(key_of(ob))


def _prepare(name, tolerance):
    ob = bpy.data.objects.get(name)
    if ob is None or ob.tolvol.snapshot is None:
        return None
    try:
        reference = snapshots.reference_of(ob)
    except Refused:
        return None
    threads = preferences.threads(bpy.context)

    def make(progress):
        built = volumes.native_volume(reference, tolerance, threads, progress)
        return Field(native.module.DisplayTree(built, progress=progress), reference.matrix)

    return make


def _finish(key, changed, field, error):
    if error is None:
        _fields[key] = field
    elif not isinstance(error, native.module.Cancelled):
        _failed[key] = str(error) or "not enough memory"
    changed()


def keep_only(keys):
    """Forgets the fields of all references except those with these keys."""
    for key in _fields.keys() - keys:
        del _fields[key]
    _failed.clear()


def vertex_to_frame(field, ob):
    """Returns (4, 4): the matrix from the object's vertices to the frame of the tree of its reference."""
    own = ob.tolvol.snapshot_kind == "SELF"
    return field.to_frame @ (field.matrix if own else mesh_io.matrix_array(ob.matrix_world))


def reference_to_frame(field, ob):
    """Returns (4, 4): the matrix from the vertices of the object's reference to the frame of the tree of its mesh."""
    if ob.tolvol.snapshot_kind == "SELF":
        return field.to_frame @ field.matrix
    moved = field.matrix @ np.linalg.inv(mesh_io.matrix_array(ob.matrix_world))
    return field.to_frame @ moved @ snapshots.reference_matrix(ob)
