# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on shares with the command `tolvol`: nothing here knows Blender.

The package that pip installs holds this folder as `tolvol.shared`.
"""
