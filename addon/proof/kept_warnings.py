# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the warnings of the last operation on an object until the next one, for the panels."""

import json

from .last_run import DAMAGED

# The cause of vertices that the user protected: it is no surprise.
ASKED_FOR = "asked for"


def keep(ob, warnings, staying=None):
    """Stores the warnings of an operation on `ob` in place of those of the operation before.

    staying: {cause: number of vertices that had to stay}.
    """
    ob.tolvol.warnings = json.dumps({"warnings": warnings, "staying": staying or {}})


def of(ob):
    """Returns (warnings, staying) of the last operation. A damaged file has none."""
    try:
        kept = json.loads(ob.tolvol.warnings or '{"warnings": [], "staying": {}}')
        warnings = [text for text in kept["warnings"] if isinstance(text, str)]
        return warnings, {str(cause): int(count) for cause, count in kept["staying"].items()}
    except DAMAGED:
        return [], {}
