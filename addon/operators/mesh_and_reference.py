# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what an operator compares: the mesh of an object and its reference."""

from ..job import breathe
from ..reference import snapshots


def mesh_and_reference(ob):
    """A generator for an operator's steps(): returns the mesh and the reference as Surfaces. Both are for the place that the
    object had when the mesh was read, even if the object is moved before the reference is read."""
    surface = snapshots.surface_of(ob)
    yield breathe
    reference = snapshots.reference_of(ob, surface)
    yield breathe
    return surface, reference
