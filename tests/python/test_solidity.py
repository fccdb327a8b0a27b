# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol.solidity: facts about the connectivity of a mesh, its area and its volume."""

import numpy as np
import pytest
import tolvol

import meshes


def test_a_box_in_the_world():
    vertices, triangles = meshes.box()
    found = tolvol.solidity(vertices, triangles)
    assert found["closed"] and found["manifold"] and found["oriented"] and found["shells"] == 1
    size = np.ptp(vertices, axis=0)
    assert found["volume"] == pytest.approx(np.prod(size))
    assert found["area"] == pytest.approx(2 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]))
    assert tolvol.solidity(vertices, triangles[:, ::-1])["volume"] == pytest.approx(-np.prod(size))
    far = np.diag([2.0, 3, 4, 1])
    far[:3, 3] = 1e6
    for mirror in (1, -1):
        placed = tolvol.solidity(vertices, triangles, to_world=far @ np.diag([mirror, 1, 1, 1]))
        assert placed["volume"] == pytest.approx(24 * np.prod(size), rel=1e-6), "a mirrored body is no hollow"


def test_area_and_volume_hold_at_any_scale_and_place():
    vertices, triangles = meshes.box()
    area, volume = (tolvol.solidity(vertices, triangles)[key] for key in ("area", "volume"))
    for scale in (1e-100, 1e-6, 1e6, 1e100):
        found = tolvol.solidity(vertices * scale, triangles)
        assert found["area"] == pytest.approx(area * scale**2)
        assert found["volume"] == pytest.approx(volume * scale**3)
    away = np.eye(4)
    away[:3, 3] = 1e200
    placed = tolvol.solidity(vertices, triangles, to_world=away)
    assert (placed["area"], placed["volume"]) == pytest.approx((area, volume))
    stray = np.append(vertices, [[1e30, 0, 0]], axis=0)
    assert tolvol.solidity(stray, triangles)["volume"] == pytest.approx(volume), "an unused vertex"
    with pytest.raises(tolvol.InvalidInput, match="vertex 0 is not finite"):
        tolvol.solidity(np.full((1, 3), np.nan), np.empty((0, 3), int))
    huge = tolvol.solidity(vertices * 1e120, triangles)
    assert huge["area"] == pytest.approx(area * 1e240) and huge["volume"] == np.inf


def test_an_open_mesh_has_no_volume():
    vertices, triangles = meshes.plate(9)
    found = tolvol.solidity(vertices, triangles)
    assert (found["closed"], found["boundary_loops"], found["open_edges"]) == (False, 1, 32)
    assert found["volume"] is None and found["area"] > 0


def test_the_counts_do_not_depend_on_the_number_of_threads():
    vertices, triangles = meshes.non_manifold()
    one, three = (tolvol.solidity(vertices, triangles, threads=n) for n in (1, 3))
    assert one == three and one["non_manifold_edges"] > 0 and one["non_manifold_vertices"] == 1


def test_other_meshes_are_refused():
    vertices, triangles = meshes.box()
    with pytest.raises(tolvol.InvalidInput, match="8"):
        tolvol.solidity(vertices, triangles + 1)
    with pytest.raises(tolvol.InvalidInput, match="vertex 0"):
        tolvol.solidity(vertices * np.nan, triangles)
    with pytest.raises(tolvol.InvalidInput):
        tolvol.solidity(vertices, triangles, to_world=np.zeros((4, 4)))
