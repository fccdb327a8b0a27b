# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates one modifier of an object on the base mesh, without the other modifiers, in a scene made for this."""

import bpy
import numpy as np

from .mesh_io import column


class Evaluation:
    """A context manager. `modifier` is a copy whose settings may be changed; the object and its modifiers stay as they are."""

    def __init__(self, ob, name):
        self._original = ob
        self._name = name

    def __enter__(self):
        # The copy keeps parent and constraints of the object, so that it lies where the object does: the modifier may
        # depend on the distance from other objects.
        self._ob = self._original.copy()
        self._ob.data = self._original.data.copy()
        self._ob.animation_data_clear()
        self._ob.property_unset("tolvol")  # The copy needs no reference, and no guard has to watch it.
        self._ob.shape_key_clear()
        for modifier in list(self._ob.modifiers):
            if modifier.name != self._name:
                self._ob.modifiers.remove(modifier)
        self.modifier = self._ob.modifiers[self._name]
        self.modifier.show_viewport = True
        self._scene = bpy.data.scenes.new(".evaluation")
        self._scene.frame_current = bpy.context.scene.frame_current
        self._scene.collection.objects.link(self._ob)
        return self

    def __exit__(self, *_):
        mesh = self._ob.data
        bpy.data.scenes.remove(self._scene)
        bpy.data.objects.remove(self._ob)
        bpy.data.meshes.remove(mesh)

    def mesh(self):
        """Returns the evaluated mesh, which is valid until the next call."""
        return self._evaluated()[0].data

    def new_mesh(self):
        """Returns the evaluated mesh as a new datablock, with all its attributes."""
        evaluated, depsgraph = self._evaluated()
        return bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)

    def _evaluated(self):
        layer = self._scene.view_layers[0]
        layer.update()
        return self._ob.evaluated_get(layer.depsgraph), layer.depsgraph


def same_faces(mesh, other):
    """Whether two meshes have the same faces on the same vertices. The positions of the vertices may differ."""
    return len(mesh.vertices) == len(other.vertices) and all(
        np.array_equal(*(column(collection, name, 1, np.int32) for collection in pair))
        for pair, name in (
            ((mesh.loops, other.loops), "vertex_index"),
            ((mesh.polygons, other.polygons), "loop_start"),
        )
    )
