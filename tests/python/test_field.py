# SPDX-License-Identifier: GPL-3.0-or-later
"""Filling the distance grid by exact scatter, on the processor or in GL, or by fast marching, and its signs."""

import numpy as np
import pytest
import tolvol

import judge
import meshes

FIELDS = ["scatter", "fast_marching"]
INSIDE = tolvol.Verdict.INSIDE


def node_positions(volume):
    values, origin, spacing, _ = volume.grid()
    z, y, x = np.indices(values.shape)
    return origin + spacing * np.stack([x, y, z], -1)


def test_field_is_named_and_unknown_ones_are_refused():
    plate = meshes.plate(9)
    assert tolvol.ToleranceVolume(*plate, 0.1).field == "scatter"
    for field in FIELDS:
        assert tolvol.ToleranceVolume(*plate, 0.1, field=field).field == field
    with pytest.raises(tolvol.InvalidInput, match="scatter, gl, fast_marching"):
        tolvol.ToleranceVolume(*plate, 0.1, field="march")


def test_the_field_of_gl_is_that_of_scatter(gl):
    torus = meshes.torus(48, 24)
    scatter, of_gl = (tolvol.ToleranceVolume(*torus, 0.1, precision=2, field=field) for field in ("scatter", "gl"))
    assert of_gl.field == "gl" and of_gl.precision == scatter.precision
    assert np.allclose(of_gl.grid()[0], scatter.grid()[0], atol=1e-6, rtol=0)
    assert np.allclose(of_gl.grid(signed=True)[0], scatter.grid(signed=True)[0], atol=1e-6, rtol=0)
    results = [tolvol.decimate(*torus, volume) for volume in (scatter, of_gl)]
    judge.assert_promise(*torus, results[1], 0.1)
    assert len(results[1].triangles) == pytest.approx(len(results[0].triangles), rel=0.1, abs=4)


def test_fast_marching_is_signed_and_scatter_on_demand():
    torus = meshes.torus(48, 24)
    scatter, march = (tolvol.ToleranceVolume(*torus, 0.1, precision=6, field=field) for field in FIELDS)
    assert (scatter.grid()[0] >= 0).all()
    exact = scatter.grid(signed=True)[0]
    assert np.array_equal(np.abs(exact), scatter.grid()[0]) and not exact.flags.writeable
    marched, _, spacing, unit = march.grid()
    assert np.array_equal(marched, march.grid(signed=True)[0])
    assert np.array_equal(np.signbit(marched), np.signbit(exact))
    within = unit * np.abs(exact) < 0.1 - spacing
    error = unit * np.abs(marched - exact)[within] / spacing
    assert 0.01 < error.max() < 0.5, "marched, and no farther off than first order"
    assert not np.shares_memory(exact, scatter.grid()[0]) and np.shares_memory(marched, march.grid()[0])


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("scale", [(1, 1, 1), (-2, 2, 2), (-3, -3, -3)], ids=["as it is", "mirrored", "inverted"])
def test_negative_is_inside_in_the_world(field, scale):
    radius = abs(scale[0])
    to_world = meshes.matrix(np.diag(scale), (7, 8, 9))
    volume = tolvol.ToleranceVolume(*meshes.sphere(3), 0.1 * radius, to_world=to_world, precision=2, field=field)
    values = volume.grid(signed=True)[0]
    from_centre = np.linalg.norm(node_positions(volume) - [7, 8, 9], axis=-1) / radius
    assert (values[from_centre < 0.96] < 0).all() and (values[from_centre > 1.01] > 0).all()


def test_verdicts_are_the_same_for_both_fields():
    vertices, triangles = meshes.torus(48, 24)
    for precision in (0.5, 1, 3):
        volumes = [
            tolvol.ToleranceVolume(vertices, triangles, 0.1, precision=precision, field=field) for field in FIELDS
        ]
        rng = np.random.default_rng(1)
        corner = vertices[triangles[rng.integers(0, len(triangles), 3000)]].mean(1)
        points = corner[:, None] + 0.1 * 10 ** rng.uniform(-1, 1, (3000, 1, 1)) * rng.standard_normal((3000, 3, 3))
        faces = np.arange(9000, dtype=np.int32).reshape(-1, 3)
        verdicts = [volume.check(points.reshape(-1, 3), faces).verdicts for volume in volumes]
        assert 300 < (verdicts[0] == INSIDE).sum() < 2700
        assert np.array_equal(*verdicts)


@pytest.mark.parametrize(
    "mesh", [meshes.torus(64, 32, noise=0.005), meshes.plate(33, bump=0.2)], ids=["torus", "plate"]
)
def test_decimation_keeps_its_promise_on_a_marched_field(mesh):
    tolerance = 0.02 * tolvol.diagonal(*mesh)
    counts = []
    for field in FIELDS:
        volume = tolvol.ToleranceVolume(*mesh, tolerance, precision=1.1, field=field)
        result = tolvol.decimate(*mesh, volume)
        judge.assert_promise(*mesh, result, tolerance)
        counts.append(len(result.triangles))
    assert counts[1] == pytest.approx(counts[0], rel=0.1, abs=4), "the search makes up for the missing triangles"
