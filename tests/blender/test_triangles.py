# SPDX-License-Identifier: GPL-3.0-or-later
"""The triangles that are proved are those that Blender draws and exports, also where it cuts a bent quad along its other
diagonal."""

import bpy
import numpy as np
import pytest

from addon.mesh import mesh_io
from scenes import torus


def drawn(ob):
    bpy.context.view_layer.update()
    mesh = ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    mesh.calc_loop_triangles()
    return mesh_io.column(mesh.loop_triangles, "vertices", 3, np.int32)


def read_as_drawn(mesh):
    mesh.calc_loop_triangles()
    names = ("vertices", 3), ("loops", 3), ("polygon_index", 1)
    return [mesh_io.column(mesh.loop_triangles, name, width, np.int32) for name, width in names]


@pytest.mark.parametrize("starts", ([0, 3], [3, 0], [0, 4]))
def test_triangles_are_read_as_blender_draws_them_in_whatever_order_they_are_stored(starts):
    if bpy.app.version >= (4, 0) and starts != [0, 3]:
        pytest.skip("this Blender stores faces in the order of their corners")
    mesh = bpy.data.meshes.new("two")
    mesh.vertices.add(5)
    mesh.vertices.foreach_set("co", [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 2, 1])
    mesh.loops.add(6)
    mesh.loops.foreach_set("vertex_index", [0, 1, 2, 0, 2, 3] if starts != [0, 4] else [0, 1, 2, 3, 4, 3])
    mesh.polygons.add(2)
    mesh.polygons.foreach_set("loop_start", starts)
    if bpy.app.version < (4, 0):
        mesh.polygons.foreach_set("loop_total", [3, 3] if starts != [0, 4] else [4, 2])
    mesh.update(calc_edges=True)
    assert mesh_io.all_triangles(mesh) == (starts == [0, 3])
    found = mesh_io.read_mesh(mesh)
    for read, expected in zip((found.triangles, found.corners, found.polygons), read_as_drawn(mesh)):
        assert read.dtype == expected.dtype and np.array_equal(read, expected)


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
