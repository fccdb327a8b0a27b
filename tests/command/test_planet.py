# SPDX-License-Identifier: GPL-3.0-or-later
"""The large meshes of benchmark/large.py, which are written piece by piece."""

import sys
from pathlib import Path

import numpy as np
import pytest
import tolvol
from tolvol.command import mesh_files

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmark"))
import planet  # noqa: E402


@pytest.mark.parametrize("rows", [1, 2, 30])
def test_a_planet_is_a_closed_surface_of_triangles_of_like_size(tmp_path, rows):
    count = planet.write(tmp_path / "planet.ply", rows)
    (mesh,) = mesh_files.read(tmp_path / "planet.ply").objects
    assert len(mesh.triangles) == count == 8 * rows * rows and planet.rows_of(count) == rows
    facts = tolvol.solidity(mesh.vertices, mesh.triangles)
    assert facts["closed"] and facts["manifold"] and facts["oriented"] and facts["volume"] > 0
    assert len(tolvol.crossing_pairs(mesh.vertices, mesh.triangles)) == 0
    assert np.bincount(mesh.triangles.ravel()).max() <= 6
