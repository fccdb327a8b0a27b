# SPDX-License-Identifier: GPL-3.0-or-later
"""The tree from which viewports compute the distances that they show."""

import numpy as np
import pytest
import tolvol

import meshes


def display(mesh=None, tolerance=0.1, to_world=None, **options):
    mesh = mesh or meshes.sphere(3)
    return tolvol.DisplayTree(tolvol.ToleranceVolume(*mesh, tolerance, to_world=to_world), **options)


@pytest.mark.parametrize("scale", [1, -2])
def test_triangles_are_at_their_places_in_the_world(scale):
    mesh = meshes.sphere(3)
    to_world = meshes.matrix(np.diag([scale, abs(scale), abs(scale)]), (7, 8, 9))
    tree = display(mesh, 0.1 * abs(scale), to_world)
    assert tree.closed
    assert tree.corners.shape == (3 * len(mesh[1]), 4) and len(tree.nodes) % 4 == 0
    from_frame = np.linalg.inv(tree.to_frame)
    corners = (tree.corners[:, :3] @ from_frame[:3, :3].T + from_frame[:3, 3]).reshape(-1, 3, 3)
    world = (mesh[0] @ to_world[:3, :3].T + to_world[:3, 3])[mesh[1]]
    assert np.allclose(np.sort(corners.mean(1), 0), np.sort(world.mean(1), 0), atol=1e-5)
    assert np.linalg.norm(tree.to_frame[:3, 0]) == pytest.approx(tree.scale)
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", outward, corners.mean(1) - (7, 8, 9)) > 0).all()
    lower, upper = tree.nodes[2], tree.nodes[3]
    assert (lower[3], upper[3]) == (0, len(mesh[1]))
    assert np.array_equal(lower[:3], tree.corners[:, :3].min(0))
    assert np.array_equal(upper[:3], tree.corners[:, :3].max(0))
    for values in (tree.nodes, tree.corners):
        assert not values.flags.writeable


def test_shares_follow_the_mesh_its_place_and_the_edges():
    sphere = meshes.sphere(4)
    tree = display(sphere)
    edges = (-0.1, 0, 0.03, 0.1)
    assert np.allclose(tree.shares(*meshes.sphere(4, 1.06), edges), [0, 0, 0, 1, 0])
    assert np.allclose(tree.shares(*meshes.sphere(4, 0.95), edges), [0, 1, 0, 0, 0])
    assert np.allclose(tree.shares(*meshes.sphere(4, 1.5), edges), [0, 0, 0, 0, 1])
    shifted = tree.shares(*sphere, edges, to_world=meshes.matrix(np.eye(3), (0, 0, 0.09)))
    assert shifted[1] == pytest.approx(0.5, abs=0.03) and sum(shifted) == pytest.approx(1)
    assert tree.shares(*sphere, edges, threads=1) == tree.shares(*sphere, edges)


def test_signed_distances_are_negative_inside_and_follow_the_place():
    sphere, place = meshes.sphere(4), meshes.matrix(2 * np.eye(3), (5, 0, 0))
    volume = tolvol.ToleranceVolume(*sphere, 0.1, to_world=place)
    tree = tolvol.DisplayTree(volume)
    points = np.random.default_rng(1).uniform(-3, 3, (200, 3)) + (5, 0, 0)
    found, exact = tree.signed_distance(points), volume.distance(points)
    assert np.allclose(np.abs(found), exact, atol=2 * tree.ROUNDING / tree.scale)
    radius = np.linalg.norm(points - (5, 0, 0), axis=1)
    clear = np.abs(radius - 2) > 0.02
    assert (np.sign(found) == np.sign(radius - 2))[clear].all() and clear.sum() > 150 and (radius < 2).sum() > 10
    local = (points - (5, 0, 0)) / 2
    assert np.allclose(tree.signed_distance(local, to_world=place, threads=1), found, atol=1e-12)
    assert tree.signed_distance(points[:1] + 1e6)[0] == pytest.approx(volume.distance(points[:1] + 1e6)[0], rel=1e-6)


def test_open_references_are_said():
    assert not display(meshes.plate(9)).closed


def test_bad_input_is_named():
    tree = display()
    for edges in ((0, float("nan")), (1, 0)):
        with pytest.raises(tolvol.InvalidInput, match="ascending"):
            tree.shares(*meshes.sphere(2), edges)
    with pytest.raises(tolvol.InvalidInput, match="point 1 is not finite"):
        tree.signed_distance(np.array([[0, 0, 0], [0, np.nan, 0]]))
    with pytest.raises(tolvol.InvalidInput, match="points"):
        tree.signed_distance(np.zeros((3, 2)))
    progress = tolvol.Progress()
    progress.cancel()
    with pytest.raises(tolvol.Cancelled):
        tree.signed_distance(np.zeros((3000, 3)), progress=progress)
    with pytest.raises(tolvol.InvalidInput, match="9"):
        tree.shares(np.zeros((3, 3)), np.array([[0, 1, 9]]), (0,))
    progress = tolvol.Progress()
    progress.cancel()
    with pytest.raises(tolvol.Cancelled):
        display(meshes.sphere(5), progress=progress)
