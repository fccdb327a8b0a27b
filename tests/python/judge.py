# SPDX-License-Identifier: GPL-3.0-or-later
"""Judges the promise of a decimation on the stored result by tolvol.directed_hausdorff, which the decimation does not use."""

import numpy as np
import tolvol

from meshes import transform


def decimate(vertices, triangles, tolerance, to_world=None, reference=None, precision=None, **options):
    """Builds the volume of `reference` (the mesh itself by default) and decimates."""
    reference = reference or (vertices, triangles)
    volume = tolvol.ToleranceVolume(*reference, tolerance, to_world=to_world, precision=precision)
    return tolvol.decimate(vertices, triangles, volume, to_world=to_world, **options)


def distances(vertices, triangles, result, to_world=None, bound=None):
    """Returns the distances (result -> reference, reference -> result) in world space."""
    m = np.eye(4) if to_world is None else to_world
    a = (transform(m, result.vertices), result.triangles)
    b = (transform(m, vertices), triangles)
    both = tolvol.hausdorff(*a, *b, bound=bound)
    return both.forward, both.backward


def assert_promise(vertices, triangles, result, tolerance, to_world=None, two_sided=True):
    forward, backward = distances(vertices, triangles, result, to_world, tolerance)
    assert forward.upper <= tolerance, f"result -> reference: {forward.upper / tolerance} tolerances"
    if two_sided:
        assert backward.upper <= tolerance, f"reference -> result: {backward.upper / tolerance} tolerances"


def assert_sources(vertices, triangles, result, tolerance, to_world=None):
    """The maps from and to the input agree with each other and with the geometry."""
    m = np.eye(4) if to_world is None else to_world
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    assert result.vertex_map.shape == (len(vertices),)
    assert np.array_equal(result.vertex_map >= 0, used)
    assert result.vertex_map.max() < len(result.vertices) == len(result.vertex_source)
    assert np.array_equal(result.vertex_map[result.vertex_source], np.arange(len(result.vertices)))

    assert len(np.unique(result.triangle_source)) == len(result.triangles)
    assert np.array_equal(result.vertex_map[triangles[result.triangle_source]], result.triangles)

    assert result.source_triangle.shape == result.triangles.shape
    assert result.source_weights.shape == (*result.triangles.shape, 3)
    assert (result.source_weights >= 0).all()
    assert np.allclose(result.source_weights.sum(-1), 1)
    read_at = np.einsum("lck,lckd->lcd", result.source_weights, vertices[triangles[result.source_triangle]])
    gap = transform(m, read_at.reshape(-1, 3)) - transform(m, result.vertices[result.triangles].reshape(-1, 3))
    return np.linalg.norm(gap, axis=1).max()
