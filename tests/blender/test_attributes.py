# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of a decimated mesh: exact on original vertices, interpolated where vertices moved."""

import json

import bmesh
import bpy
import numpy as np
import pytest

from addon.mesh import mesh_io
from addon.mesh.mesh_io import column
from addon.proof import kept_warnings
from scenes import activate, sheet, torus

KINDS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}


# Colours are at vertices and corners; from 3.5 on every pair of floats at corners is a UV map.
_NOT_THERE = {("BYTE_COLOR", "FACE")} | ({("FLOAT2", "CORNER")} if bpy.app.version >= (3, 5) else set())


def dressed_torus():
    """Quads and a UV map with two seams, and one of everything else with random values."""
    around, across = 40, 20
    ob = torus(around=around, across=across)
    mesh, rng = ob.data, np.random.default_rng(5)
    u, v = np.divmod(np.arange(around * across), across)
    corners = column(mesh.loops, "vertex_index", 1, np.int32)
    # The place is the quad's own, so that the last ring of quads ends at 1 and not at 0.
    first = np.repeat(corners[::4], 4)
    uvs = np.stack([(u[corners] - u[first]) % around + u[first], (v[corners] - v[first]) % across + v[first]], 1)
    mesh.uv_layers.new(name="unwrapped").data.foreach_set("uv", (uvs / (around, across)).astype(np.float32).ravel())
    for i in range(4):
        mesh.materials.append(bpy.data.materials.new(f"material {i}"))
    mesh.polygons.foreach_set("material_index", rng.integers(0, 4, len(mesh.polygons)).astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", rng.random(len(mesh.polygons)) < 0.5)
    ends = column(mesh.edges, "vertices", 2, np.int32)
    ring = (u[ends] == 7).all(1)
    mesh.edges.foreach_set("use_edge_sharp", ring)
    mesh.edges.foreach_set("use_seam", ((u[ends] == 0).all(1)) | ((v[ends] == 0).all(1)))
    values = np.where(ring, np.float32(0.75), np.float32(0))
    if bpy.app.version < (4, 0):
        mesh.edges.foreach_set("crease", values)
    else:
        mesh.attributes.new("crease_edge", "FLOAT", "EDGE").data.foreach_set("value", values)
    for name in ("one", "two"):
        ob.vertex_groups.new(name=name)
    for i in range(len(mesh.vertices)):
        ob.vertex_groups[i % 2].add([i], float(rng.random()), "REPLACE")
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Key")
    moved = column(mesh.vertices, "co", 3) + rng.normal(0, 1, (len(mesh.vertices), 3))
    key.data.foreach_set("co", moved.astype(np.float32).ravel())
    for kind, (value, width, dtype) in KINDS.items():
        for domain in ("POINT", "FACE", "CORNER"):
            if (kind, domain) not in _NOT_THERE:
                attribute = mesh.attributes.new(f"{kind} {domain}", kind, domain)
                values = rng.random(len(attribute.data) * width) * (2 if dtype != np.float32 else 1)
                mesh.attributes[f"{kind} {domain}"].data.foreach_set(value, values.astype(dtype))
    built = bmesh.new()
    built.from_mesh(mesh)
    loose = [built.verts.new(place) for place in ((3, 3, 3), (4, 3, 3), (5, 3, 3))]
    built.edges.new(loose[:2])
    built.to_mesh(mesh)
    built.free()
    activate(ob)
    return ob


def creases(mesh):
    if bpy.app.version < (4, 0):
        return column(mesh.edges, "crease")
    return column(mesh.attributes["crease_edge"].data, "value")


def original_vertices(before, after):
    """Returns for each vertex of `after` the vertex of `before` at its position."""
    places = {co.tobytes(): i for i, co in enumerate(column(before.vertices, "co", 3))}
    return np.array([places[co.tobytes()] for co in column(after.vertices, "co", 3)])


@pytest.fixture
def subset():
    ob = dressed_torus()
    before = ob.data.copy()
    groups = [[(g.group, g.weight) for g in v.groups] for v in ob.data.vertices]
    bpy.ops.tolvol.decimate(tolerance_percent=1, placement="SUBSET")
    assert len(ob.data.polygons) < 500
    return ob, before, groups, original_vertices(before, ob.data)


def test_subset_keeps_everything_at_vertices_exactly(subset):
    ob, before, groups, source = subset
    for kind, layout in KINDS.items():
        was = column(before.attributes[f"{kind} POINT"].data, *layout)
        now = column(ob.data.attributes[f"{kind} POINT"].data, *layout)
        assert np.array_equal(now, was[source]), kind
    for i, vertex in enumerate(ob.data.vertices):
        assert [(g.group, g.weight) for g in vertex.groups] == groups[source[i]]
    for key, was in zip(ob.data.shape_keys.key_blocks, before.shape_keys.key_blocks):
        assert np.array_equal(column(key.data, "co", 3), column(was.data, "co", 3)[source])


def test_subset_keeps_uvs_exactly_and_every_face_on_one_island(subset):
    ob, before, _, source = subset
    was = column(before.uv_layers[0].data, "uv", 2)
    there = {(int(v), *uv) for v, uv in zip(column(before.loops, "vertex_index", 1, np.int32), was.tolist())}
    now = column(ob.data.uv_layers[0].data, "uv", 2)
    vertices = column(ob.data.loops, "vertex_index", 1, np.int32)
    assert all((int(source[v]), *uv) in there for v, uv in zip(vertices, now.tolist()))
    # No face reaches over a seam: its UVs turn the same way as all others and add up to the whole map.
    corners = now.reshape(-1, 3, 2)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    assert areas.min() > -1e-6
    assert areas.sum() == pytest.approx(1, abs=1e-5)


def test_subset_keeps_faces(subset):
    ob, before, _, source = subset
    layouts = {"material_index": (1, np.int32), "use_smooth": (1, bool)}
    was = {name: column(before.polygons, name, *layout) for name, layout in layouts.items()}
    now = {name: column(ob.data.polygons, name, *layout) for name, layout in layouts.items()}
    for kind, layout in KINDS.items():
        if f"{kind} FACE" in before.attributes:
            was[kind] = column(before.attributes[f"{kind} FACE"].data, *layout)
            now[kind] = column(ob.data.attributes[f"{kind} FACE"].data, *layout)
    # The random float identifies the polygon that a face comes from. All other attributes have to be of this polygon.
    polygon = {value: i for i, value in enumerate(was["FLOAT"].tolist())}
    origin = [polygon[value] for value in now["FLOAT"].tolist()]
    for name in was:
        assert np.array_equal(now[name], was[name][origin]), name


def test_subset_reads_corners_at_their_vertex(subset):
    ob, before, _, source = subset
    was_at, now_at = (column(mesh.loops, "vertex_index", 1, np.int32) for mesh in (before, ob.data))
    for kind in ("FLOAT", "FLOAT_VECTOR", "FLOAT_COLOR", "BYTE_COLOR"):
        was, now = (column(mesh.attributes[f"{kind} CORNER"].data, *KINDS[kind]) for mesh in (before, ob.data))
        there = {(int(v), value.tobytes()) for v, value in zip(was_at, was)}
        assert all((int(source[v]), value.tobytes()) in there for v, value in zip(now_at, now)), kind


def test_subset_keeps_lines_of_marks_in_one_piece(subset):
    ob, before, _, source = subset
    u = source // 20
    sharp, seam = (column(ob.data.edges, mark, 1, bool) for mark in ("use_edge_sharp", "use_seam"))
    crease = creases(ob.data)
    for mark, marked in (("sharp", sharp), ("crease", crease == 0.75), ("seam", seam)):
        ends = column(ob.data.edges, "vertices", 2, np.int32)[marked]
        assert is_one_closed_line(ends), mark
    assert np.array_equal(sharp, crease > 0)
    assert set(crease.tolist()) == {0.0, 0.75}
    assert u[column(ob.data.edges, "vertices", 2, np.int32)[seam]].min() == 0


def is_one_closed_line(edges):
    """Whether the edges are connected and contain a closed ring."""
    reached = {int(edges[0, 0])}
    for _ in edges:
        reached |= {int(v) for edge in edges if reached & set(edge.tolist()) for v in edge}
    vertices = set(edges.ravel().tolist())
    return reached == vertices and len(edges) >= len(vertices)


def test_unmarked_mesh_gets_no_marks_and_no_layers():
    ob = torus()
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    mesh = ob.data
    assert not column(mesh.edges, "use_edge_sharp", 1, bool).any() and not column(mesh.edges, "use_seam", 1, bool).any()
    assert not {"crease_edge", "bevel_weight_edge"} & set(mesh.attributes.keys()) and not mesh.uv_layers
    if bpy.app.version < (4, 0):
        assert not mesh.has_crease_edge and not mesh.has_bevel_weight_edge


@pytest.mark.parametrize("placement", ["SUBSET", "OPTIMAL"])
def test_loose_vertices_and_edges_stay(placement):
    ob = dressed_torus()
    bpy.ops.tolvol.decimate(tolerance_percent=1, placement=placement)
    loose = mesh_io.loose_edges(ob.data)
    assert [[tuple(ob.data.vertices[v].co) for v in edge] for edge in loose] == [[(3, 3, 3), (4, 3, 3)]]
    assert tuple(ob.data.vertices[-1].co) == (5, 3, 3)


def test_loose_edge_that_hangs_on_the_surface_keeps_its_foot():
    ob = sheet(bumps=0)
    built = bmesh.new()
    built.from_mesh(ob.data)
    built.verts.ensure_lookup_table()
    foot = built.verts[31 * 15 + 15]
    place = tuple(foot.co)
    built.edges.new((foot, built.verts.new((0, 0, 2))))
    built.to_mesh(ob.data)
    built.free()
    activate(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    assert len(ob.data.polygons) < 100
    (edge,) = mesh_io.loose_edges(ob.data)
    assert {tuple(ob.data.vertices[v].co) for v in edge} == {place, (0, 0, 2)}


# Vertices that moved ------------------------------------------------------------------------------------------------


def test_optimal_carries_over_what_is_smooth():
    """Attributes that are functions of the position are the same functions of the new positions, where the sheet is flat."""
    ob = sheet(count=30, bumps=0.05)
    mesh = ob.data
    co = column(mesh.vertices, "co", 3)
    at = column(mesh.loops, "vertex_index", 1, np.int32)
    mesh.uv_layers.new().data.foreach_set("uv", np.ascontiguousarray(co[at, :2] * 0.4 + 0.5).ravel())
    mesh.attributes.new("height", "FLOAT", "POINT").data.foreach_set("value", np.ascontiguousarray(co[:, 0] + co[:, 1]))
    colours = np.concatenate([co[at] * 0.4 + 0.5, np.ones((len(at), 1))], 1).astype(np.float32)
    mesh.attributes.new("colour", "FLOAT_COLOR", "CORNER").data.foreach_set("color", colours.ravel())
    group = ob.vertex_groups.new(name="x")
    for i, place in enumerate(co):
        group.add([i], float(place[0] * 0.4 + 0.5), "REPLACE")
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="Up")
    key.data.foreach_set("co", (co + [0, 0, 1] * (1 + co[:, :1])).astype(np.float32).ravel())
    mesh.materials.append(bpy.data.materials.new("left"))
    mesh.materials.append(bpy.data.materials.new("right"))
    activate(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=0.5, placement="OPTIMAL")
    mesh = ob.data
    now, at = column(mesh.vertices, "co", 3), column(mesh.loops, "vertex_index", 1, np.int32)
    was = {place.tobytes() for place in co}
    # Some vertices moved: otherwise this would test nothing.
    assert sum(place.tobytes() not in was for place in now) > 10
    # The tolerance, and the distance along the surface by which it may shift the place of the interpolation.
    close = 0.03
    assert np.abs(column(mesh.uv_layers[0].data, "uv", 2) - (now[at, :2] * 0.4 + 0.5)).max() < close
    assert np.abs(column(mesh.attributes["height"].data, "value") - now[:, 0] - now[:, 1]).max() < close
    assert np.abs(column(mesh.attributes["colour"].data, "color", 4)[:, :3] - (now[at] * 0.4 + 0.5)).max() < close
    weights = [vertex.groups[0].weight for vertex in mesh.vertices]
    assert np.abs(weights - (now[:, 0] * 0.4 + 0.5)).max() < close
    keys = mesh.shape_keys.key_blocks
    assert np.array_equal(column(keys["Basis"].data, "co", 3), now)
    offset = column(keys["Up"].data, "co", 3) - now
    assert np.abs(offset[:, :2]).max() < 1e-6 and np.abs(offset[:, 2] - (1 + now[:, 0])).max() < close
    assert [material.name for material in mesh.materials] == ["left", "right"]


def test_optimal_reads_the_uvs_of_a_face_on_one_island():
    ob = dressed_torus()
    bpy.ops.tolvol.decimate(tolerance_percent=1, placement="OPTIMAL")
    corners = column(ob.data.uv_layers[0].data, "uv", 2).reshape(-1, 3, 2)
    # Over a seam a face would be nearly as long as the map.
    assert (np.ptp(corners, axis=1) < 0.6).all()
    assert ob.data.uv_layers[0].name == "unwrapped"


# Custom normals -----------------------------------------------------------------------------------------------------


def corner_normals(mesh):
    if bpy.app.version >= (4, 1):
        return column(mesh.corner_normals, "vector", 3)
    mesh.calc_normals_split()
    return column(mesh.loops, "normal", 3)


def torus_with_a_hard_ring(custom):
    """A smooth torus with one sharp ring. The custom normals on the two sides of the ring lean away from each other."""
    ob = torus(noise=0.003)
    mesh = ob.data
    co, at = column(mesh.vertices, "co", 3), column(mesh.loops, "vertex_index", 1, np.int32)
    u = np.arange(len(co)) // 24
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    mesh.edges.foreach_set("use_edge_sharp", (u[column(mesh.edges, "vertices", 2, np.int32)] == 10).all(1))
    if bpy.app.version < (4, 1):
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, 3.14159
    if custom:
        ring = co[:, :2] / np.linalg.norm(co[:, :2], axis=1, keepdims=True) * 0.9
        normals = np.concatenate([co[:, :2] - ring, co[:, 2:]], 1)
        along = np.stack([-co[:, 1], co[:, 0], 0 * co[:, 0]], 1)
        lean = np.where(u[at] == 10, np.where(np.repeat(u[at[::4]] < 10, 4), 0.3, -0.3), 0)
        wanted = normals[at] + lean[:, None] * along[at]
        mesh.normals_split_custom_set(wanted / np.linalg.norm(wanted, axis=1, keepdims=True))
    activate(ob)
    return ob


def test_custom_normals_are_kept_within_their_storage():
    ob = torus_with_a_hard_ring(custom=True)
    before, was = ob.data.copy(), corner_normals(ob.data)
    at = column(before.loops, "vertex_index", 1, np.int32)
    bpy.ops.tolvol.decimate(tolerance_percent=0.5, placement="SUBSET")
    mesh = ob.data
    assert mesh.has_custom_normals and len(mesh.polygons) < 900
    source = original_vertices(before, mesh)
    for normal, vertex in zip(corner_normals(mesh), column(mesh.loops, "vertex_index", 1, np.int32)):
        assert np.abs(was[at == source[vertex]] - normal).max(1).min() < 4e-3


@pytest.mark.parametrize("placement", ["SUBSET", "OPTIMAL"])
def test_custom_normals_mark_no_further_edge_sharp(placement):
    marked = []
    for custom in (False, True):
        ob = torus_with_a_hard_ring(custom)
        bpy.ops.tolvol.decimate(tolerance_percent=0.5, placement=placement)
        marked.append(column(ob.data.edges, "use_edge_sharp", 1, bool))
    assert marked[0].any() and np.array_equal(*marked)


def test_custom_normals_lean_as_before_where_vertices_moved():
    ob = torus_with_a_hard_ring(custom=True)
    bpy.ops.tolvol.decimate(tolerance_percent=0.5, placement="OPTIMAL")
    co, at = column(ob.data.vertices, "co", 3), column(ob.data.loops, "vertex_index", 1, np.int32)
    ring = co[:, :2] / np.linalg.norm(co[:, :2], axis=1, keepdims=True) * 0.9
    ideal = np.concatenate([co[:, :2] - ring, co[:, 2:]], 1)
    ideal /= np.linalg.norm(ideal, axis=1, keepdims=True)
    cosine = (corner_normals(ob.data) * ideal[at]).sum(1)
    assert np.median(cosine) > 0.999 and cosine.min() > 0.7


def test_uvs_that_differ_by_rounding_are_no_seam():
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=60, y_subdivisions=60, size=4)
    ob = bpy.context.active_object
    mesh = ob.data
    uvs, vertices = column(mesh.uv_layers[0].data, "uv", 2), column(mesh.loops, "vertex_index", 1, np.int32)
    first = uvs[np.unique(vertices, return_index=True)[1]]
    apart = np.abs(uvs - first[vertices]).max()
    assert 0 < apart < 1e-7
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    assert len(mesh.polygons) == 2 and not kept_warnings.of(ob)[1]


