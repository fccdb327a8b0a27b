# SPDX-License-Identifier: GPL-3.0-or-later
"""The value of a modifier's parameter that leaves the fewest triangles within the tolerance, by trial.

The deviation falls from one end of the range to the other, but not from value to value: a mesh of 300 triangles may keep
what one of 310 misses. So the range is scanned from the end with the fewest triangles until a value keeps the tolerance,
and then again, closely, from where the deviation first came near to it.
"""

from dataclasses import dataclass

import numpy as np

# Ratios of the values that are tried first: the farther from the tolerance, the larger.
_COARSE, _COARSEST = 1.2, 2.0
NEAR = 2.0  # tolerances: neighbouring values may differ by half. From there on the values tried next are
_FINE = 1.015  # times each other.
_BARELY = 1.06  # Beside what missed by so little there may be what does not.


def search(first, last):
    """A generator: yields a value, is sent its deviation in tolerances, and returns the best value or None.

    The best value is always the last one that was within. first: where there are fewest triangles.
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
    """What is searched for a modifier."""

    name: str  # of the property
    label: str
    first: float  # where there are fewest triangles
    last: float


def parameter(modifier, triangles, size, tolerance):
    """The Parameter of a modifier on a mesh: lengths are those of its own coordinates."""
    if modifier.type == "DECIMATE":
        return Parameter("ratio", "Ratio", 4 / max(triangles, 4), 1.0)
    if modifier.type == "REMESH":
        return Parameter("voxel_size", "Voxel Size", size / 4, max(size / 400, tolerance / 4))
    return Parameter("merge_threshold", "Distance", size / 4, tolerance / 1000)


def fit_blocked(modifier):
    """Why a modifier that changes faces has nothing to search, or None."""
    if modifier.type == "DECIMATE" and modifier.decimate_type != "COLLAPSE":
        return "Set it to Collapse"
    if modifier.type == "REMESH" and modifier.mode != "VOXEL":
        return "Set it to Voxel"
    return None
