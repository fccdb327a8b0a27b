# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of a decimation without the faces that Blender cannot hold."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Decimated:
    """The native result of decimate() as far as Blender and files of faces can hold it.

    The documentation of decimate() tells the arrays.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    vertex_map: np.ndarray
    vertex_source: np.ndarray
    triangle_source: np.ndarray
    # (l,) bool: an edge was flipped or the source triangle divided, so that the triangle has other corners than it.
    turned: np.ndarray
    source_triangle: np.ndarray
    source_weights: np.ndarray
    coincident: int  # number of triangles that were left out: Blender holds only one face on the same three vertices

    @classmethod
    def of(cls, result, source):
        vertices, vertex_map, vertex_source = result.vertices, result.vertex_map, result.vertex_source
        welded = vertex_map[source.triangles[result.triangle_source]]
        # A source triangle that was divided at T-junctions may have several pieces left, and none of them is that triangle.
        pieces = np.bincount(result.triangle_source, minlength=len(source.triangles))[result.triangle_source]
        turned = (welded != result.triangles).any(1) | (pieces > 1)
        # The decimation joins vertices at the same position. A face that is only a segment or a point may then name a
        # vertex twice, which Blender cannot hold: such a face keeps its own vertices.
        a, b, c = result.triangles.T
        repeats = source.triangles[result.triangle_source[(a == b) | (b == c) | (c == a)]]
        own = np.unique(repeats[vertex_source[vertex_map[repeats]] != repeats])
        vertex_map = vertex_map.copy()
        vertex_map[own] = len(vertices) + np.arange(len(own))
        vertices = np.concatenate([vertices, source.vertices[own]])
        vertex_source = np.concatenate([vertex_source, own.astype(vertex_source.dtype)])
        triangles = np.where(turned[:, None], result.triangles, vertex_map[source.triangles[result.triangle_source]])
        # Two sheets that lie exactly on one another may end on the same vertices. They are the same surface: one is kept.
        _, first = np.unique(np.sort(triangles, 1), axis=0, return_index=True)
        kept = np.sort(first)
        return cls(
            vertices,
            triangles[kept],
            vertex_map,
            vertex_source,
            result.triangle_source[kept],
            turned[kept],
            result.source_triangle[kept],
            result.source_weights[kept],
            len(triangles) - len(kept),
        )
