# SPDX-License-Identifier: GPL-3.0-or-later
"""The triangles that are proved are those that Blender draws and exports, also where it cuts a bent quad along its other
diagonal."""

import bpy
import numpy as np

from addon.mesh import mesh_io
from scenes import torus


def drawn(ob):
    bpy.context.view_layer.update()
    mesh = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    mesh.calc_loop_triangles()
    return mesh_io.column(mesh.loop_triangles, "vertices", 3, np.int32)


def test_bent_quads_are_cut_as_blender_draws_them():
    rng = np.random.default_rng(1)
    for seed in range(5):
        ob = torus(around=24, across=12, noise=0.1, seed=seed)
        before = mesh_io.read_mesh(ob.data)
        assert np.array_equal(before.triangles, drawn(ob))
        places = before.vertices + rng.normal(0, 0.05, before.vertices.shape).astype(np.float32)
        expected = mesh_io.triangles_at(ob.data, places)
        assert not np.array_equal(expected, before.triangles)
        mesh_io.move_vertices(ob.data, before.vertices, places)
        assert np.array_equal(mesh_io.read_mesh(ob.data).triangles, expected)
        assert np.array_equal(drawn(ob), expected)
