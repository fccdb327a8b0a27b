# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts for the legend which share of a shown surface lies in each band of distances, in a thread."""

import functools

import numpy as np

from . import field, work

_EVERY = 0.25  # seconds between two counts while a mesh goes on changing
_EIGHTHS = np.arange(-4, 5) / 4  # the ends of eight bands from -tolerance to tolerance, in tolerances

# Name of an object -> ((state of the surface, field, tolerance, placement) that the shares are of, shares).
_known = {}


def known(ob, surface, found, tolerance, changed):
    """Returns the shares in the eight bands and beyond them at both ends, or None while they are not known.

    If mesh, placement or tolerance have changed, the shares are counted anew, and then changed() is called.
    """
    placement = np.linalg.inv(found.to_frame) @ field.vertex_to_frame(found, ob)
    about = surface.changes, id(found), tolerance, placement.tobytes()
    name = ob.name
    last = _known.get(name)
    if last is not None and last[0] == about:
        return last[1]
    if surface.triangles is not None and len(surface.triangles):
        count = functools.partial(
            found.tree.shares,
            surface.vertices,
            surface.triangles,
            tolerance * _EIGHTHS,
            to_world=placement,
        )
        work.later(
            ("shares", name),
            _EVERY if last else 0,
            lambda: lambda _progress: count(),
            functools.partial(_finish, name, about, changed),
        )
    return None


def _finish(name, about, changed, shares, error):
    _known[name] = about, shares if error is None else None
    changed()


def forget(name=None):
    """Forgets the shares of one object, or of all objects if no name is given."""
    if name is None:
        _known.clear()
    else:
        _known.pop(name, None)


def fold(eighths, signed):
    """Returns five shares: in the four bands from the lowest colour on, and beyond the tolerance."""
    eighths = np.asarray(eighths)
    within = eighths[1:-1]
    bands = within.reshape(4, 2).sum(1) if signed else within[4:] + within[3::-1]
    return [*bands, eighths[0] + eighths[-1]]
