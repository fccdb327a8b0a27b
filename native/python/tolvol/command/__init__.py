# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `tolvol`: what it adds to tolvol.shared.command, which the scripts for Blender use too."""

from .main import run

__all__ = ["run"]
