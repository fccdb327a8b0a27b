# SPDX-License-Identifier: GPL-3.0-or-later
"""The grid that viewports show distances from."""

import numpy as np
import pytest
import tolvol

import meshes


def display(mesh=None, tolerance=0.1, to_world=None, **options):
    mesh = mesh or meshes.sphere(3)
    return tolvol.DisplayGrid(tolvol.ToleranceVolume(*mesh, tolerance, to_world), **options)


@pytest.mark.parametrize("scale", [1, -2])
def test_distances_and_triangles_are_at_their_places_in_the_world(scale):
    mesh = meshes.sphere(3)
    to_world = meshes.matrix(np.diag([scale, abs(scale), abs(scale)]), (7, 8, 9))
    grid = display(mesh, 0.1 * abs(scale), to_world)
    assert grid.closed and grid.precision == 4 and grid.spacing == pytest.approx(0.025 * abs(scale))
    z, y, x = np.indices(grid.distances.shape)
    nodes = np.stack([x, y, z], -1).reshape(-1, 3)
    to_nodes = np.linalg.inv(grid.to_nodes)
    world = nodes @ to_nodes[:3, :3].T + to_nodes[:3, 3]
    expected = np.linalg.norm(world - (7, 8, 9), axis=1) - abs(scale)
    near = np.abs(expected) < 0.1 * abs(scale)
    assert near.sum() > 1000
    shown = grid.distances.reshape(-1) * grid.spacing
    assert np.abs(shown - expected)[near].max() < 0.04 * abs(scale), "the sphere has flat faces"
    ids = grid.nearest.reshape(-1)
    corners = grid.corners
    assert corners.shape == (len(mesh[1]), 3, 3)
    to_triangle = corners[ids[near]].mean(1) - nodes[near]
    assert (np.linalg.norm(to_triangle, axis=1) * grid.spacing < 0.35 * abs(scale)).all()
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    centre = grid.to_nodes @ (7, 8, 9, 1)
    assert (np.einsum("ij,ij->i", outward, corners.mean(1) - centre[:3]) > 0).all()
    for values in (grid.distances, grid.nearest, grid.corners):
        assert not values.flags.writeable


@pytest.mark.parametrize("nearest", [False, True])
def test_shares_follow_the_mesh_its_place_and_the_edges(nearest):
    sphere = meshes.sphere(4)
    grid = display(sphere)
    edges = (-0.1, 0, 0.03, 0.1)
    assert np.allclose(grid.shares(*meshes.sphere(4, 1.06), edges, nearest=nearest), [0, 0, 0, 1, 0])
    assert np.allclose(grid.shares(*meshes.sphere(4, 0.95), edges, nearest=nearest), [0, 1, 0, 0, 0])
    assert np.allclose(grid.shares(*meshes.sphere(4, 1.5), edges, nearest=nearest), [0, 0, 0, 0, 1])
    shifted = grid.shares(*sphere, edges, to_world=meshes.matrix(np.eye(3), (0, 0, 0.09)), nearest=nearest)
    assert shifted[1] == pytest.approx(0.5, abs=0.03) and sum(shifted) == pytest.approx(1)
    assert grid.shares(*sphere, edges, nearest=nearest, threads=1) == grid.shares(*sphere, edges, nearest=nearest)


def test_limits_are_kept_and_open_references_said():
    plate = meshes.plate(9)
    assert not display(plate).closed
    coarse = display(plate, longest=20)
    assert max(coarse.distances.shape) <= 20 and coarse.precision < 4
    assert display(plate, nodes=5000).distances.size <= 5000
    assert display(plate, precision=2).precision == 2


def test_bad_input_is_named():
    for options, said in (({"precision": 0}, "precision"), ({"longest": 3}, "16 nodes"), ({"nodes": 10}, "4096")):
        with pytest.raises(tolvol.InvalidInput, match=said):
            display(**options)
    grid = display()
    for edges in ((0, float("nan")), (1, 0)):
        with pytest.raises(tolvol.InvalidInput, match="ascending"):
            grid.shares(*meshes.sphere(2), edges)
    with pytest.raises(tolvol.InvalidInput, match="9"):
        grid.shares(np.zeros((3, 3)), np.array([[0, 1, 9]]), (0,))
    progress = tolvol.Progress()
    progress.cancel()
    with pytest.raises(tolvol.Cancelled):
        display(progress=progress)
