# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command `tolvol` and the scripts for Blender have in common: options, result line, reports and exit codes."""