def test_uvs_that_differ_by_more_than_rounding_are_a_seam_whatever_else_the_map_holds():
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=8, size=4)
    mesh = bpy.context.active_object.data
    values = column(mesh.uv_layers[0].data, "uv", 2)
    values[5], values[12], values[40] = np.nan, np.inf, 1e30
    values[100:104] += 1e-5
    mesh.uv_layers[0].data.foreach_set("uv", values.ravel())
    told = mesh_io.corner_uvs(mesh)
    kept = np.isfinite(values)
    assert np.abs(told[kept] - values[kept]).max() < 1e-6 and np.array_equal(told[~kept], values[~kept], equal_nan=True)


def test_islands_everywhere_are_named_as_what_holds_the_mesh():
    ob = torus()
    mesh = ob.data
    at = np.arange(len(mesh.loops), dtype=np.float32)
    mesh.uv_layers.new().data.foreach_set("uv", np.stack([at, at], 1).ravel())  # Every face is a UV island of its own.
    activate(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    run = json.loads(ob.tolvol.last_run)
    assert run["locked"]["UV islands meet"] == 48 * 24
    assert any("UV islands meet" in warning for warning in run["warnings"])
    mesh.uv_layers.remove(mesh.uv_layers[0])
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    run = json.loads(ob.tolvol.last_run)
    assert len(mesh.polygons) < 600 and not run["locked"] and not run["warnings"]
