# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes whose faces are in another order than their corners, which Blender has before 4.0: each face keeps its own data."""

import bmesh
import bpy
import numpy as np
import pytest

from addon.appearance import normals, skirt
from addon.mesh import carry, mesh_io, protect
from scenes import activate, link, sheet

pytestmark = pytest.mark.skipif(
    bpy.app.version >= (4, 0), reason="From Blender 4.0 on corners are in the order of faces"
)


def mixed(missing=0):
    """A bumpy sheet of quads and triangles, with a UV map, flat-shaded, selected and red faces."""
    mesh = sheet(count=12).data
    built = bmesh.new()
    built.from_mesh(mesh)
    built.faces.ensure_lookup_table()
    bmesh.ops.delete(built, geom=[built.faces[66]][:missing], context="FACES_ONLY")
    built.faces.ensure_lookup_table()
    bmesh.ops.triangulate(built, faces=[built.faces[i] for i in range(0, 140, 5)])
    built.to_mesh(mesh)
    built.free()
    faces = np.arange(len(mesh.polygons))
    for name, values in (("use_smooth", faces % 3 > 0), ("select", faces % 7 > 2), ("material_index", faces // 60)):
        mesh.polygons.foreach_set(name, values)
    corners = mesh_io.column(mesh.loops, "vertex_index", 1, np.int32)
    uvs = mesh_io.column(mesh.vertices, "co", 3)[corners, :2]
    mesh.uv_layers.new(name="map").data.foreach_set("uv", uvs.ravel())
    return mesh


def shuffled(mesh):
    """Returns the same mesh with its faces in another order, and its corners in the same order."""
    order = np.random.default_rng(5).permutation(len(mesh.polygons))
    other = bpy.data.meshes.new("shuffled")
    for name in ("vertices", "loops", "polygons"):
        getattr(other, name).add(len(getattr(mesh, name)))
    other.vertices.foreach_set("co", mesh_io.column(mesh.vertices, "co", 3).ravel())
    other.loops.foreach_set("vertex_index", mesh_io.column(mesh.loops, "vertex_index", 1, np.int32))
    for name in ("loop_start", "loop_total", "use_smooth", "select", "material_index"):
        other.polygons.foreach_set(name, mesh_io.column(mesh.polygons, name, 1, np.int32)[order])
    other.update(calc_edges=True)
    other.uv_layers.new(name="map").data.foreach_set("uv", mesh_io.column(mesh.uv_layers[0].data, "uv", 2).ravel())
    assert not other.validate() and mesh_io.column(other.polygons, "loop_start", 1, np.int32)[0] > 0
    return other


def test_each_corner_has_its_face():
    mesh = shuffled(mixed())
    faces = mesh_io.faces_of_corners(mesh)
    for face in mesh.polygons:
        assert (faces[face.loop_start : face.loop_start + face.loop_total] == face.index).all()


def test_shading():
    mesh = mixed()
    other = shuffled(mesh)
    assert len(np.unique(carry.fans(mesh))) < len(mesh.loops) and np.array_equal(carry.fans(other), carry.fans(mesh))
    shades = []
    for each in (mesh, other):
        ob = link(bpy.data.objects.new("ob", each))
        activate(ob)
        bpy.ops.tolvol.set_reference()
        shades.append(normals._read(ob))
    assert np.abs(shades[0] - shades[1]).max() < 1e-3


def test_the_skirt():
    mesh = mixed()
    strips = [mesh_io.column(skirt.around(each, 0.1).vertices, "co", 3) for each in (mesh, shuffled(mesh))]
    assert np.allclose(*(np.unique(strip.round(5), axis=0) for strip in strips))


@pytest.mark.parametrize("kind", ("MATERIAL", "UV"))
def test_protected_edges(kind):
    mesh = mixed()
    places = mesh_io.column(mesh.uv_layers[0].data, "uv", 2)
    places[: len(places) // 2] += 5
    mesh.uv_layers[0].data.foreach_set("uv", places.ravel())
    chosen = [protect.on_edges(each, {kind}) for each in (mesh, shuffled(mesh))]
    assert chosen[0].any() and not chosen[0].all() and np.array_equal(*chosen)


def test_unselected_faces():
    mesh = mixed()
    chosen = [protect.unselected(link(bpy.data.objects.new("ob", each))) for each in (mesh, shuffled(mesh))]
    assert chosen[0].any() and not chosen[0].all() and np.array_equal(*chosen)


def test_the_faces_that_close_a_hole_take_the_uvs_of_their_corners():
    ob = link(bpy.data.objects.new("holed", shuffled(mixed(missing=1))))
    activate(ob)
    assert bpy.ops.tolvol.decimate(tolerance_percent=5, close_holes=True, target_triangles=10**6) == {"FINISHED"}
    corners = mesh_io.column(ob.data.loops, "vertex_index", 1, np.int32)
    places = mesh_io.column(ob.data.vertices, "co", 3)[corners, :2]
    assert len(ob.data.polygons) == 2 * 12**2
    assert np.abs(mesh_io.column(ob.data.uv_layers[0].data, "uv", 2) - places).max() < 1e-3
