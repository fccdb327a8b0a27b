# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds damage in a mesh file that Blender's readers do not report.

Blender's readers turn coordinates that are not finite into zeros, drop faces that name a missing vertex, and read a
truncated STL file as an empty one. check() finds such damage in the file itself. It also counts the faces of the file,
so that the faces that a reader drops (repeated faces and faces with a repeated corner) can be reported. check() builds
no mesh: plain_files.py or Blender does that.
"""

import re
import struct
import warnings
from dataclasses import dataclass

import numpy as np

from ..errors import Refused
from . import gltf_check

_LARGEST = float(np.finfo(np.float32).max)

# The name of a number type in PLY -> its name in NumPy, without byte order.
_PLY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}


@dataclass(frozen=True)
class Content:
    """What the check of a file has read.

    faces: the number of faces that the file declares
    polygons: (vertices, faces) of a PLY file that holds nothing but positions, normals and faces with equally many
        corners, as (n, 3) float64 and (m, k) integers; else None
    """

    faces: int
    polygons: tuple | None = None


def check(extension, data, folder):
    """Returns the Content of a file. `folder` holds the files that the content may name.

    Raises Refused with a message that says what is wrong and does not name the file.
    """
    if not data:
        raise Refused("the file is empty")
    if extension in (".gltf", ".glb"):
        return Content(gltf_check.check(data, folder))
    return {".obj": _check_obj, ".ply": _check_ply, ".stl": _check_stl}[extension](data)


def _require_finite(coordinates):
    """coordinates: (n, 3). A number beyond float32 counts as infinite, because Blender's readers store float32."""
    bad = np.flatnonzero(~(np.abs(coordinates) <= _LARGEST).all(1))
    if len(bad):
        shown = ", ".join(f"{value:g}" for value in coordinates[bad[0]])
        raise Refused(f"vertex {bad[0] + 1} is not finite ({shown})")


def _require_indices(lowest, highest, count, first):
    """lowest, highest: the smallest and largest vertex number of each face; vertices are numbered from `first`."""
    bad = np.flatnonzero((lowest < first) | (highest >= first + count))
    if len(bad):
        face = bad[0]
        index = lowest[face] if lowest[face] < first else highest[face]
        raise Refused(f"face {face + 1} names vertex {index}, but there are only {count} vertices")


