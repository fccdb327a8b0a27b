# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and checks STL files."""

import re
import struct

import numpy as np

from ..errors import Refused
from .content import Content, numbers, require_finite

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read(data):
    """Returns the Content of a file: a soup, in which each triangle has three vertices of its own."""
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    if len(data) == 84 + count * TRIANGLE.itemsize:
        return _soup(np.ascontiguousarray(np.frombuffer(data, TRIANGLE, count, 84)["corners"]).reshape(-1, 3))
    corners = re.findall(rb"^[ \t]*vertex[ \t]+([^\r\n]*)", data, re.MULTILINE)
    faces = len(re.findall(rb"^[ \t]*endfacet", data, re.MULTILINE))
    if not data.lstrip().startswith(b"solid") or not faces or len(corners) != 3 * faces:
        raise Refused(
            "this is not an STL file, or it is truncated: it is neither an STL text nor as long as its number of "
            "triangles requires"
        )
    coordinates = numbers(b" ".join(corners), np.float64)
    if coordinates is None or len(coordinates) != 9 * faces:
        raise Refused("a vertex is not three numbers")
    return _soup(coordinates.reshape(-1, 3))


def _soup(coordinates):
    require_finite(coordinates)
    return Content(len(coordinates) // 3, coordinates, np.arange(len(coordinates), dtype=np.int32), 3)
