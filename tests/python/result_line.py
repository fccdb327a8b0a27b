# SPDX-License-Identifier: GPL-3.0-or-later
"""The line with which decimate.py and tolvol decimate tell a result."""

import re

LINE = re.compile(
    r"([\d,]+) -> ([\d,]+) triangles(?: \((.*)\))?, tolerance ([\d.e-]+) % = ([\d.e-]+), result within ([\d.e+-]+) %, "
    r"reference within ([\d.e+-]+) %(?:, normals within [\d.]+\N{DEGREE SIGN})? \(proved\), [\d.]+ s"
)


def succeeded(done):
    """Returns the match of the result line. done: (exit code, stdout, stderr) of a command, which has to have succeeded."""
    code, out, err = done
    assert (code, err) == (0, ""), (out, err)
    match = LINE.fullmatch(out.splitlines()[-1])
    assert match, out
    return match
