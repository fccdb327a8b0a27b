# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the normals of one mesh at the corners of another, by Blender's Data Transfer.

As a script it does so in a Blender of its own: FOLDER is its only argument. It reads task.json and meshes.blend from the
folder, and writes normals.npy and result.json.
"""

import json
import sys
import traceback
from pathlib import Path

import bpy
import numpy as np


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
        return _corner_normals(made[1].evaluated_get(layer.depsgraph).data)
    finally:
        for ob in made:
            bpy.data.objects.remove(ob)
        bpy.data.scenes.remove(scene)


def _corner_normals(mesh):
    # The script has no package to import this from.
    normals = np.empty(3 * len(mesh.loops), np.float32)
    if bpy.app.version >= (4, 1):
        mesh.corner_normals.foreach_get("vector", normals)
    else:
        mesh.calc_normals_split()
        mesh.loops.foreach_get("normal", normals)
    return normals.reshape(-1, 3)


def main(folder):
    names = json.loads((folder / "task.json").read_text())
    with bpy.data.libraries.load(str(folder / "meshes.blend")) as (_, target):
        target.objects = names
    np.save(folder / "normals.npy", transferred(*(ob.data for ob in target.objects)))
    return {}


if __name__ == "__main__":
    where = Path(sys.argv[-1])
    try:
        result = main(where)
    except Exception:
        traceback.print_exc()
        result = {"error": traceback.format_exc().strip().splitlines()[-1]}
    (where / "result.json").write_text(json.dumps(result))
