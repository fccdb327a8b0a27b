# SPDX-License-Identifier: GPL-3.0-or-later
"""Holds the meshes that other_tools.py makes itself, by the name that stands for them in place of a file."""

import numpy as np

from scan import scan

CUTS = 6  # how often the icosahedron of sphere() is cut: 81,920 triangles
GOLDEN = (1 + np.sqrt(5)) / 2


def icosahedron():
    """Returns corners (12, 3) and triangles (20, 3), some of which look inwards. Its edges are 2 long."""
    corners = np.array([(0, a, b * GOLDEN) for a in (-1, 1) for b in (-1, 1)])
    corners = np.concatenate([np.roll(corners, turn, axis=1) for turn in range(3)])
    near = np.linalg.norm(corners[:, None] - corners, axis=2) < 2.1
    faces = [
        (a, b, c) for a in range(12) for b in range(a) for c in range(b) if near[a, b] and near[b, c] and near[c, a]
    ]
    return corners, np.array(faces)


def sphere(cuts=CUTS):
    """Returns an icosahedron whose triangles were cut in four `cuts` times, with its vertices on the unit sphere.

    (n, 3) float32, (20 * 4 ** cuts, 3) int32
    """
    corners, faces = icosahedron()
    points = corners / np.linalg.norm(corners[0])
    triangles = np.where(np.linalg.det(corners[faces])[:, None] > 0, faces, faces[:, ::-1])
    for _ in range(cuts):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, label = np.unique(edges, axis=0, return_inverse=True)
        middle = points[unique].sum(1)
        (a, b, c), (ab, bc, ca) = triangles.T, (len(points) + label.reshape(-1, 3)).T
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        points = np.concatenate([points, middle / np.linalg.norm(middle, axis=1)[:, None]])
        triangles = np.concatenate([np.stack(part, 1) for part in parts])
    return points.astype(np.float32), triangles.astype(np.int32)


GENERATED = {"scan": scan, "sphere": sphere}
