# SPDX-License-Identifier: GPL-3.0-or-later
"""What is read from Blender's meshes and written to them."""
