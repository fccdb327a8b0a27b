# SPDX-License-Identifier: GPL-3.0-or-later
"""Searches by trial the value of a modifier's parameter that leaves the fewest triangles within the tolerance.

Over the range of the parameter the deviation falls, but not from each value to the next: a mesh of 300 triangles may be
within the tolerance while one of 310 is not, so bisection may miss the best value. The search goes from coarse to fine. Large
steps, as large as the deviation suggests, find a value within the tolerance, and some more bring it near to the limit. From
there fine steps go towards fewer triangles, to the value where the deviation is so large that no neighbour can be within.
Blender's Decimate leaves some four times as many triangles as the decimation here, so that its search begins near the limit.
"""

import math
from dataclasses import dataclass

# The fine steps end where the deviation is above so many tolerances, because neighbours may differ by half.
_NEAR = 2.0
# Successive values in the fine steps have at least this ratio.
_FINE = math.log(1.015)
# The logarithm of the deviation changes by at most about so much for each unit of the logarithm of the value: where the
# deviation is larger, the next step may be larger.
_STEEPEST = 25
# Beside a value whose deviation is below so many tolerances, values half a fine step away are tried.
_BARELY = 1.06
# The logarithm of the deviation falls by about so much for each unit of the logarithm of the value, and surely within these
# limits; so the large steps find their way.
_SLOPE, _FLATTEST, _STEEPEST_FALL = 0.75, 0.5, 2.0
_SMALLEST_STEP, _LARGEST_STEP = math.log(1.2), math.log(1000)
# Where the fine steps begin is known with this ratio.
_CLOSE = math.log(1.06)
# A mesh within the tolerance that is refused for another reason steers the search as one that is beyond it by so much.
REFUSED = 1.5
_LEAST_KNOWN, _MOST_KNOWN = math.exp(-3), 1e6  # deviations beyond these steer as if they were these

# Blender's Decimate leaves about so many times as many triangles as the decimation here.
_OF_PLAIN = 4.0

# Blender needs as long for each value as for the mesh without the modifier: all values together take as long as so many
# triangles.
_TRIANGLES = 420_000
_LEAST_VALUES, _MOST_VALUES = 5, 99


def most_values(triangles):
    """Returns how many values are tried for a mesh of so many triangles."""
    return min(max(_TRIANGLES // max(triangles, 1), _LEAST_VALUES), _MOST_VALUES)


def search(first, last, most=_MOST_VALUES, near=None):
    """A generator: yields a value, is sent the deviation at this value in tolerances, and ends when no better one is expected.

    first: the end of the range with the fewest triangles; most: how many values are tried at most, unless none of them is
    within the tolerance; near: a value near to the best one, at which the search begins, or None. It returns the best value,
    the one nearest to `first` whose deviation was at most 1, or None.
    """
    onward = 1 if last > first else -1
    start, end = onward * math.log(first), onward * math.log(last)
    tried = 0

    def ask(place):
        nonlocal tried
        tried += 1
        value = first if place <= start else last if place >= end else math.exp(onward * place)
        return value, min(max((yield value), _LEAST_KNOWN), _MOST_KNOWN)

    begin = start if near is None else min(max(onward * math.log(near), start), end)
    place, missed, slope = begin, None, _SLOPE
    while True:
        value, deviation = yield from ask(place)
        if deviation <= 1:
            break
        if place >= end:
            return None
        if missed and missed[1] > deviation:
            slope = math.log(missed[1] / deviation) / (place - missed[0])
        missed = place, deviation
        step = math.log(deviation) / min(max(slope, _FLATTEST), _STEEPEST_FALL)
        place = min(place + min(max(step, _SMALLEST_STEP), _LARGEST_STEP), end)
    best, within = value, (place, deviation)
    while missed is None:  # The search has begun within the tolerance: the limit lies towards fewer triangles.
        if place <= start or tried >= most:
            return best
        place = max(place - max(-math.log(deviation) / _SLOPE, _SMALLEST_STEP), start)
        value, deviation = yield from ask(place)
        if deviation <= 1:
            best, within = value, (place, deviation)
        else:
            missed = place, deviation
    while within[0] - missed[0] > _CLOSE and tried < most:
        above, below = math.log(missed[1]), -math.log(within[1])
        share = min(max(above / (above + below), 0.25), 0.75)
        place = missed[0] + share * (within[0] - missed[0])
        value, deviation = yield from ask(place)
        if deviation <= 1:
            best, within = value, (place, deviation)
        else:
            missed = place, deviation
    place, deviation, barely = within[0], 1.0, []
    while tried < most:
        place -= max(_FINE, math.log(deviation) / _STEEPEST)
        if place <= start:
            break
        value, deviation = yield from ask(place)
        if deviation <= 1:
            best, within, deviation = value, (place, deviation), 1.0
        elif deviation > _NEAR:
            break
        elif deviation <= _BARELY:
            barely.append(place)
    for place in (beside + half * _FINE for beside in sorted(barely) for half in (-0.5, 0.5)):
        if place >= within[0] or tried >= most:
            continue
        value, deviation = yield from ask(place)
        if deviation <= 1:
            return value
    return best


def close(value, other):
    """Whether two values are not farther from each other than the search knows the limit."""
    return abs(math.log(value / other)) <= _CLOSE


@dataclass(frozen=True)
class Parameter:
    """The parameter of a modifier that is searched, with its range."""

    name: str  # the name of the modifier's property
    label: str
    first: float  # the end of the range with the fewest triangles
    last: float
    near: float | None = None  # a value that is likely to be near to the best one, if one is known


def parameter(modifier, triangles, size, tolerance, plain=None):
    """Returns the Parameter of a modifier on a mesh. size, tolerance: in the mesh's own coordinates; plain: how many triangles
    Decimate would leave, if that is known."""
    if modifier.type == "DECIMATE":
        near = None if plain is None else min(_OF_PLAIN * plain / max(triangles, 1), 1.0)
        return Parameter("ratio", "Ratio", 4 / max(triangles, 4), 1.0, near)
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
