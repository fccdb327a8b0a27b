# SPDX-License-Identifier: GPL-3.0-or-later
"""What is certified and measured of a mesh, and how it is said."""
