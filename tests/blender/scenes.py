# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes meshes for the tests. A second judge samples distances with Blender's own tree of triangles, without tolvol."""

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree

from addon.mesh import mesh_io
from addon.shared.surface import to_world


def empty_scene():
    """Opens an empty file. The preferences stay: to read them again takes several times as long."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def add_object(name, vertices, faces, matrix=None):
    """A new object with a tolerance of 1 %, selected and active."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(vertices).tolist(), [], [[int(vertex) for vertex in face] for face in faces])
    ob = bpy.data.objects.new(name, mesh)
    ob.tolvol.tolerance_percent = 1
    return link(ob, matrix)


def link(ob, matrix=None):
    bpy.context.collection.objects.link(ob)
    if matrix is not None:
        ob.matrix_world = matrix
    activate(ob)
    return ob


def activate(ob):
    for other in bpy.context.selected_objects:
        other.select_set(False)
    ob.select_set(True)
    bpy.context.view_layer.objects.active = ob
    bpy.context.view_layer.update()


def torus_arrays(around=48, across=24, noise=0.004, seed=1):
    """Returns vertices and quads of a torus of a size of about 2.5, with the roughness of a scan."""
    u, v = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.arange(across) * 2 * np.pi / across, indexing="ij")
    ring = 0.9 + 0.35 * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), 0.35 * np.sin(v)], -1).reshape(-1, 3)
    vertices += np.random.default_rng(seed).normal(0, noise, vertices.shape)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    after_i, after_j = (i + 1) % around, (j + 1) % across
    quads = np.stack([i * across + j, after_i * across + j, after_i * across + after_j, i * across + after_j], 1)
    return vertices.astype(np.float32), quads


def torus(name="torus", matrix=None, **options):
    return add_object(name, *torus_arrays(**options), matrix)


def dissolve(ob, rng, share=0.2):
    """Makes faces of many corners out of those at a share of the edges, which are chosen at random."""
    edited = bmesh.new()
    edited.from_mesh(ob.data)
    edges = [edge for edge in edited.edges if rng.random() < share]
    bmesh.ops.dissolve_edges(edited, edges=edges, use_verts=False)
    edited.to_mesh(ob.data)
    edited.free()


def changed_ball(change):
    """Returns a ball of 5,120 triangles, whose vertices went to change(positions) after its reference was set."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
    ob = bpy.context.object
    ob.name = "ball"
    bpy.ops.tolvol.set_reference()
    ob.data.vertices.foreach_set("co", change(mesh_io.column(ob.data.vertices, "co", 3)).ravel())
    ob.data.update()
    return ob


def sheet_arrays(count=30, bumps=0.05):
    """Vertices and quads of an open wavy square."""
    x, y = np.meshgrid(np.linspace(-1, 1, count + 1), np.linspace(-1, 1, count + 1), indexing="ij")
    vertices = np.stack([x, y, bumps * np.sin(3 * x) * np.cos(2 * y)], -1).reshape(-1, 3).astype(np.float32)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(count), np.arange(count), indexing="ij"))
    corner = i * (count + 1) + j
    return vertices, np.stack([corner, corner + count + 1, corner + count + 2, corner + 1], 1)


def sheet(name="sheet", matrix=None, **options):
    return add_object(name, *sheet_arrays(**options), matrix)


def moved_up(share=0.25, height=0.1):
    """Makes a flat sheet its own reference and then lifts the vertices beyond x = 1 - 2 share."""
    ob = sheet(count=20, bumps=0.0)
    bpy.ops.tolvol.set_reference()
    for vertex in ob.data.vertices:
        if vertex.co.x > 1 - 2 * share - 1e-6:
            vertex.co.z += height
    ob.data.update()
    activate(ob)
    return ob


def cage(name="cage", points=(4, 4, 4), size=(2.8, 2.8, 1.0), matrix=None, interpolation="KEY_BSPLINE"):
    """Adds a lattice object around the torus. The torus stays the active object."""
    active = bpy.context.view_layer.objects.active
    data = bpy.data.lattices.new(name)
    data.points_u, data.points_v, data.points_w = points
    data.interpolation_type_u = data.interpolation_type_v = data.interpolation_type_w = interpolation
    # Blender sets the points of a lattice 1 apart.
    scale = [length / max(count - 1, 1) for length, count in zip(size, points)]
    ob = link(bpy.data.objects.new(name, data), (matrix or Matrix()) @ Matrix.Diagonal((*scale, 1)))
    if active is not None:
        activate(active)
    return ob


def plates_with_t_junctions():
    """Returns an object of two plates side by side, one with twice as many vertices along the line where they meet, x = 0."""
    vertices, quads = [], []
    for first, count in ((-1, 4), (0, 8)):
        x, y = np.meshgrid(np.linspace(first, first + 1, count + 1), np.linspace(0, 1, count + 1), indexing="ij")
        i, j = (index.ravel() for index in np.meshgrid(np.arange(count), np.arange(count), indexing="ij"))
        corner = i * (count + 1) + j + sum(map(len, vertices))
        quads.append(np.stack([corner, corner + count + 1, corner + count + 2, corner + 1], 1))
        vertices.append(np.stack([x, y, 0 * x], -1).reshape(-1, 3).astype(np.float32))
    return add_object("plates", np.concatenate(vertices), np.concatenate(quads))


def world_triangles(ob):
    """Returns (vertices float64 in the world, triangles) of the stored mesh."""
    bpy.context.view_layer.update()
    arrays = mesh_io.read_mesh(ob.data)
    return to_world(arrays.vertices, mesh_io.matrix_array(ob.matrix_world)), arrays.triangles


def stored(ob):
    """Returns the bytes of all coordinates and triangles."""
    return [array.tobytes() for array in (*world_triangles(ob), mesh_io.column(ob.data.vertices, "co", 3))]


def sampled_distance(surface, other, samples=20_000, seed=7):
    """The largest distance of random points of one surface from the other, by Blender's own tree: a lower bound."""
    (vertices, triangles), (other_vertices, other_triangles) = surface, other
    tree = BVHTree.FromPolygons([Vector(v) for v in other_vertices], other_triangles.tolist())
    rng = np.random.default_rng(seed)
    corners = vertices[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen = corners[rng.choice(len(corners), samples, p=areas / areas.sum())]
    r, s = np.sqrt(rng.random(samples)), rng.random(samples)
    weights = np.stack([1 - r, r * (1 - s), r * s], 1)
    points = np.vstack([np.einsum("nk,nkx->nx", weights, chosen), vertices[np.unique(triangles)]])
    return max(tree.find_nearest(Vector(point))[3] for point in points)


def assert_within(surface, reference, tolerance):
    """Asserts that no sample of either surface is beyond the tolerance of the other (the tree computes in float32)."""
    slack = 1e-6 * np.abs(reference[0]).max()
    assert sampled_distance(surface, reference) <= tolerance + slack
    assert sampled_distance(reference, surface) <= tolerance + slack
