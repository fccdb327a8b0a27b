# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the warnings of the last operation on an object until the next one, for the panels."""

import json

# The cause for which the vertices that have to stay can be found in the mesh.
ISLANDS = "UV islands meet"
# The cause of vertices that the user protected: it is no surprise.
ASKED_FOR = "asked for"


def keep(ob, operation, warnings, staying=None):
    """Stores the warnings of an operation on `ob` in place of those of the operation before.

    operation: the name of the operator. staying: {cause: number of vertices that had to stay}.
    """
    ob.tolvol.warnings = json.dumps({"operation": operation, "warnings": warnings, "staying": staying or {}})


def of(ob, operation):
    """Returns (warnings, staying) if `operation` was the last one, else empty ones. A damaged file has none."""
    try:
        kept = json.loads(ob.tolvol.warnings or "{}")
        if kept.get("operation") != operation:
            return [], {}
        warnings = [text for text in kept["warnings"] if isinstance(text, str)]
        return warnings, {str(cause): int(count) for cause, count in kept["staying"].items()}
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return [], {}
