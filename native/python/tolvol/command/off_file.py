# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads OFF files, which are texts."""

import re

import numpy as np

from ..shared.errors import Refused
from ..shared.files.content import Content, numbers, require_finite


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
    rows = [line.split()[:3] for line in lines[1 : count + 1]]
    values = numbers(b" ".join(word for row in rows for word in row), np.float64)
    if values is None or len(values) != 3 * count:
        bad = next(
            i for i, row in enumerate(rows) if (one := numbers(b" ".join(row), np.float64)) is None or len(one) != 3
        )
        raise Refused(f"vertex {bad + 1} is not three numbers ({b' '.join(rows[bad]).decode(errors='replace')})")
    vertices = values.reshape(-1, 3)
    require_finite(vertices)
    sizes, corners, more = [], [], False
    for number, line in enumerate(lines[count + 1 :], 1):
        words = numbers(line, np.float64)
        size = -1 if words is None or not len(words) else int(words[0])
        if size < 0 or len(words) <= size:
            raise Refused(f"face {number} is not a list of vertices ({line.decode(errors='replace').strip()})")
        sizes.append(size)
        corners.append(words[1 : size + 1].astype(np.int64))
        more |= len(words) > size + 1
    sizes, corners = np.array(sizes, np.int64), np.concatenate([np.zeros(0, np.int64), *corners])
    bad = np.flatnonzero((corners < 0) | (corners >= count))
    if len(bad):
        face = np.searchsorted(np.cumsum(sizes), bad[0], "right")
        raise Refused(f"face {face + 1} names vertex {corners[bad[0]]}, but there are only {count} vertices")
    same = int(sizes[0]) if len(sizes) and (sizes == sizes[0]).all() else sizes
    more |= any(len(line.split()) > 3 for line in lines[1 : count + 1])
    return Content(faces, vertices, corners, same, others=("what its lines hold besides positions and faces",) * more)
