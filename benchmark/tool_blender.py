# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs Blender's own Decimate modifier, for benchmark/tool_calls.py.

blender --background --factory-startup --python benchmark/tool_blender.py -- MODE PARAMETER

MODE is COLLAPSE, whose PARAMETER is a number of triangles, or DISSOLVE (*Planar*), whose PARAMETER is an angle in radians. The
mesh is read from vertices.npy and triangles.npy. The result is written to blender_vertices.npy and blender_triangles.npy, and
the processor seconds that the modifier takes to blender_seconds.npy.
"""

import math
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from addon.mesh import mesh_io  # noqa: E402


def decimated(mode, parameter):
    vertices, triangles = np.load("vertices.npy"), np.load("triangles.npy")
    ob = bpy.data.objects.new("ob", mesh_io.new_mesh("mesh", vertices, triangles))
    bpy.context.scene.collection.objects.link(ob)
    modifier = ob.modifiers.new("Decimate", "DECIMATE")
    modifier.decimate_type = mode
    if mode == "COLLAPSE":
        modifier.ratio = parameter / len(triangles)
    else:
        modifier.angle_limit = min(parameter, math.pi)
    started = time.process_time()
    mesh = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    seconds = time.process_time() - started
    arrays = mesh_io.read_mesh(mesh)
    return arrays.vertices, arrays.triangles, seconds


if __name__ == "__main__":
    mode, parameter = sys.argv[sys.argv.index("--") + 1 :]
    names = ("vertices", "triangles", "seconds")
    for name, array in zip(names, decimated(mode, float(parameter))):
        np.save(f"blender_{name}.npy", array)
