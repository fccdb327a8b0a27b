# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives a mesh the look of its reference: by the reference's normals, or by a normal map that is baked from it."""
