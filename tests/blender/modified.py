# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of modifiers share: meshes with a modifier, what they look like, and that nothing changed."""

import bpy
import pytest
from mathutils import Matrix

from addon.mesh.mesh_io import column
from scenes import activate, link, torus

PLACED = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.7, 4, (1, 2, 3)) @ Matrix.Diagonal((1, 2, 0.5, 1))


def coordinates(ob):
    return column(ob.data.vertices, "co", 3)


def modified(kind, matrix=None, settings=None):
    """Returns a torus with one modifier, and adds all objects that the modifier needs."""
    ob = torus(kind, matrix=matrix, around=32, across=16, noise=0.01)
    modifier = ob.modifiers.new(kind, kind)
    for name, value in (settings or {}).items():
        setattr(modifier, name, value)
    if kind == "LATTICE":
        cage = bpy.data.lattices.new("cage")
        modifier.object = link(bpy.data.objects.new("cage", cage), ob.matrix_world @ Matrix.Scale(3, 4))
        cage.points[0].co_deform.x += 0.5
    if kind == "SHRINKWRAP":
        modifier.target = torus("target", ob.matrix_world @ Matrix.Scale(1.1, 4), noise=0)
    activate(ob)
    return ob


def evaluated(ob):
    """Returns the positions of the vertices with the object's modifiers, as Blender shows them."""
    return column(ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices, "co", 3)


def refused(match, operator=None, **options):
    before = {ob.name: (coordinates(ob).tobytes(), len(ob.modifiers)) for ob in bpy.data.objects if ob.type == "MESH"}
    datablocks = [len(bpy.data.scenes), len(bpy.data.objects), len(bpy.data.meshes)]
    with pytest.raises(RuntimeError, match=match):
        (operator or bpy.ops.tolvol.apply_modifier)(**options)
    assert before == {
        ob.name: (coordinates(ob).tobytes(), len(ob.modifiers)) for ob in bpy.data.objects if ob.type == "MESH"
    }
    assert datablocks == [len(bpy.data.scenes), len(bpy.data.objects), len(bpy.data.meshes)]
