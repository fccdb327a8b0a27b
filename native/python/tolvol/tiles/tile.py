# SPDX-License-Identifier: GPL-3.0-or-later
"""The work in one cell: decimates the faces in it, or measures the distances of what is there.

Each function reads chunks and writes or returns what it found, and depends on nothing else: any process may call it.
"""

from dataclasses import dataclass, field

import numpy as np

from ..shared import package
from ..shared.proof.measure import part_of
from . import chunks, clipping
from .cells import Box, centroids

_BLOCK = 1 << 16  # triangles that are looked at at once


@dataclass(frozen=True)
class Tile:
    """A cell, the chunks of the present mesh, and those of the reference."""

    cell: Box
    mesh: tuple
    reference: tuple  # equal to `mesh` in the first round
    tolerance: float
    options: dict = field(default_factory=dict)  # of the native decimate()
    grid_memory: int | None = None  # the most bytes of the grid of the native volume


def decimate(tile, output, progress=None):
    """Decimates the faces inside the cell, and writes the faces that the cell owns to `output`.

    The cell owns the faces inside it, and of those that reach out of it the ones with their centroid in the cell. Returns
    (Chunk, the largest angle in degrees between a new face and its witnesses, or None if there is a face without an angle, and a
    list of warnings).
    """
    vertices, triangles = chunks.gather(tile.mesh, tile.cell, tile.options["threads"])
    inside = chunks.of_corners(vertices, triangles, tile.cell.strictly_holds_triangles)
    rest = vertices[triangles[~inside]]
    owned = rest[tile.cell.holds(centroids(rest))]
    decimated = (
        _decimated(tile, vertices, triangles, inside, progress) if _has_area(vertices, triangles[inside]) else None
    )
    kept, angle, warnings = decimated or (vertices[triangles[inside]], 0.0, [])
    return chunks.write(output, np.concatenate([kept, owned])), angle, warnings


def _decimated(tile, vertices, triangles, inside, progress):
    """Returns (the corners of what the triangles inside become, the angle, warnings), or None where the volume is too small."""
    native, threads = package.module, tile.options["threads"]
    if tile.reference == tile.mesh:
        around = vertices, triangles
    else:
        around = chunks.gather(tile.reference, tile.cell.grown(tile.tolerance), threads)
    try:
        volume = native.ToleranceVolume(
            *around, tile.tolerance, grid_memory=tile.grid_memory, threads=threads, progress=progress
        )
    except native.InvalidInput as error:
        if error.code != "tolerance_too_large":
            raise
        return None  # The cell is smaller than the tolerance: the faces wait for a larger one.
    cell = (tile.cell.lower, tile.cell.upper)
    # A face of an earlier round that is not proved again, in another frame, stays as it is; the measuring decides about it.
    result = native.decimate(vertices, triangles, volume, cell=cell, outside="keep", progress=progress, **tile.options)
    normals = result.report["normals"]
    known = normals and not normals["unsure"] and not normals["exceeded_after"]
    angle = (normals["largest"] or 0.0) if known else None
    kept = result.vertices[result.triangles[inside[result.triangle_source]]]
    return kept, angle, result.report["warnings"]


def measure(tile, progress=None):
    """Measures the distances between the mesh and the reference in the cell. Returns two intervals, (lower, upper) each.

    The first is of the part of the mesh in the cell to the reference, the second of that of the reference to the mesh. The
    lower ends are valid up to the tolerance: beyond, nothing was looked for.
    """
    threads = tile.options["threads"]
    with part_of(progress, 0, 0.5):
        forward = _largest(tile.mesh, tile.reference, tile, threads, progress)
    with part_of(progress, 0.5, 1):
        return forward, _largest(tile.reference, tile.mesh, tile, threads, progress)


def _largest(those, others, tile, threads, progress):
    vertices, triangles = chunks.gather(those, tile.cell, threads)
    rounding = clipping.rounding(vertices)
    box = tile.cell.grown(rounding)
    # Clipping would give the triangles inside back as they are.
    inside = chunks.of_corners(vertices, triangles, tile.cell.strictly_holds_triangles)
    rest = vertices[triangles[~inside]]
    vertices, triangles = chunks.selected(vertices, triangles, inside)
    # Only triangles that hardly leave a side of the cell need the larger box, by which the cells together miss no point: of all
    # others, what a cell misses is near what it has. The larger box makes slivers, which take long to measure.
    shallow = clipping.are_shallow(rest, tile.cell, rounding)
    clipped = np.concatenate([clipping.clipped(rest[~shallow], tile.cell), clipping.clipped(rest[shallow], box)])
    vertices, triangles = chunks.joined([(vertices, triangles), chunks.mesh_of(clipped)])
    if not len(triangles):
        return 0.0, 0.0
    around = chunks.gather(others, box.grown(tile.tolerance), threads)
    if not len(around[1]):
        return tile.tolerance, np.inf
    # The search ends below the bound, and with what is added the distance must not exceed the tolerance.
    loss = clipping.STEEP_LOSS * rounding
    bound = max(tile.tolerance - 2 * loss, 0.0)
    found = package.module.directed_hausdorff(
        vertices, triangles, *around, bound=bound, threads=threads, progress=progress
    )
    return max(found.lower - loss, 0.0), found.upper + loss


def _has_area(vertices, triangles):
    wide = vertices.astype(np.float64)
    for first in range(0, len(triangles), _BLOCK):
        a, b, c = (wide[corner] for corner in triangles[first : first + _BLOCK].T)
        if np.cross(b - a, c - a).any():
            return True
    return False
