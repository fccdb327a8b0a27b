# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads OFF files, which are texts."""

import re

import numpy as np

from ..shared.errors import Refused
from ..shared.files.content import Content, are_whole, common_size, numbers, positions, require_finite


def read(data):
    """Returns the Content of a file. Raises Refused with a message that does not name the file."""
    text = re.sub(rb"#[^\r\n]*", b"", data)
    lines = [line for line in text.splitlines() if line.strip()]
    kind = lines[0].split()[0] if lines else b""
    if not re.fullmatch(rb"(ST)?C?N?(OFF)", kind) or b"\0" in data:
        raise Refused("this is not an OFF file in text form: its first word is not OFF")
    rest = lines[0].split()[1:]
    lines = ([b" ".join(rest)] if rest else []) + lines[1:]
    counts = numbers(lines[0], np.int64) if lines else None
    if counts is None or len(counts) < 2 or counts.min() < 0:
        raise Refused("its second line is not the numbers of vertices and faces")
    count, faces = (int(number) for number in counts[:2])
    if len(lines) - 1 < count + faces:
        raise Refused(f"the file ends early: it has {len(lines) - 1:,} of the {count + faces:,} lines that it declares")
    if len(lines) - 1 > count + faces:
        raise Refused(f"it has {len(lines) - 1:,} lines of vertices and faces, but declares only {count + faces:,}")
    vertices, more = positions(lines[1 : count + 1])
    require_finite(vertices)
    corners, sizes, further = _faces(lines[count + 1 :])
    bad = np.flatnonzero((corners < 0) | (corners >= count))
    if len(bad):
        face = np.searchsorted(np.cumsum(sizes), bad[0], "right")
        raise Refused(f"face {face + 1} names vertex {corners[bad[0]]}, but there are only {count} vertices")
    others = ("what its lines hold besides positions and faces",) * (more or further)
    return Content(faces, vertices, corners, common_size(sizes), others=others)


def _faces(lines):
    """Returns (the vertices of one face after another, the number of corners of each, whether there is more on the lines)."""
    widths = np.array([len(line.split()) for line in lines], np.int64)
    words = numbers(b" ".join(lines), np.float64)
    begins = np.cumsum(widths) - widths
    if words is None or len(words) != widths.sum():  # A line holds something that is no number.
        words = np.full(widths.sum(), -1.0)
        for line, begin, width in zip(lines, begins, widths):
            if (one := numbers(line, np.float64)) is not None and len(one) == width:
                words[begin : begin + width] = one
    first = words[begins]
    is_bad = (first < 0) | (widths <= first) | ~are_whole(first)
    within, sizes = np.arange(len(words)) - np.repeat(begins, widths), np.where(is_bad, 0, first).astype(np.int64)
    is_corner = (within > 0) & (within <= np.repeat(sizes, widths))
    not_whole = np.flatnonzero(is_corner & ~are_whole(words))
    is_bad[np.searchsorted(begins, not_whole, "right") - 1] = True
    bad = np.flatnonzero(is_bad)
    if len(bad):
        line = lines[bad[0]].decode(errors="replace").strip()
        raise Refused(f"face {bad[0] + 1} is not a list of vertices ({line})")
    return words[is_corner].astype(np.int64), sizes, bool((widths > sizes + 1).any())
