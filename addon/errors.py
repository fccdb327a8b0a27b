# SPDX-License-Identifier: GPL-3.0-or-later
"""What an operator may end with that is no bug. The message names the object and, where there is one, the remedy."""

# How the message of NotProved begins, wherever it is read again.
NOT_PROVED = "Not proved"


class Refused(Exception):
    """The operation cannot be done as asked. Nothing was changed."""


class NotProved(Refused):
    """The result could not be certified within the tolerance. Nothing was changed."""

    def __init__(self, intervals):
        super().__init__(f"{NOT_PROVED}: {intervals}")


class NotWritten(Refused):
    """A file could not be written where it was wanted: the system refused, or there is no room. No other file was changed."""
