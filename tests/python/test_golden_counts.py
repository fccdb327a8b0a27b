# SPDX-License-Identifier: GPL-3.0-or-later
"""How few triangles a decimation leaves: a change of the code that leaves more of them fails here."""

import sys
from pathlib import Path

import numpy as np
import pytest
import tolvol

import judge
import meshes

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmark"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from fuzzing import kinds  # noqa: E402

from least_open import least_open  # noqa: E402

ALLOWANCE = 1.03
MODELS = {
    "sphere": meshes.sphere(5),
    "torus": meshes.torus(160, 80),
    "noisy torus": meshes.torus(160, 80, noise=0.001),
    "hill": meshes.plate(81, bump=0.2),
    "spike": meshes.spike(5),
    "soup": meshes.soup(*meshes.torus(64, 32)),
    "three plates at one edge": meshes.non_manifold(),
    "needles": meshes.needles(height=1e-5),
}
# The counts change by up to a tenth when the tolerance changes by one in a hundred, so that means over these shares of the
# tolerance are compared: of fast, which is quick, for all models, of the others for the models where they scatter most.
SHARES = (0.98, 0.99, 1, 1.01, 1.02)
SCATTERED = (("three plates at one edge", 1), ("hill", 0.2))
# Triangles left by fast, thorough and subset. A change that leaves fewer records its counts here. More are recorded only
# for a new promise: those of the noisy torus, the spike, the soup and the plates are since no face may be turned over. There
# is one exception: fast left 162.8 of the soup before it began anew, which leaves at most as many of all others.
COUNTS = {
    ("sphere", 1): (111.6, 78, 244),
    ("sphere", 0.2): (573.6, 398, 1204),
    ("torus", 1): (160.8, 116, 278),
    ("noisy torus", 1): (162.8, 116, 280),
    ("hill", 1): (23.6, 14, 41),
    ("hill", 0.2): (116.2, 72, 213),
    ("spike", 1): (94.4, 66, 198),
    ("spike", 0.2): (490.4, 336, 908),
    ("soup", 1): (164.8, 110, 302),
    ("three plates at one edge", 1): (128.4, 93.6, 224),
    ("needles", 1): (72, 72, 72),
}


@pytest.mark.parametrize(("name", "percent"), COUNTS)
def test_no_more_triangles_are_left_than_recorded(name, percent):
    vertices, triangles = MODELS[name]
    vertices = vertices.astype(np.float32)
    tolerance = percent / 100 * np.linalg.norm(np.ptp(vertices.astype(float), axis=0))
    volumes = [tolvol.ToleranceVolume(vertices, triangles, share * tolerance) for share in SHARES]
    few = volumes if (name, percent) in SCATTERED else volumes[2:3]

    def left(volumes, **options):
        return np.mean([len(tolvol.decimate(vertices, triangles, volume, **options).triangles) for volume in volumes])

    counts = left(volumes), left(few, effort="thorough"), left(few, placement="subset")
    for count, recorded in zip(counts, COUNTS[name, percent], strict=True):
        assert count <= ALLOWANCE * recorded, f"fast, thorough and subset leave {counts}"


def test_thorough_refines_a_part_of_slivers_again_after_collapses_alone():
    """It left 642 of this gear while nothing came after the refinement."""
    vertices, triangles = kinds.KINDS["gear"](np.random.default_rng(1), 4000)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles))
    assert len(tolvol.decimate(vertices, triangles, volume, effort="thorough").triangles) <= ALLOWANCE * 504


def test_fast_asks_again_where_the_sheets_of_a_wall_met():
    """It left 886 where an edge that was refused there did not come back after the other sheet had changed."""
    outer, faces = meshes.sphere(4)
    left = 0
    for wall, percent in ((0.02, 1), (0.03, 2), (0.015, 1.5)):
        vertices, triangles = meshes.join((outer, faces), (outer * (1 - wall), faces[:, ::-1]))
        vertices = vertices.astype(np.float32)
        volume = tolvol.ToleranceVolume(vertices, triangles, percent / 100 * tolvol.diagonal(vertices, triangles))
        left += len(tolvol.decimate(vertices, triangles, volume).triangles)
    assert left <= 870


@pytest.mark.parametrize("missing, over_least", [(0, None), (0.2, 1.035), (0.5, 1.82)])
def test_missing_faces_cost_hardly_more_than_their_rims(missing, over_least):
    """It left 1.05 and 1.98 of the least while vertices in which sheets meet did not move."""
    vertices, triangles = meshes.sphere(4)
    bumps = 1 + 0.05 * np.sin(5 * vertices[:, :1]) * np.cos(4 * vertices[:, 1:2] + vertices[:, 2:])
    vertices = (vertices * bumps).astype(np.float32)
    is_there = np.random.default_rng(1).random(len(triangles)) >= missing
    faces = triangles[is_there]
    volume = tolvol.ToleranceVolume(vertices, faces, 0.01 * tolvol.diagonal(vertices, faces))
    result = tolvol.decimate(vertices, faces, volume)
    judge.assert_promise(vertices, faces, result, volume.tolerance)
    least = least_open(triangles, is_there)
    assert least <= len(result.triangles)
    if missing:
        assert len(result.triangles) <= over_least * least
    else:
        assert least == -4  # Without a hole the bound is minus twice the Euler characteristic of a sphere.
