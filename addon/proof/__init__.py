# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps with an object what was proved and measured of it, and finds the places that leave the tolerance."""
