# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimate puts the vertex of a T-junction into the face that it lies on: Blender's mesh is the computed one, and UV maps,
colours and materials of the faces stay theirs."""

import json

import bpy
import numpy as np
import pytest

from addon.mesh.mesh_io import column
from scenes import activate, assert_within, plates_with_t_junctions, world_triangles

FINER = 25  # the number of the first vertex of the finer plate


def dressed_plates(bump):
    """Returns plates with T-junctions. Their UV map is a shear of the plane; colours and materials tell the plates apart."""
    ob = plates_with_t_junctions()
    mesh = ob.data
    positions = column(mesh.vertices, "co", 3)
    line = positions[:, 0] == 0
    noise = np.random.default_rng(3).normal(0, bump, len(positions)).astype(np.float32)
    positions[:, 2] += np.where(line, 0, noise)
    mesh.vertices.foreach_set("co", positions.ravel())
    at = column(mesh.loops, "vertex_index", 1, np.int32).ravel()
    mesh.uv_layers.new(name="map").data.foreach_set("uv", sheared(positions[at]).ravel())
    colours = mesh.attributes.new("plate", "FLOAT_COLOR", "CORNER")
    colours.data.foreach_set("color", np.repeat((at >= FINER).astype(np.float32)[:, None], 4, axis=1).ravel())
    for name in ("coarse", "fine"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons.foreach_set("material_index", [int(p.vertices[0] >= FINER) for p in mesh.polygons])
    mesh.update()
    activate(ob)
    return ob


def sheared(positions):
    return positions[:, :2] @ np.float32([[0.3, 0.1], [0.05, 0.4]])


@pytest.mark.parametrize("bump", [0.0, 0.02])
@pytest.mark.parametrize("placement", ["SUBSET", "OPTIMAL"])
def test_a_vertex_on_an_edge_is_put_into_the_face(bump, placement):
    ob = dressed_plates(bump)
    reference = world_triangles(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=0.5, placement=placement)
    run = json.loads(ob.tolvol.last_run)
    repairs = {repair["kind"]: repair for repair in run["repairs"]}
    assert repairs["T-junction"]["count"] == 4 and "put into" in repairs["T-junction"]["message"]
    assert max(run["forward"][1], run["backward"][1]) <= run["tolerance"]["absolute"]
    assert_within(world_triangles(ob), reference, run["tolerance"]["absolute"])
    mesh = ob.data
    assert not mesh.validate(verbose=False)
    assert len(mesh.polygons) < len(reference[1])
    # The plates are one sheet now: an edge on the line has a face on each side.
    positions = column(mesh.vertices, "co", 3)
    on_line = np.abs(positions[:, 0]) < 1e-3
    edges = np.sort(world_triangles(ob)[1][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    edges, count = np.unique(edges, axis=0, return_counts=True)
    inner = on_line[edges].all(1)
    assert (count[inner] == 2).all() and (inner.any() or not bump)
    if placement == "SUBSET":
        at = column(mesh.loops, "vertex_index", 1, np.int32).ravel()
        uvs = column(mesh.uv_layers["map"].data, "uv", 2)
        np.testing.assert_allclose(uvs, sheared(positions[at]), atol=1e-5)
        colours = column(mesh.attributes["plate"].data, "color", 4)[:, 0].reshape(-1, 3)
        material = column(mesh.polygons, "material_index", 1, np.int32).ravel()
        away = np.abs(positions[at].reshape(-1, 3, 3)[..., 0]).max(1) > 1e-3
        if bump:
            np.testing.assert_allclose(colours[away], np.repeat(material[away][:, None], 3, axis=1), atol=1e-5)