def _numbers(text, dtype):
    """Returns the numbers in a text, or None when the text holds anything else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # NumPy warns where it stops before the end
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


# OBJ ----------------------------------------------------------------------------------------------------------------


def _check_obj(data):
    if b"\0" in data:
        raise Refused("this is not an OBJ file: it holds binary data")
    text = re.sub(rb"#[^\r\n]*", b"", data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" "))
    lines = re.findall(rb"^[ \t]*v[ \t]+([^\r\n]*)", text, re.MULTILINE)
    firsts = [tuple(line.split()[:3]) for line in lines]
    flat = _numbers(b" ".join(word for words in firsts for word in words), np.float64)
    if flat is None or len(flat) != 3 * len(lines):
        for number, words in enumerate(firsts, 1):
            values = _numbers(b" ".join(words), np.float64)
            if values is None or len(values) != 3:
                raise Refused(f"vertex {number} is not three numbers ({b' '.join(words).decode(errors='replace')})")
    _require_finite(flat.reshape(-1, 3))
    faces = re.findall(rb"^[ \t]*f[ \t]+([^\r\n]*)", text, re.MULTILINE)
    corners = [re.sub(rb"/\S*", b"", face) for face in faces]
    sizes = np.array([len(face.split()) for face in corners], np.int64)
    indices = _numbers(b" ".join(corners), np.int64)
    if indices is None or len(indices) != sizes.sum() or (sizes == 0).any():
        for number, face in enumerate(corners, 1):
            values = _numbers(face, np.int64)
            if values is None or not len(values):
                raise Refused(f"face {number} is not a list of vertices ({face.decode(errors='replace').strip()})")
    if len(indices) and indices.min() < 0:
        indices = _absolute(text, indices, sizes)
    if len(faces):
        starts = np.cumsum(sizes) - sizes
        lowest, highest = np.minimum.reduceat(indices, starts), np.maximum.reduceat(indices, starts)
        _require_indices(lowest, highest, len(lines), 1)
    return Content(len(faces))


def _absolute(text, indices, sizes):
    """Returns the indices counted from 1. A negative index counts back from the last vertex that stands above its face."""
    kinds = [kind == b"v" for kind in re.findall(rb"^[ \t]*([vf])[ \t]+", text, re.MULTILINE)]
    is_vertex = np.array(kinds)
    above = np.repeat(np.cumsum(is_vertex)[~is_vertex], sizes)
    return np.where(indices < 0, above + 1 + indices, indices)


# PLY ----------------------------------------------------------------------------------------------------------------

_POSITIONS_AND_NORMALS = {"x", "y", "z", "nx", "ny", "nz"}


def _check_ply(data):
    form, body, elements = _ply_header(data)
    order = ">" if form == "binary_big_endian" else "<"
    if form == "ascii":  # The text is turned into a binary body of doubles, so that one reader serves both forms.
        numbers = _numbers(body, np.float64)
        if numbers is None:
            raise Refused("the text after its PLY header holds something that is not a number")
        body = numbers.astype("<f8").tobytes()
        elements = [
            (name, count, [(field, counted and "f8", "f8") for field, counted, _ in properties])
            for name, count, properties in elements
        ]
    offset, vertices, polygons, faces = 0, None, None, 0
    for name, count, properties in elements:
        try:
            rows, offset = _ply_element(body, offset, count, properties, order)
        except (ValueError, struct.error):
            raise Refused(f"the file ends inside its list of {name} elements") from None
        if name == "vertex":
            if not {"x", "y", "z"} <= rows.keys():
                raise Refused("its vertices have no x, y, z")
            vertices = np.column_stack([rows[axis] for axis in "xyz"]).astype(np.float64)
            _require_finite(vertices)
        elif name == "face" and count:
            if vertices is None:
                raise Refused("its faces stand before its vertices: save it again with another program")
            indices = rows.get("vertex_indices", rows.get("vertex_index"))
            if indices is None or not isinstance(indices, tuple) and not indices.size:
                raise Refused("its faces name no vertices")
            lowest, highest = indices if isinstance(indices, tuple) else (indices.min(1), indices.max(1))
            _require_indices(lowest.astype(np.int64), highest.astype(np.int64), len(vertices), 0)
            faces = count
            polygons = None if isinstance(indices, tuple) else indices
    if vertices is None:
        raise Refused("it has no vertices")
    fields = {name: {field for field, _, _ in properties} for name, _, properties in elements}
    plain = (
        fields.keys() == {"vertex", "face"} and fields["vertex"] <= _POSITIONS_AND_NORMALS and len(fields["face"]) == 1
    )
    return Content(faces, polygons=(vertices, polygons) if plain and polygons is not None else None)


def _ply_header(data):
    """Returns (format, the bytes after the header, elements).

    elements: [(name, count, properties)]; properties: [(name, type of a list's length or None, type)].
    """
    end = re.search(rb"^end_header[ \t]*(\r\n|\n|\r)", data, re.MULTILINE) if data.startswith(b"ply") else None
    if end is None:
        raise Refused("this is not a PLY file: its header is missing or has no end")
    lines = [line.split() for line in data[: end.start()].decode("latin-1").splitlines()]
    form = next((words[1] for words in lines if words[:1] == ["format"] and len(words) > 1), "not given")
    if form not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise Refused(f"its PLY format is {form}, but only ascii and binary can be read")
    elements = []
    for words in lines:
        try:
            if words[:1] == ["element"]:
                elements.append((words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"]:
                elements[-1][2].append((words[4], _PLY_TYPES[words[2]], _PLY_TYPES[words[3]]))
            elif words[:1] == ["property"]:
                elements[-1][2].append((words[2], None, _PLY_TYPES[words[1]]))
        except (IndexError, KeyError, ValueError):
            raise Refused(f"its PLY header has a line that cannot be read: {' '.join(words)}") from None
    return form, data[end.end() :], elements


def _ply_element(body, offset, count, properties, order):
    """Returns ({property: column}, the offset of the next element).

    The column of a list property is an array (count, length) if all lists have the same length. Otherwise it is a pair
    of arrays: the smallest and the largest entry of each list.
    """
    if not 0 <= count <= len(body):
        raise ValueError
    row, start = [], offset
    for field, counted, kind in properties:
        length = 1
        if counted:
            row.append((field + " length", order + counted))
            length = int(np.frombuffer(body, order + counted, 1, start)[0]) if count else 0
            start += np.dtype(counted).itemsize
        row.append((field, order + kind, (length,)) if counted else (field, order + kind))
        start += length * np.dtype(kind).itemsize
    dtype = np.dtype(row)
    fits = dtype.itemsize * count <= len(body) - offset
    rows = np.frombuffer(body, dtype, count if fits else 0, offset)
    lists = [(field, counted) for field, counted, _ in properties if counted]
    if fits and all((rows[field + " length"] == dtype[field].shape[0]).all() for field, _ in lists):
        return {field: rows[field] for field, _, _ in properties}, offset + dtype.itemsize * count
    if not lists:
        raise ValueError
    return _ply_ragged(body, offset, count, properties, order)


def _ply_ragged(body, offset, count, properties, order):
    """Does the work of _ply_element row by row, for lists of different lengths. A row takes about 2 us."""
    extents = {field: (np.zeros(count), np.zeros(count)) for field, counted, _ in properties if counted}
    readers = [
        (field, counted and struct.Struct(order + np.dtype(counted).char), np.dtype(kind).char, np.dtype(kind).itemsize)
        for field, counted, kind in properties
    ]
    for i in range(count):
        for field, counted, kind, size in readers:
            length = 1
            if counted:
                length = int(counted.unpack_from(body, offset)[0])
                offset += counted.size
            values = struct.unpack_from(f"{order}{length}{kind}", body, offset)
            offset += length * size
            if counted and length:
                extents[field][0][i], extents[field][1][i] = min(values), max(values)
    return extents, offset


# STL ----------------------------------------------------------------------------------------------------------------

_STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def _check_stl(data):
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    if len(data) == 84 + count * _STL_TRIANGLE.itemsize:
        _require_finite(np.frombuffer(data, _STL_TRIANGLE, count, 84)["corners"].reshape(-1, 3))
        return Content(count)
    corners = re.findall(rb"^[ \t]*vertex[ \t]+([^\r\n]*)", data, re.MULTILINE)
    faces = len(re.findall(rb"^[ \t]*endfacet", data, re.MULTILINE))
    if not data.lstrip().startswith(b"solid") or not faces or len(corners) != 3 * faces:
        raise Refused(
            "this is not an STL file, or it is truncated: it is neither an STL text nor as long as its number of "
            "triangles requires"
        )
    coordinates = _numbers(b" ".join(corners), np.float64)
    if coordinates is None or len(coordinates) != 9 * faces:
        raise Refused("a vertex is not three numbers")
    _require_finite(coordinates.reshape(-1, 3))
    return Content(faces)
