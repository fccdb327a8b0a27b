# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the normals of one mesh at the corners of another, by Blender's Data Transfer.

In a Blender of its own (process.py) it reads task.json and meshes.blend from the folder, and writes normals.npy.
"""

import json

import bpy
import numpy as np

from ..mesh.carry import corner_normals


def transferred(source, looking):
    """Returns the normals of `source` at the nearest points, for each corner of `looking`, (corners, 3) float32."""
    scene = bpy.data.scenes.new(".appearance")
    made = [bpy.data.objects.new(".appearance", mesh) for mesh in (source, looking)]
    try:
        for ob in made:
            scene.collection.objects.link(ob)
        modifier = made[1].modifiers.new("normals", "DATA_TRANSFER")
        modifier.object = made[0]
        modifier.use_loop_data, modifier.data_types_loops = True, {"CUSTOM_NORMAL"}
        modifier.loop_mapping = "POLYINTERP_NEAREST"
        layer = scene.view_layers[0]
        layer.update()
        return corner_normals(made[1].evaluated_get(layer.depsgraph).data)
    finally:
        for ob in made:
            bpy.data.objects.remove(ob)
        bpy.data.scenes.remove(scene)


def main(folder):
    names = json.loads((folder / "task.json").read_text())
    with bpy.data.libraries.load(str(folder / "meshes.blend")) as (_, target):
        target.objects = names
    np.save(folder / "normals.npy", transferred(*(ob.data for ob in target.objects)))
    return {}
