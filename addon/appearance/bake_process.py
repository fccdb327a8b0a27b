# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the normal map of one mesh in a Blender of its own, without a window (process.py).

It reads task.json and meshes.blend from the folder, with the mesh, the reference and its skirt (skirt.py), and writes
normals.png, and uvs.npy if it has unwrapped the mesh. A Blender of its own can be ended at any time, and the scene of the
user, its render engine, its selection and its materials stay as they are.
"""

import json

import bpy
import numpy as np

# A ray starts above the surface, on the cage, and ends so many tolerances below it. If any ray finds nothing, all rays are
# tried without an end as well.
_BELOW = 3.0


def main(folder):
    told = json.loads((folder / "task.json").read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    try:
        scene.render.engine = "CYCLES"
    except TypeError:
        return {"error": "no Cycles"}
    if told["threads"]:
        scene.render.threads_mode, scene.render.threads = "FIXED", told["threads"]
    scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", 1, False
    with bpy.data.libraries.load(str(folder / "meshes.blend")) as (_, target):
        target.objects = told["names"]
    low, *high = target.objects
    for ob in target.objects:
        scene.collection.objects.link(ob)
        ob.data.materials.clear()
    bpy.context.view_layer.objects.active = low
    low.select_set(True)
    if not low.data.uv_layers:
        _unwrap(told["size"])
        uvs = np.empty(2 * len(low.data.loops), np.float32)
        low.data.uv_layers[0].data.foreach_get("uv", uvs)
        np.save(folder / "uvs.npy", uvs)
    return _Bake(told, low, high).run(folder / "normals.png")


def _unwrap(size):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(island_margin=4 / size)
    bpy.ops.object.mode_set(mode="OBJECT")


class _Bake:
    def __init__(self, told, low, high):
        self._size, self._margin = told["size"], told["margin"]
        self._above, self._below = told["above"], _BELOW * told["tolerance"]
        self._low, self._high = low, high
        white = bpy.data.materials.new("white")
        white.use_nodes = True
        nodes = white.node_tree.nodes
        nodes.clear()
        output, emission = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeEmission")
        white.node_tree.links.new(emission.outputs[0], output.inputs[0])
        # The active image of a material is the one to which Blender bakes.
        self._target = nodes.new("ShaderNodeTexImage")
        nodes.active = self._target
        for ob in (low, *high):
            ob.data.materials.append(white)
            ob.data.polygons.foreach_set("material_index", np.zeros(len(ob.data.polygons), np.int32))

    def run(self, path):
        covered = self._white(None)
        if not covered.any():
            return {"error": "no area"}
        tries = []
        for reach in (self._above + self._below, 0.0):  # Blender takes 0 for no limit.
            tries.append((int((covered & ~self._white(reach)).sum()), reach))
            if not tries[-1][0]:
                break
        missed, reach = min(tries, key=lambda attempt: attempt[0])
        image = self._image()
        self._bake(image, "NORMAL", reach, self._margin)
        image.filepath_raw, image.file_format = str(path), "PNG"
        image.save()
        return {"covered": int(covered.sum()), "missed": missed, "reach": reach}

    def _white(self, reach):
        """Returns the pixels whose rays find the reference, or all pixels of the mesh if `reach` is None, (n,) bool."""
        image = self._image()
        self._bake(image, "EMIT", reach, 0)
        pixels = np.empty(4 * self._size**2, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels[::4] > 0.5

    def _image(self):
        image = bpy.data.images.new("normals", self._size, self._size)
        image.colorspace_settings.name = "Non-Color"
        return image

    def _bake(self, image, kind, reach, margin):
        self._target.image = image
        for ob in self._high:
            ob.select_set(reach is not None)
        bpy.ops.object.bake(
            type=kind,
            use_selected_to_active=reach is not None,
            use_cage=True,
            cage_extrusion=self._above,
            max_ray_distance=reach or 0.0,
            margin=margin,
            use_clear=True,
            normal_space="TANGENT",
            target="IMAGE_TEXTURES",
            save_mode="INTERNAL",
        )
