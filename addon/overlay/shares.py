# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts for the legend which share of a shown surface lies in each band of distances, in a thread."""

import functools
from dataclasses import replace

import numpy as np

from . import field, work
from .scale import rounded_up

_EVERY = 0.25  # seconds between two counts while a mesh goes on changing

# Name of an object -> ((state of the surface, field, tolerance, to_world, scale) that the shares are of, Scale, shares).
_known = {}


def known(ob, surface, found, scale, automatic, changed):
    """Returns the shares in the bands of a Scale and beyond the tolerance, or None while they are not known.

    automatic: whether the colours are to end at the largest distance; the shares are then those of automatic_scale(). If
    mesh, matrix or scale have changed, the shares are counted anew, and then changed() is called.
    """
    to_world = np.linalg.inv(found.to_frame) @ field.vertex_to_frame(found, ob)
    wanted = replace(scale, reach=scale.tolerance) if automatic else scale
    about = surface.changes, id(found), scale.tolerance, to_world.tobytes(), wanted, automatic
    name = ob.name
    last = _known.get(name)
    if last is not None and last[0] == about:
        return last[2]
    if surface.triangles is not None and len(surface.triangles):
        work.later(
            ("shares", name),
            _EVERY if last else 0,
            lambda: functools.partial(
                _count, found.tree, surface.vertices, surface.triangles, to_world, wanted, automatic
            ),
            functools.partial(_finish, name, about, changed),
        )
    return None


def _count(tree, vertices, triangles, to_world, scale, automatic, progress):
    """Returns (Scale, shares). Distances between the vertices may be larger than the automatic range by little."""
    if automatic:
        used = vertices[np.unique(triangles)]
        largest = np.abs(tree.signed_distance(used, to_world=to_world, progress=progress)).max()
        if largest > tree.ROUNDING / tree.scale:
            scale = replace(scale, reach=rounded_up(float(largest)))
    counted = tree.shares(vertices, triangles, scale.edges(), to_world=to_world, progress=progress)
    return scale, scale.fold(counted)


def automatic_reach(ob):
    """Returns the distance at which the colours of `ob` end if that is automatic, or None while it is not known."""
    last = _known.get(ob.name)
    return last[1].reach if last is not None and last[0][-1] and last[1] is not None else None


def _finish(name, about, changed, counted, error):
    _known[name] = (about, *(counted if error is None else (None, None)))
    changed()


def forget(name=None):
    """Forgets the shares of one object, or of all objects if no name is given."""
    if name is None:
        _known.clear()
    else:
        _known.pop(name, None)
