# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and checks OBJ files."""

import codecs
import re
from dataclasses import replace

import numpy as np

from ..errors import Refused
from .content import Content, common_size, numbers, positions, require_finite, require_indices


def read(data, attributes=False):
    """Returns the Content of a file. attributes: whether to read UVs, normals, colours and the names of what is left out."""
    data = data.removeprefix(codecs.BOM_UTF8)  # Some editors begin a text with this byte order mark.
    if b"\0" in data:
        raise Refused("this is not an OBJ file: it holds binary data")
    text = re.sub(rb"#[^\r\n]*", b"", data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" "))
    lines = re.findall(rb"^[ \t]*v[ \t]+([^\r\n]*)", text, re.MULTILINE)
    vertices, _ = positions(lines)
    require_finite(vertices)
    faces = re.findall(rb"^[ \t]*f[ \t]+([^\r\n]*)", text, re.MULTILINE)
    corners = re.sub(rb"/\S*", b"", b"\n".join(faces))
    sizes = np.array([len(face.split()) for face in faces], np.int64)
    indices = numbers(corners, np.int64)
    if indices is None or len(indices) != sizes.sum() or (sizes == 0).any():
        for number, face in enumerate(corners.split(b"\n"), 1):
            values = numbers(face, np.int64)
            if values is None or not len(values):
                raise Refused(f"face {number} is not a list of vertices ({face.decode(errors='replace').strip()})")
    if len(indices) and indices.min() < 0:
        indices = _absolute(text, indices, sizes)
    if len(faces):
        starts = np.cumsum(sizes) - sizes
        lowest, highest = np.minimum.reduceat(indices, starts), np.maximum.reduceat(indices, starts)
        require_indices(lowest, highest, len(lines), 1)
    content = Content(len(faces), vertices, indices - 1, common_size(sizes))
    return replace(content, **_attributes(text, lines, faces, sizes)) if attributes else content


def _attributes(text, lines, faces, sizes):
    found, others = {}, []
    if lines and len(lines[0].split()) == 6 and all(len(line.split()) == 6 for line in lines):
        words = [word for line in lines for word in line.split()[3:]]
        colours = numbers(b" ".join(words), np.float64)
        if colours is not None and len(colours) == 3 * len(lines):
            found["columns"] = dict(zip(("red", "green", "blue"), colours.astype(np.float32).reshape(-1, 3).T))
    named = _indices_of_attributes(faces, int(np.sum(sizes)))
    for kind, width, name, place in ((rb"vt", 2, "uvs", 1), (rb"vn", 3, "normals", 2)):
        rows = re.findall(rb"^[ \t]*" + kind + rb"[ \t]+([^\r\n]*)", text, re.MULTILINE)
        if not rows:
            continue
        values = numbers(b" ".join(word for row in rows for word in row.split()[:width]), np.float64)
        at = None if named is None else named[:, place]
        if at is not None and (at < 0).any():
            at = np.where(
                at < 0, len(rows) + 1 + at, at
            )  # counted from the end, which is exact if all stand above the faces
        usable = values is not None and len(values) == width * len(rows) and at is not None
        if usable and ((at >= 1) & (at <= len(rows))).all():
            found[name] = values.astype(np.float32).reshape(-1, width), at - 1
        else:
            others.append(f"its {'UVs' if name == 'uvs' else name}, which not every corner has")
    for key, words in ((rb"usemtl", "materials"), (rb"l", "lines")):
        if re.search(rb"^[ \t]*" + key + rb"[ \t]", text, re.MULTILINE):
            others.append(words)
    groups = {line.strip() for line in re.findall(rb"^[ \t]*[og][ \t]+([^\r\n]*)", text, re.MULTILINE)}
    if len(groups) > 1:
        others.append(f"the division into {len(groups):,} objects or groups")
    return found | {"others": tuple(others)}


def _indices_of_attributes(faces, corners):
    """Returns (corners, 3): the numbers of vertex, UV and normal at each corner, 0 where there is none. None: not readable."""
    text = b" ".join(faces)
    if b"/" not in text:
        return None
    slashes = text.count(b"/")
    if b"//" in text:
        text = text.replace(b"//", b"/0/")
    per_corner = slashes // corners
    found = numbers(text.replace(b"/", b" "), np.int64) if slashes == per_corner * corners else None
    if found is None or len(found) != (per_corner + 1) * corners or not 1 <= per_corner <= 2:
        return None
    return np.pad(found.reshape(corners, per_corner + 1), ((0, 0), (0, 2 - per_corner)))


def _absolute(text, indices, sizes):
    """Returns the indices counted from 1. A negative index counts back from the last vertex that stands above its face."""
    kinds = [kind == b"v" for kind in re.findall(rb"^[ \t]*([vf])[ \t]+", text, re.MULTILINE)]
    is_vertex = np.array(kinds)
    above = np.repeat(np.cumsum(is_vertex)[~is_vertex], sizes)
    return np.where(indices < 0, above + 1 + indices, indices)
