# SPDX-License-Identifier: GPL-3.0-or-later
"""The permission grid, with which the benchmarks compare the check."""

import numpy as np
import pytest
import tolvol
import tolvol_baselines as baselines

import meshes


@pytest.mark.parametrize("precision", [1, 4, 9])
def test_permits_nothing_beyond_the_tolerance_and_all_a_diagonal_within(precision):
    vertices, triangles = meshes.torus(48, 24)
    grid = baselines.PermissionGrid(vertices, triangles, 0.1, precision)
    assert grid.spacing == pytest.approx(0.1 / precision)
    points = np.random.default_rng(1).uniform(-1.6, 1.6, (50000, 3))
    distance = tolvol.ToleranceVolume(vertices, triangles, 0.1).distance(points)
    permitted = grid.permits(points)
    assert distance[permitted].max() <= 0.1
    assert permitted[distance < 0.1 - np.sqrt(3) * grid.spacing].all()
    assert 0.4 * (precision > 1) < permitted.sum() / (distance <= 0.1).sum() < 1


def test_memory_is_a_bit_per_cell_and_threads_do_not_matter():
    vertices, triangles = meshes.torus(48, 24)
    grids = [baselines.PermissionGrid(vertices, triangles, 0.02, 8, threads=n) for n in (1, 2, 3)]
    cells = np.prod((np.ptp(vertices, axis=0) + 0.04) / grids[0].spacing)
    assert grids[0].memory == pytest.approx(cells / 8, rel=0.05)
    assert grids[0].memory * 8 > 16 << 20, "more than one slab"
    points = np.random.default_rng(2).uniform(-1.5, 1.5, (20000, 3))
    permitted = grids[0].permits(points)
    assert all(np.array_equal(permitted, grid.permits(points)) for grid in grids[1:])


def test_bad_input():
    for tolerance, precision in ((0, 4), (0.1, 0.8), (np.nan, 4), (0.1, np.inf)):
        with pytest.raises(RuntimeError, match="positive tolerance"):
            baselines.PermissionGrid(*meshes.plate(3), tolerance, precision)
    with pytest.raises(RuntimeError, match="the limit is"):
        baselines.PermissionGrid(*meshes.torus(), 1e-4, 4)
