# SPDX-License-Identifier: GPL-3.0-or-later
"""Remembers an object as it was when an operator began to work on it."""

import hashlib

import bpy
import numpy as np

from ..mesh import mesh_io
from ..reference import measurements
from ..shared.errors import Refused


class Claim:
    def __init__(self, ob):
        self._ob = ob
        self.name = ob.name
        self._mesh, self._content, self._place = self._state(), self._digest(), self._placed()

    def concerns(self, data):
        """Whether this is the object, or its mesh."""
        try:
            return data in (self._ob, self._ob.data)
        except ReferenceError:  # check() finds that the object was deleted.
            return False

    def renewed(self):
        """Returns the object after an undone step that has changed nothing: Blender may have made object and mesh anew."""
        self._ob = bpy.data.objects.get(self.name, self._ob)
        self._mesh = self._ob.data.as_pointer(), *self._mesh[1:]
        return self._ob

    def check(self, thoroughly):
        """Raises Refused unless the outcome can still be written to the object. thoroughly: compare every vertex, too."""
        try:
            name = self._ob.name
        except ReferenceError:
            raise Refused(f"{self.name} was deleted meanwhile: nothing was changed") from None
        if name != self.name:
            raise Refused(f"{self.name} was renamed to {name} meanwhile: nothing was changed")
        if self._state() != self._mesh or thoroughly and self._digest() != self._content:
            raise Refused(f"The mesh or the mode of {name} was changed meanwhile: nothing more was changed")
        (matrix, reference), (matrix_before, reference_before) = self._placed(), self._place
        if reference != reference_before:
            raise Refused(f"The reference of {name} was changed meanwhile: nothing more was changed")
        # An object whose reference is its own mesh may be moved and turned: the reference goes along.
        own = self._ob.tolvol.reference_kind == "SELF" and measurements.same_shape(matrix_before, matrix)
        if not own and not np.array_equal(matrix, matrix_before):
            raise Refused(f"{name} was moved or scaled meanwhile: nothing more was changed")

    def _state(self):
        mesh = self._ob.data
        return mesh.as_pointer(), len(mesh.vertices), len(mesh.loops), len(mesh.polygons), self._ob.mode

    def _digest(self):
        """Returns a value that is equal for equal positions and faces."""
        self._ob.update_from_editmode()
        mesh = self._ob.data
        digest = hashlib.blake2b(mesh_io.column(mesh.vertices, "co", 3).tobytes(), digest_size=16)
        digest.update(mesh_io.column(mesh.loops, "vertex_index", 1, np.int32).tobytes())
        return digest.digest()

    def _placed(self):
        settings = self._ob.tolvol
        reference = settings.snapshot_fingerprint if settings.snapshot else "", settings.reference_kind
        return mesh_io.matrix_array(self._ob.matrix_world), reference
