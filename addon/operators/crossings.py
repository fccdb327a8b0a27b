# SPDX-License-Identifier: GPL-3.0-or-later
"""Selects the faces of an object that cross each other."""

import functools

import bpy
import numpy as np

from .. import preferences
from ..job import JobOperator, breathe
from ..mesh import mesh_io
from ..operation_settings import threads_setting
from ..reference import snapshots
from ..shared.proof import solidity
from .blocked import allowed, object_blocked
from .staying import show_selected


class TOLVOL_OT_select_crossing(JobOperator, bpy.types.Operator):
    """Switch to Edit Mode and select the faces that cross other faces, decided exactly: they meet anywhere but in the \
corners and edges that they share"""

    bl_idname = "tolvol.select_crossing"
    bl_label = "Select Crossing Faces"
    bl_options = {"REGISTER", "UNDO"}

    threads: threads_setting()

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        reason = object_blocked(ob)
        if not reason and not ob.data.polygons:
            reason = f"{ob.name} has no faces"
        return allowed(cls, reason)

    def prepare(self, context):
        context.view_layer.update()
        yield breathe
        threads = self.threads or preferences.threads(context)
        return functools.partial(self.find, snapshots.surface_of(self.ob).arrays, threads)

    @staticmethod
    def find(arrays, threads, progress):
        pairs = solidity.crossing_pairs(arrays, threads, progress)
        polygons = arrays.polygons[pairs]
        # A face that is not flat is several triangles, which are not compared with each other.
        return polygons[polygons[:, 0] != polygons[:, 1]], len(pairs) >= solidity.MOST_PAIRS

    def finish(self, context, outcome):
        polygons, more = outcome
        mesh = self.ob.data
        faces = np.zeros(len(mesh.polygons), bool)
        faces[polygons] = True
        if not faces.any():
            self.say({"INFO"}, "No faces cross")
            return {"CANCELLED"}
        mesh_io.select_faces(mesh, faces)
        show_selected(context, self.ob, (False, False, True))
        at_least = "at least " if more else ""
        self.say({"WARNING"}, f"{at_least}{faces.sum():,} of {len(faces):,} faces cross others")
        return {"FINISHED"}
