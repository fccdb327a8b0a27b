# SPDX-License-Identifier: GPL-3.0-or-later
"""Searches by trial the value of a modifier's parameter that leaves the fewest triangles within the tolerance.

Over the range of the parameter the deviation falls, but not from each value to the next: a mesh of 300 triangles may be
within the tolerance while one of 310 is not, so bisection may miss the best value. Instead, coarse steps go from the end
with the fewest triangles until a value is within the tolerance. Then fine steps go over the last part of this way, from
the value where the deviation first came near to the tolerance.
"""

from dataclasses import dataclass

import numpy as np

# Successive values in the coarse steps have a ratio between these two: the farther from the tolerance, the larger.
_COARSE, _COARSEST = 1.2, 2.0
# The fine steps begin where the deviation is first below so many tolerances, because neighbours may differ by half.
NEAR = 2.0
# Successive values in the fine steps have this ratio.
_FINE = 1.015
# Beside a value whose deviation is below so many tolerances, values half a fine step away are tried.
_BARELY = 1.06


def search(first, last):
    """A generator: yields a value, is sent the deviation at this value in tolerances, and returns the best value or None.

    The best value is always the last tried value that was within the tolerance. first: the end of the range with the
    fewest triangles.
    """
    onward = 1 if last > first else -1
    value, missed = first, []
    while (deviation := (yield value)) > 1:
        if value == last:
            return None
        missed.append((value, deviation))
        step = min(max((deviation / NEAR) ** 0.5, _COARSE), _COARSEST)
        value = onward * min(onward * value * step**onward, onward * last)
    if not missed:
        return value
    near = next((i for i, (_, deviation) in enumerate(missed) if deviation <= NEAR), len(missed))
    start, barely = missed[max(near - 1, 0)][0], []
    for i in range(1, int(np.log(value / start) / np.log(_FINE) * onward) + 1):
        finer = start * _FINE ** (onward * i)
        deviation = yield finer
        if deviation <= 1:
            value = finer
            break
        if deviation <= _BARELY:
            barely.append(finer)
    for finer in (beside * _FINE ** (onward * half) for beside in barely for half in (-0.5, 0.5)):
        if (yield finer) <= 1:
            return finer
    return value


@dataclass(frozen=True)
class Parameter:
    """The parameter of a modifier that is searched, with its range."""

    name: str  # the name of the modifier's property
    label: str
    first: float  # the end of the range with the fewest triangles
    last: float


def parameter(modifier, triangles, size, tolerance):
    """Returns the Parameter of a modifier on a mesh. size, tolerance: in the mesh's own coordinates."""
    if modifier.type == "DECIMATE":
        return Parameter("ratio", "Ratio", 4 / max(triangles, 4), 1.0)
    if modifier.type == "REMESH":
        return Parameter("voxel_size", "Voxel Size", size / 4, max(size / 400, tolerance / 4))
    return Parameter("merge_threshold", "Distance", size / 4, tolerance / 1000)


def fit_blocked(modifier):
    """Why a modifier has no parameter that can be searched, or None."""
    if modifier.type == "DECIMATE" and modifier.decimate_type != "COLLAPSE":
        return "Set the modifier to Collapse"
    if modifier.type == "REMESH" and modifier.mode != "VOXEL":
        return "Set the modifier to Voxel"
    return None
