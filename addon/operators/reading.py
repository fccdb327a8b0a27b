# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what an operator compares: the mesh of an object and its reference."""

from ..job import breathe
from ..reference import snapshots


def mesh_and_reference(ob):
    """A generator for an operator's steps(): returns two Surfaces, which belong to one place of the object although it may be
    moved between the two parts."""
    surface = snapshots.surface_of(ob)
    yield breathe
    reference = snapshots.reference_of(ob, surface)
    yield breathe
    return surface, reference
