# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds the faces that close holes to the arrays of a mesh."""

from dataclasses import dataclass

import numpy as np

from .surface import MeshArrays

# The report has the places of so many closed holes, the largest ones.
MOST_PLACES = 100


@dataclass(frozen=True)
class FilledArrays(MeshArrays):
    """A mesh with further triangles at the end, k of them. Each is a polygon of its own.

    The corner of a new triangle is a corner of the mesh at the rim of the hole, whose attributes it takes.
    """

    like: np.ndarray  # (k,) int32: the polygon at the rim whose attributes the new face takes
    # (m + k,) int32: where islands of a UV map meet at a hole, its new faces have a number that no other hole has. If
    # they were part of the islands, the islands would become one. All other triangles have 0.
    hole: np.ndarray


def filled(arrays, result, allowed=None, uvs=None):
    """Returns (FilledArrays, the report of the closed holes) for the result of the native close_holes() for `arrays`.

    The report: closed, triangles_added; refused: {reason: count}; places: see largest().

    allowed: (polygons,) bool, or None for all: holes with another polygon at their rim stay open. uvs: the values of UV
    maps at the mesh's corners, or None.
    """
    count = len(arrays.triangles)
    kept = np.ones(len(result.triangle_loop), bool)
    refused = dict(result.report["refused"])
    if allowed is not None:
        # Each edge of a rim is a side of one new triangle, so that the borders name all polygons at the rim.
        borders = result.borders
        kept_out = (borders >= 0) & ~allowed[arrays.polygons[borders]]
        loops = np.unique(result.triangle_loop[kept_out.any(1)])
        kept = ~np.isin(result.triangle_loop, loops)
        if len(loops):
            refused["unselected"] = len(loops)
    sources = result.corner_source[kept]
    # The face at the rim on the first side that has one, or else a face at the first corner.
    borders = result.borders[kept]
    first = np.argmax(borders >= 0, 1)
    at_rim = borders[np.arange(len(borders)), first]
    like = arrays.polygons[np.where(at_rim >= 0, at_rim, sources[:, 0] // 3)]
    polygons = arrays.polygons[-1] + 1
    numbers = np.zeros(len(result.triangle_loop), np.int32)
    if uvs is not None:
        numbers = np.where(_meet_islands(arrays, result, uvs)[result.triangle_loop], result.triangle_loop + 1, 0)
    added = FilledArrays(
        arrays.vertices,
        np.concatenate([arrays.triangles, result.triangles[count:][kept]]),
        np.concatenate([arrays.corners, arrays.corners.ravel()[sources]]),
        np.concatenate([arrays.polygons, np.arange(polygons, polygons + kept.sum(), dtype=arrays.polygons.dtype)]),
        like,
        np.concatenate([np.zeros(count, np.int32), numbers[kept].astype(np.int32)]),
    )
    loops = result.loops
    closed = [loops[loop] for loop in np.unique(result.triangle_loop[kept])]
    places = [{"centre": list(loop["centre"]), "perimeter": loop["perimeter"]} for loop in closed]
    return added, {
        "closed": len(closed),
        "triangles_added": int(kept.sum()),
        "refused": refused,
        "places": largest(places),
    }


def largest(places):
    """Returns the MOST_PLACES largest of the places of closed holes, the largest first.

    A place is {centre, perimeter}: the mean of the corners of the rim, and the length of the rim, both in world units.
    """
    return sorted(places, key=lambda place: -place["perimeter"])[:MOST_PLACES]


def _meet_islands(arrays, result, uvs):
    """Returns (loops,) bool: the closed loops along which the UVs at some vertex differ from one face to the next."""
    faces, sides = np.nonzero(result.borders >= 0)
    new = result.triangles[len(arrays.triangles) :]
    rims = result.borders[faces, sides]
    found = np.zeros(len(result.loops), bool)
    vertices, values = [], []
    for end in (0, 1):
        vertex = new[faces, (sides + end) % 3]
        # The face at the rim may have another vertex at the same place.
        there = (arrays.vertices[arrays.triangles[rims]] == arrays.vertices[vertex][:, None]).all(2)
        vertices.append(vertex)
        values.append(uvs[arrays.corners[rims, np.argmax(there, 1)]])
    loops = np.tile(result.triangle_loop[faces], 2)
    vertices, values = np.concatenate(vertices), np.concatenate(values)
    order = np.lexsort((vertices, loops))
    loops, vertices, values = loops[order], vertices[order], values[order]
    alike = (loops[1:] == loops[:-1]) & (vertices[1:] == vertices[:-1])
    found[loops[1:][alike & (values[1:] != values[:-1]).any(1)]] = True
    return found
