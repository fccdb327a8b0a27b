# SPDX-License-Identifier: GPL-3.0-or-later
"""Distance textures: one for each reference that is shown, made in a thread and kept while it is of use."""

import functools
import math

import bpy
import gpu
import numpy as np

from .. import mesh_io, native, preferences, volume
from ..errors import Refused
from . import work

_ROW = 2048  # texels in a row of triangle corners
_LONGEST = 2048  # texels along an axis that every GPU of Blender's takes
_NODES = 16_000_000  # 32 MB on the GPU
_SETTLE = 0.3  # seconds after a change of the tolerance: often it goes on changing
# A tolerance may grow this far towards the band of a grid that was made for a smaller one.
_REACH = 0.98

_fields = {}  # key -> Field
_failed = {}  # key, tolerance -> why there is none


class Field:
    """A reference on the GPU; of its textures those that are bound to a program of shaders.surface(nearest)."""

    def __init__(self, grid, tolerance, placement):
        self.grid = grid
        self.tolerance = tolerance
        self.to_nodes = grid.to_nodes
        self.placement = placement  # of the reference when the grid was made
        self.nearest = grid.precision < grid.INTERPOLATED
        self._textures = None

    def bind(self, shader):
        """While drawing."""
        if self._textures is None:
            self._textures = self._nearest() if self.nearest else {"field": _texture(self.grid.distances, "R16F")}
        for name, texture in self._textures.items():
            shader.uniform_sampler(name, texture)

    def _nearest(self):
        ids = self.grid.nearest.astype(np.int32).astype(np.float32)  # the largest, which is none, becomes -1
        corners = self.grid.corners.reshape(-1, 3)
        texels = np.zeros((-(-len(corners) // _ROW), _ROW, 4), np.float32)
        texels.reshape(-1, 4)[: len(corners), :3] = corners
        return {"field": _texture(ids, "R32F"), "corners": _texture(texels, "RGBA32F", 2)}


def _texture(texels, kind, axes=3):
    texels = np.ascontiguousarray(texels)
    data = gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    return gpu.types.GPUTexture(texels.shape[axes - 1 :: -1], format=kind, data=data)


def key_of(ob):
    """The same for the same reference at the same place; one that moves along with its object has its place there."""
    settings = ob.tolvol
    return settings.snapshot_fingerprint, tuple(settings.snapshot_matrix)


def field_of(ob, tolerance, changed):
    """(Field, None), or (None, why it is not there yet). One that is missing is made, and then changed() is called."""
    key = key_of(ob)
    field = _fields.get(key)
    if reason := _failed.get((key, tolerance)):
        return None, reason
    own = ob.tolvol.snapshot_kind == "SELF"
    if field and own and not volume.same_shape(field.placement, volume.reference_matrix(ob)):  # scaled since
        field = None
    # The size of an object that is turned, and a percentage of it, changes by the rounding of its matrix.
    if field is None or not math.isclose(field.tolerance, tolerance, rel_tol=1e-6):
        work.later(
            ("field", key),
            _SETTLE if field else 0,
            functools.partial(_prepare, ob.name, tolerance),
            functools.partial(_finish, key, tolerance, changed),
        )
        if field is None or tolerance > _REACH * field.grid.band:
            return None, "Preparing"
    return field, None


def at_hand(ob):
    """The Field that is at hand, or None."""
    return _fields.get(key_of(ob))


def _prepare(name, tolerance):
    ob = bpy.data.objects.get(name)
    if ob is None or ob.tolvol.snapshot is None:
        return None
    try:
        reference = volume.reference_of(ob)
    except Refused:
        return None
    threads = preferences.threads(bpy.context)

    def make(progress):
        built = volume.native_volume(reference, tolerance, threads, progress)
        grid = native.module.DisplayGrid(built, longest=_LONGEST, nodes=_NODES, threads=threads, progress=progress)
        return Field(grid, tolerance, reference.matrix)

    return make


def _finish(key, tolerance, changed, field, error):
    if error is None:
        _fields[key] = field
    elif not isinstance(error, native.module.Cancelled):
        _failed[key, tolerance] = str(error) or "not enough memory"
    changed()


def keep_only(keys):
    """Forgets the fields of other references."""
    for key in _fields.keys() - keys:
        del _fields[key]
    _failed.clear()


def vertex_to_nodes(field, ob):
    """(4, 4): from the object's vertices to the nodes of the field."""
    own = ob.tolvol.snapshot_kind == "SELF"
    return field.to_nodes @ (field.placement if own else mesh_io.matrix_array(ob.matrix_world))
