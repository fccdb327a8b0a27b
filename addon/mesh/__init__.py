# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads Blender's meshes as arrays and writes results to them."""
