# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the tolerance volume of an object's reference among those that are in memory."""

from ..shared import volumes
from . import snapshots, tolerances


def volume_of(ob):
    """Returns the tolerance volume of the stored reference if it is in memory. It is quick enough to be called in drawing."""
    tolerance = tolerances.tolerance_length(ob.tolvol, snapshots.snapshot_size(ob))
    return volumes.kept(ob.tolvol.snapshot_fingerprint, snapshots.reference_matrix(ob), tolerance)
