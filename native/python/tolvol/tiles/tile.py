# SPDX-License-Identifier: GPL-3.0-or-later
"""The work in one cell: decimates the faces in it, or measures the distances of what is there.

Each function reads soups and writes or returns what it found, and depends on nothing else: any process may call it.
"""

from dataclasses import dataclass, field

import numpy as np

from ..shared import package
from ..shared.proof.measure import part_of
from ..welding import welded
from . import clipping, soups
from .cells import Box, centroids

_BLOCK = 1 << 16  # triangles that are looked at at once


@dataclass(frozen=True)
class Tile:
    """A cell, the soups of the present mesh, and those of the reference."""

    cell: Box
    mesh: tuple
    reference: tuple  # equal to `mesh` in the first round
    tolerance: float
    options: dict = field(default_factory=dict)  # of the native decimate()
    grid_memory: int | None = None  # the most bytes of the grid of the native volume


def decimate(tile, output, progress=None):
    """Decimates the faces inside the cell, and writes the faces that the cell owns to `output`.

    The cell owns the faces inside it, and of those that reach out of it the ones with their centroid in the cell. Returns
    (Soup, the largest angle in degrees between a new face and its witnesses, or None if there is a face without an angle, and a
    list of warnings).
    """
    corners = soups.gather(tile.mesh, tile.cell)
    inside = tile.cell.strictly_holds_triangles(corners)
    owned = corners[~inside & tile.cell.holds(centroids(corners))]
    vertices, triangles = mesh_of(corners)
    del corners  # The memory is needed.
    decimated = (
        _decimated(tile, vertices, triangles, inside, progress) if _has_area(vertices, triangles[inside]) else None
    )
    kept, angle, warnings = decimated or (vertices[triangles[inside]], 0.0, [])
    return soups.write(output, np.concatenate([kept, owned])), angle, warnings


def _decimated(tile, vertices, triangles, inside, progress):
    """Returns (the corners of what the triangles inside become, the angle, warnings), or None where the volume is too small."""
    native = package.module
    if tile.reference == tile.mesh:
        around = vertices, triangles
    else:
        around = mesh_of(soups.gather(tile.reference, tile.cell.grown(tile.tolerance)))
    threads = tile.options["threads"]
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
    corners = soups.gather(those, tile.cell)
    rounding = clipping.rounding(corners)
    box = tile.cell.grown(rounding)
    inside = tile.cell.strictly_holds_triangles(corners)  # Clipping would give these back as they are.
    vertices, triangles = mesh_of(corners[inside])
    rest = corners[~inside]
    del corners, inside  # The memory is needed.
    # Only triangles that hardly leave a side of the cell need the larger box, by which the cells together miss no point: of all
    # others, what a cell misses is near what it has. The larger box makes slivers, which take long to measure.
    shallow = clipping.are_shallow(rest, tile.cell, rounding)
    clipped = np.concatenate([clipping.clipped(rest[~shallow], tile.cell), clipping.clipped(rest[shallow], box)])
    vertices, triangles = _joined((vertices, triangles), mesh_of(clipped))
    rounding *= clipping.STEEP_LOSS
    if not len(triangles):
        return 0.0, 0.0
    around = soups.gather(others, box.grown(tile.tolerance))
    if not len(around):
        return tile.tolerance, np.inf
    found = package.module.directed_hausdorff(
        vertices, triangles, *mesh_of(around), bound=tile.tolerance, threads=threads, progress=progress
    )
    return max(found.lower - rounding, 0.0), found.upper + rounding


def mesh_of(corners):
    """Returns (vertices, triangles) of a soup, with one vertex at each position."""
    vertices, number = welded(corners.reshape(-1, 3))
    return vertices, number.reshape(-1, 3)


def _joined(one, other):
    """Returns (vertices, triangles) of two meshes together, whose vertices stay apart, as float64."""
    vertices = np.concatenate([one[0], other[0]], dtype=np.float64)
    return vertices, np.concatenate([one[1], other[1] + len(one[0])], dtype=np.int32)


def _has_area(vertices, triangles):
    wide = vertices.astype(np.float64)
    for first in range(0, len(triangles), _BLOCK):
        a, b, c = (wide[corner] for corner in triangles[first : first + _BLOCK].T)
        if np.cross(b - a, c - a).any():
            return True
    return False
