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

import bpy
import numpy as np


def blender_mesh(vertices, triangles):
    mesh = bpy.data.meshes.new("mesh")
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", vertices.ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(len(triangles), 3, np.int32))
    mesh.update(calc_edges=True)
    return mesh


def decimated(mode, parameter):
    vertices, triangles = np.load("vertices.npy"), np.load("triangles.npy")
    ob = bpy.data.objects.new("ob", blender_mesh(vertices, triangles))
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
    mesh.calc_loop_triangles()
    points, corners = np.empty(3 * len(mesh.vertices)), np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.vertices.foreach_get("co", points)
    mesh.loop_triangles.foreach_get("vertices", corners)
    return points.reshape(-1, 3), corners.reshape(-1, 3), seconds


if __name__ == "__main__":
    mode, parameter = sys.argv[sys.argv.index("--") + 1 :]
    names = ("vertices", "triangles", "seconds")
    for name, array in zip(names, decimated(mode, float(parameter))):
        np.save(f"blender_{name}.npy", array)
