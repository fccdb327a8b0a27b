# SPDX-License-Identifier: GPL-3.0-or-later
"""Judges the promise of a decimation on the stored result by tolvol.directed_hausdorff, which the decimation does not use."""

import numpy as np
import tolvol

from meshes import transform

# The points of a face at which its angle is looked at.
STEPS = 6
AT_ONCE = 32  # triangles
WEIGHTS = np.array([(i, j, STEPS - i - j) for i in range(STEPS + 1) for j in range(STEPS + 1 - i)]) / STEPS


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


def joins_t_junctions(result):
    """Whether the decimation has put vertices into edges and faces, which are then divided."""
    return any(repair["kind"] == "T-junction" for repair in result.report["repairs"])


def assert_sources(vertices, triangles, result, tolerance, to_world=None):
    """The maps from and to the input agree with each other and with the geometry."""
    m = np.eye(4) if to_world is None else to_world
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    assert result.vertex_map.shape == (len(vertices),)
    assert np.array_equal(result.vertex_map >= 0, used)
    assert result.vertex_map.max() < len(result.vertices) == len(result.vertex_source)
    assert np.array_equal(result.vertex_map[result.vertex_source], np.arange(len(result.vertices)))

    same = (result.vertex_map[triangles[result.triangle_source]] == result.triangles).all(1)
    if joins_t_junctions(result):  # Several pieces of a triangle may be left, which have other corners.
        assert len(result.triangles) <= len(triangles) and result.triangle_source.max() < len(triangles)
    else:
        assert len(np.unique(result.triangle_source)) == len(result.triangles) and same.all()

    assert result.source_triangle.shape == result.triangles.shape
    assert result.source_weights.shape == (*result.triangles.shape, 3)
    assert (result.source_weights >= 0).all()
    assert np.allclose(result.source_weights.sum(-1), 1)
    read_at = np.einsum("lck,lckd->lcd", result.source_weights, vertices[triangles[result.source_triangle]])
    gap = transform(m, read_at.reshape(-1, 3)) - transform(m, result.vertices[result.triangles].reshape(-1, 3))
    return np.linalg.norm(gap, axis=1).max()


def unit_normals(corners):
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def distances_to(points, corners):
    """Returns the distance of each point to each triangle."""
    p, (a, b, c) = points[:, None], corners.transpose(1, 0, 2)

    def to_edge(start, end):
        along, from_start = end - start, p - start
        share = np.clip((from_start * along).sum(-1) / (along * along).sum(-1), 0, 1)
        return np.linalg.norm(from_start - share[..., None] * along, axis=-1)

    normals = np.cross(b - a, c - a)
    squares = (normals * normals).sum(-1)
    v = (np.cross(p - a, c - a) * normals).sum(-1) / squares
    w = (np.cross(b - a, p - a) * normals).sum(-1) / squares
    height = np.abs(((p - a) * normals).sum(-1)) / np.sqrt(squares)
    to_edges = np.minimum(np.minimum(to_edge(a, b), to_edge(b, c)), to_edge(c, a))
    return np.where((v >= 0) & (w >= 0) & (v + w <= 1), height, to_edges)


def largest_angles(vertices, triangles, result, tolerance):
    """For each face of the result: the least angle to a triangle near one of its points, at the worst of the points."""
    return angles_of(vertices[triangles].astype(float), result.vertices[result.triangles].astype(float), tolerance)


def angles_of(reference, faces, tolerance):
    """The same of the corners of triangles, (m, 3, 3) each. All must have an area."""
    angles = np.degrees(np.arccos(np.clip(unit_normals(faces) @ unit_normals(reference).T, -1, 1)))
    low, high = reference.min(1) - tolerance, reference.max(1) + tolerance

    def at_worst_point(face, angle):
        candidates = np.flatnonzero(((low <= face.max(0)) & (high >= face.min(0))).all(1))
        candidates = candidates[np.argsort(angle[candidates])]
        points = WEIGHTS @ face
        least = np.full(len(points), 180.0)
        searched = np.arange(len(points))
        # The first triangle near a point has the least angle there: most of the others need no distance.
        for first in range(0, len(candidates), AT_ONCE):
            part = candidates[first : first + AT_ONCE]
            near = distances_to(points[searched], reference[part]) <= tolerance
            found = near.any(1)
            least[searched[found]] = angle[part[near[found].argmax(1)]]
            searched = searched[~found]
            if not len(searched):
                break
        return least.max()

    return np.array([at_worst_point(face, angle) for face, angle in zip(faces, angles, strict=True)])
