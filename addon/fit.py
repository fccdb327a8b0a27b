# SPDX-License-Identifier: GPL-3.0-or-later
"""The value of a modifier's parameter that leaves the fewest triangles within the tolerance, by trial.

The deviation falls from one end of the range to the other, but not from value to value: a mesh of 300 triangles may keep
what one of 310 misses. So the range is scanned from the end with the fewest triangles until a value keeps the tolerance,
and then again, closely, from where the deviation first came near to it.
"""

from dataclasses import dataclass

import numpy as np

_COARSE = 1.2  # ratio of the values that are tried first,
_FINE = 1.01  # and of those that are tried where the deviation is near the tolerance:
NEAR = 2.0  # this many times, because neighbouring values may differ by half.
_BARELY = 1.03  # Beside what missed by so little there may be what does not.


def search(first, last):
    """A generator: yields a value, is sent its deviation in tolerances, and returns the best value or None.

    The best value is always the last one that was within. first: where there are fewest triangles.
    """
    coarse = _steps(first, last, _COARSE)
    missed = []
    for value in coarse:
        deviation = yield value
        if deviation <= 1:
            break
        missed.append(deviation)
    else:
        return None
    near = next((i for i, deviation in enumerate(missed) if deviation <= NEAR), len(missed))
    barely = []
    for finer in _steps(coarse[max(near - 1, 0)], value, _FINE)[1:-1]:
        deviation = yield finer
        if deviation <= 1:
            value = finer
            break
        if deviation <= _BARELY:
            barely.append(finer)
    half = (_FINE if first < last else 1 / _FINE) ** 0.5
    for finer in (missed * step for missed in barely for step in (1 / half, half)):
        if (yield finer) <= 1:
            return finer
    return value


def _steps(first, last, ratio):
    """Values from first to last, both included, at most `ratio` apart."""
    return np.geomspace(first, last, 2 + int(abs(np.log(last / first)) / np.log(ratio))).tolist()


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
