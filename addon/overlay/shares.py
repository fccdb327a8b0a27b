# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts for the legend which share of a coloured surface lies in each band of distances, in a thread."""

import functools
import math
from dataclasses import dataclass

import numpy as np

from ..background import queue
from ..redraw import redraw_views
from ..shared.surface import areas
from .scale import rounded_up

_EVERY = 0.25  # seconds between two counts while a mesh goes on changing
_SAMPLES = 50_000  # points at which the largest distance is looked for, or more

_SHARES, _LARGEST = TASKS = "shares", "largest distance"  # kinds of tasks in the queue

_largest = {}  # name of an object -> (state that was measured, the largest distance as a round number or None)
_counted = {}  # name of an object -> ((state that was counted, Scale), Shares or None)


@dataclass(frozen=True)
class Shares:
    bands: list  # of each band, from the lowest colour on
    outside: float  # of what is beyond the tolerance
    histogram: list  # of equal intervals of distances, from the lowest colour on
    area: float  # of the surface, in the world


def together(every):
    """Returns the Shares of several surfaces taken for one, or None if those of one are not known. The scale is the same."""
    every = list(every)
    if any(each is None for each in every):
        return None
    areas = np.array([each.area for each in every])
    weights = areas / areas.sum() if areas.sum() > 0 else np.zeros(len(every))

    def mean(name):
        return (weights @ np.array([getattr(each, name) for each in every])).tolist()

    return Shares(mean("bands"), mean("outside"), mean("histogram"), float(areas.sum()))


def known(name, coloured, scale):
    """Returns the Shares of a Coloured in the bands of a Scale, or None while they are not known.

    name: that of the object. If surface, matrix or scale have changed, the shares are counted anew, and the views are drawn
    again.
    """
    about = coloured.state, scale
    last = _counted.get(name)
    if last is not None and last[0] == about:
        return last[1]
    if coloured.present:
        _later(_SHARES, name, last, coloured, functools.partial(_count, scale), _counted, about)
    return None


def automatic_reach(name, coloured):
    """Returns the largest distance of a Coloured as a round number, or None.

    If surface or matrix have changed, it is measured anew, and until then the last one is returned. It is None if nothing
    deviates, too.
    """
    last = _largest.get(name)
    if coloured.present and (last is None or last[0] != coloured.state):
        _later(_LARGEST, name, last, coloured, _measure, _largest, coloured.state)
    return last[1] if last is not None else None


def _later(kind, name, last, coloured, work_of, kept, about):
    triangles = coloured.triangles
    if triangles.triangles is None or not len(triangles.triangles):
        return
    tree, to_world, vertices, corners = coloured.tree, coloured.to_world, triangles.vertices, triangles.triangles
    queue.later(
        (kind, name),
        _EVERY if last else 0,
        lambda: functools.partial(work_of, tree, vertices, corners, to_world),
        functools.partial(_finish, kept, name, about),
    )


def _count(scale, tree, vertices, triangles, to_world, progress):
    counted = tree.shares(vertices, triangles, scale.edges(), to_world=to_world, progress=progress)
    *bands, outside = scale.fold(counted)
    corners = vertices.astype(np.float64)[triangles] @ to_world[:3, :3].T
    return Shares(bands, outside, scale.histogram(counted), float(areas(corners).sum()))


def _samples(vertices, triangles):
    """Returns the vertices, and points of all triangles: their centres, or for few triangles a finer grid on each."""
    steps = int(math.sqrt(2 * _SAMPLES / len(triangles)))
    weights = np.full((1, 3), 1 / 3)
    if steps > 2:
        first, second = (each.ravel() for each in np.indices((steps + 1, steps + 1)) / steps)
        inside = first + second <= 1 + 1e-9
        weights = np.stack([first, second, 1 - first - second], 1)[inside]
    points = np.einsum("wk,tkd->twd", weights, vertices[triangles].astype(np.float64))
    return np.concatenate([vertices[np.unique(triangles)], points.reshape(-1, 3)])


def _measure(tree, vertices, triangles, to_world, progress):
    """Returns the largest distance at a sample, rounded up. Inside a large face between the samples it may be larger."""
    samples = _samples(vertices, triangles)
    largest = np.abs(tree.signed_distance(samples, to_world=to_world, progress=progress)).max()
    return rounded_up(float(largest)) if largest > tree.ROUNDING / tree.scale else None


def _finish(kept, name, about, outcome, error):
    kept[name] = about, outcome if error is None else None
    redraw_views()


def forget(name=None):
    """Forgets the shares of one object, or of all objects if no name is given."""
    for kept in (_largest, _counted):
        if name is None:
            kept.clear()
        else:
            kept.pop(name, None)
