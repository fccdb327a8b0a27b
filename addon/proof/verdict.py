# SPDX-License-Identifier: GPL-3.0-or-later
"""Says of an object whether its mesh is within the tolerance, with the words and classes of shared/proof/verdict.py."""

from ..reference import measurements, snapshots, tolerances
from ..shared.proof.verdict import (
    BEYOND,
    FAIL,
    NOT_CHECKED,
    PASS,
    UNDECIDED,
    WITHIN,
    Interval,
    Verdict,
    negligible,
    together,
)

__all__ = [
    "BEYOND",
    "FAIL",
    "NOT_CHECKED",
    "PASS",
    "UNDECIDED",
    "WITHIN",
    "Interval",
    "Verdict",
    "negligible",
    "of",
    "together",
    "word",
]

# A distance is this many times larger or smaller than the tolerance only if the file is damaged.
_MOST = 1e300


def _comparable(distance, tolerance):
    return snapshots.sound(tolerance) and (distance == 0 or 1 / _MOST < distance / tolerance < _MOST)


def of(ob):
    """Returns the Verdict of the last measurement of `ob` for the present tolerance, or None.

    It is None without a measurement, and if a number in the file is damaged.
    """
    measured = measurements.measurement_of(ob)
    if measured is None:
        return None
    # A percentage is taken of the size that was measured: rotating the object changes its size by rounding.
    tolerance = tolerances.tolerance_length(ob.tolvol, measured.size)
    if not all(_comparable(distance, tolerance) for distance in (measured.forward, measured.backward)):
        return None
    return Verdict(
        tolerance,
        Interval(measured.forward_lower, measured.forward),
        Interval(measured.backward_lower, measured.backward),
        measured.share_outside if tolerance == measured.tolerance else 0.0,
        ob.tolvol.keep == "BOTH",
    )


def word(ob):
    """Returns the word for the present state of `ob`."""
    found = of(ob)
    return found.word if found else NOT_CHECKED
