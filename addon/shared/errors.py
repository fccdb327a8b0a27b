# SPDX-License-Identifier: GPL-3.0-or-later
"""Failures that an operator reports to the user; any other exception is a bug.

Each message names the object and, where there is one, the remedy.
"""

# Every message of NotProved begins with these words: blender_scripts/blender_files.py recognises the message by them.
NOT_PROVED = "Not proved"


class Refused(Exception):
    """The operation cannot be done as asked. The operator has changed nothing."""


class NotProved(Refused):
    """The result could not be proved to be within the tolerance. The operator has changed nothing."""

    def __init__(self, intervals):
        super().__init__(f"{NOT_PROVED}: {intervals}")


class WouldCross(Refused):
    """More pairs of faces would cross than before. The operator has changed nothing."""


class NotWritten(Refused):
    """A file could not be written: the system refused, or the disk is full. No other file was changed."""
