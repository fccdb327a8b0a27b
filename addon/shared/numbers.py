# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes numbers as text."""

import numpy as np

NO_BREAK = "\u00a0"  # between a number and its unit


def three_digits(value):
    """Returns a number with three digits, and one from 1000 on with all digits before the point."""
    return f"{value:,.0f}" if value >= 999.5 else f"{value:#.3g}".rstrip(".")


def shortest(value):
    """Returns the shortest decimal number that rounds to the float32 `value`: the number that the user typed."""
    return float(str(np.float32(value)))
