# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that meet where they share no vertex or edge, because one has a vertex on an edge or on the inside of another, go on
to meet: decimation puts the vertex into the edge or the face first."""

import numpy as np
import pytest
import tolvol

import meshes
from test_chains import random_step


def placed(seed=None, scale=1.0, n=8):
    """Returns sheets with T-junctions in some position, as float32, and the sheet of each triangle."""
    vertices, triangles, sheet = meshes.sheets_with_t_junctions(n)
    if seed is not None:
        vertices = (vertices @ meshes.random_rotation(seed)[:3, :3].T + 0.3) * scale
    return vertices.astype(np.float32), triangles, sheet


def decimate(vertices, triangles, percent=1, **options):
    volume = tolvol.ToleranceVolume(vertices, triangles, percent / 100 * tolvol.diagonal(vertices, triangles))
    result = tolvol.decimate(vertices, triangles, volume, **options)
    judged = tolvol.hausdorff(result.vertices, result.triangles, vertices, triangles, bound=volume.tolerance)
    assert judged.upper <= volume.tolerance
    crossing = [
        len(tolvol.crossing_pairs(*mesh)) for mesh in ((result.vertices, result.triangles), (vertices, triangles))
    ]
    assert crossing[0] <= crossing[1]
    return result


def edge_counts(triangles):
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    return np.unique(edges, axis=0, return_counts=True)


@pytest.mark.parametrize("effort", ["fast", "thorough"])
@pytest.mark.parametrize(("seed", "scale"), [(None, 1), (5, 1), (6, 1e-3), (7, 1e3)])
def test_three_sheets_that_meet_in_one_line_still_do(seed, scale, effort):
    vertices, triangles, sheet = placed(seed, scale)
    as_made = meshes.sheets_with_t_junctions()[0]
    on_line = np.flatnonzero((as_made[:, 0] == 0) & (as_made[:, 2] == 0))
    result = decimate(vertices, triangles, effort=effort)
    assert len(result.triangles) < len(triangles) / 5
    assert not result.report["locked"]
    put_in = [r for r in result.report["repairs"] if r["kind"] == "T-junction"]
    assert (
        put_in and put_in[0]["count"] == 8 + 12
    )  # of the finer plate and the wall in the coarse one, and of the plates in the wall
    # Every edge along the line has a face of each sheet.
    line = set(result.vertex_map[on_line])
    edges, count = edge_counts(result.triangles)
    along = [k for k, edge in enumerate(edges) if set(edge) <= line and count[k] == 3]
    assert len(along) == len(line) - 1
    sheets = sheet[result.triangle_source]
    for k in along:
        with_edge = (np.isin(result.triangles, edges[k])).sum(1) == 2
        assert set(sheets[with_edge]) >= {2} and with_edge.sum() == 3


def test_corners_that_are_put_in_have_the_attributes_there():
    vertices, triangles, _ = placed()
    uv = np.stack([vertices[:, 0] + 3 * vertices[:, 2], vertices[:, 1]], 1)[triangles].astype(np.float32)
    for wedges in (None, tolvol.wedges(triangles, uv)):
        result = decimate(vertices, triangles, placement="subset", wedges=wedges)
        carried = np.einsum("tkc,tkcd->tkd", result.source_weights, uv[result.source_triangle])
        at = result.vertices[result.triangles]
        expected = np.stack([at[..., 0] + 3 * at[..., 2], at[..., 1]], -1)
        np.testing.assert_allclose(carried, expected, atol=2e-2 if wedges is None else 1e-5)
        assert (result.triangle_source < len(triangles)).all() and (result.source_triangle < len(triangles)).all()


def test_a_seam_along_the_line_stays_a_seam():
    """The sheets have other values at the line: a corner takes those of its sheet."""
    vertices, triangles, sheet = placed()
    values = np.repeat(10.0 * sheet[:, None, None], 3, axis=1).astype(np.float32)
    result = decimate(vertices, triangles, wedges=tolvol.wedges(triangles, values))
    carried = np.einsum("tkc,tkcd->tkd", result.source_weights, values[result.source_triangle])[..., 0]
    np.testing.assert_allclose(carried, 10.0 * np.repeat(sheet[result.triangle_source][:, None], 3, axis=1), atol=1e-9)


def test_one_way_too():
    vertices, triangles, _ = placed()
    result = decimate(vertices, triangles, placement="subset")
    one_way = tolvol.decimate(
        vertices,
        triangles,
        tolvol.ToleranceVolume(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles)),
        two_sided=False,
    )
    assert [r["kind"] for r in one_way.report["repairs"]] == [r["kind"] for r in result.report["repairs"]]
    assert "boundary not near the reference's boundary" not in one_way.report["locked"]


def test_a_result_never_has_more_triangles_than_the_input():
    """Where nothing can collapse, the pieces of divided faces are no gain, and the vertices are locked instead."""
    vertices, triangles, _ = placed(n=4)
    rough = 0.01 * np.random.default_rng(2).standard_normal(vertices.shape).astype(np.float32)
    off_line = (vertices[:, 0] != 0) | (vertices[:, 2] != 0)
    vertices[off_line] += rough[off_line]
    result = decimate(vertices, triangles, percent=1e-4)
    assert len(result.triangles) == len(triangles)
    assert result.report["locked"]["T-junction"] > 0


def test_what_cannot_be_joined_is_locked_and_counted():
    """A wall stands across the squares of a plate, and its foot goes over edges between its corners."""
    (plate, below), (wall, standing) = meshes.plate(11), meshes.plate(5)
    wall = np.stack([0.13 + 0 * wall[:, 0], 0.25 + 0.5 * wall[:, 1], 0.5 * wall[:, 0]], 1)
    vertices, triangles = meshes.join((plate, below), (wall, standing))
    vertices = vertices.astype(np.float32)
    result = decimate(vertices, triangles)
    foot = np.flatnonzero(np.arange(len(vertices)) >= len(plate))
    foot = foot[vertices[foot, 2] == 0]
    assert len(foot) == 5
    assert result.report["locked"]["T-junction"] > len(foot)
    np.testing.assert_array_equal(result.vertices[result.vertex_map[foot]], vertices[foot])


def test_any_chain_of_operations_goes_on():
    vertices, triangles, _ = placed(n=4)
    reference = vertices, triangles
    rng = np.random.default_rng(11)
    for chain in range(12):
        tolerance = rng.choice([0.004, 0.02]) * tolvol.diagonal(*reference)
        volume = tolvol.ToleranceVolume(*reference, tolerance)
        mesh, names, crossed = reference, [], len(tolvol.crossing_pairs(*reference))
        for _ in range(5):
            name, mesh = random_step(rng, *mesh, volume)
            names.append(str(name))
            assert tolvol.hausdorff(*mesh, *reference, bound=tolerance).upper <= tolerance, f"chain {chain}: {names}"
            before, crossed = crossed, len(tolvol.crossing_pairs(*mesh))
            assert crossed <= before, f"chain {chain}: {names}"
