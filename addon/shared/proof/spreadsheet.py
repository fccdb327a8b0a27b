# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes text safe for the cells of a spreadsheet."""

import re

# A spreadsheet takes text that begins with one of these for a formula; the last four are the full-width forms.
_FORMULA = "=+-@\uff1d\uff0b\uff0d\uff20"


def harmless(cell):
    """Makes text safe for a spreadsheet: names come from other people's files, and as a formula a name could run a
    program where the table is opened."""
    if not isinstance(cell, str):
        return cell
    line = re.sub(r"[\t\r\n]", " ", cell)  # Some readers of CSV begin a new row at a lone \r.
    return f"'{line}" if line.lstrip()[:1] in tuple(_FORMULA) else line
