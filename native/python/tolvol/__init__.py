# SPDX-License-Identifier: GPL-3.0-or-later
"""Tolerance volumes: keep a triangle mesh within a tolerance of a reference surface, proved.

A ToleranceVolume holds all points within a tolerance of a reference mesh. The functions decimate, smooth, deform and
constrain and the class Guard keep a mesh in it, and close_holes fills the holes that can be filled in it.
hausdorff, directed_hausdorff and deviation measure the distances of two meshes. They share no bounds with the functions
before, whose results they judge.

These conventions hold for every function:

- Vertices are (n, 3) float32 or float64 arrays in local coordinates. Results have the dtype of the input.
- to_world is a (4, 4) matrix that maps local coordinates to world units, in which tolerances and distances are given.
  None is the identity. Functions without to_world take coordinates in one common space.
- triangles is an (m, 3) integer array of indices of vertices. Functions that also take points, segments and quads call it
  faces: (m, k), with k from 1 to 4.
- threads is the number of threads, or None for one per core. Only with max_seconds does the result depend on it.
- progress is a Progress, by which another thread follows the call and stops it, or None. Long calls release the GIL.
- None stands for "no limit" and for "not given". All options after the first few arguments are given by name.
- Errors are TolvolErrors. What is wrong with an argument is an InvalidInput, which is a ValueError too.
"""

import enum

from ._native import (
    OUTSIDE_COLOURS,
    Camera,
    Cancelled,
    CheckResult,
    ConstrainResult,
    DecimationResult,
    DeformationResult,
    DeviationResult,
    DirectedHausdorffResult,
    DisplayTree,
    GlUnavailable,
    Guard,
    HausdorffResult,
    HoleClosingResult,
    InvalidInput,
    Lattice,
    Progress,
    ResourceLimit,
    Sides,
    SmoothingResult,
    ToleranceVolume,
    TolvolError,
    Worker,
    __version__,
    close_holes,
    constrain,
    crossing_pairs,
    decimate,
    deform,
    deviation,
    diagonal,
    directed_hausdorff,
    hausdorff,
    lattice_points,
    list_rows,
    pause,
    render_distance,
    render_volume,
    renderer,
    shutdown,
    smooth,
    solidity,
    transfer_colours,
    wedges,
    weld,
)

__all__ = [
    "OUTSIDE_COLOURS",
    "Camera",
    "Cancelled",
    "CheckResult",
    "ConstrainResult",
    "DecimationResult",
    "DeformationResult",
    "DeviationResult",
    "DirectedHausdorffResult",
    "DisplayTree",
    "GlUnavailable",
    "Guard",
    "HausdorffResult",
    "HoleClosingResult",
    "InvalidInput",
    "Lattice",
    "Progress",
    "ResourceLimit",
    "Sides",
    "SmoothingResult",
    "ToleranceVolume",
    "TolvolError",
    "Verdict",
    "Worker",
    "__version__",
    "close_holes",
    "constrain",
    "crossing_pairs",
    "decimate",
    "deform",
    "deviation",
    "diagonal",
    "directed_hausdorff",
    "hausdorff",
    "lattice_points",
    "list_rows",
    "pause",
    "render_distance",
    "render_volume",
    "renderer",
    "shutdown",
    "smooth",
    "solidity",
    "transfer_colours",
    "wedges",
    "weld",
]


class Verdict(enum.IntEnum):
    """What a check found out about a face. A greater verdict is a better one."""

    OUTSIDE = 0
    """It is proved that some point of the face is farther away than the tolerance."""
    UNPROVED = 1
    """Neither was proved. The face counts as outside."""
    INSIDE = 2
    """It is proved that every point of the face is within the tolerance."""
