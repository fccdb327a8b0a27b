# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a shown surface lies in which band of distances, for the legend: counted in a thread, now and then."""

import functools

import numpy as np

from . import field, work

_EVERY = 0.25  # seconds, at most so often while a mesh goes on changing
_EIGHTHS = np.arange(-4, 5) / 4  # of the range from -tolerance to the tolerance

_known = {}  # name of an object -> (what they are the shares of, shares)


def known(ob, surface, found, tolerance, changed):
    """The shares in the eighths, and beyond them at both ends; None while they are not known.

    Those of another mesh, place or tolerance say nothing: they are counted anew, and then changed() is called.
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
            placement,
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
    """Those of one object, or of all."""
    if name is None:
        _known.clear()
    else:
        _known.pop(name, None)


def fold(eighths, signed):
    """Shares in four bands from the lowest colour on, and outside."""
    eighths = np.asarray(eighths)
    within = eighths[1:-1]
    bands = within.reshape(4, 2).sum(1) if signed else within[4:] + within[3::-1]
    return [*bands, eighths[0] + eighths[-1]]
