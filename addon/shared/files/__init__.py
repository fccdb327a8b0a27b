# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds damage in mesh files, reads those that NumPy can read, and replaces files as a whole."""
