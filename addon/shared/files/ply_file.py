# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and checks PLY files: by NumPy where all lists of an element have the same length, else by tolvol.list_rows()."""

import re

import numpy as np

from .. import package
from ..errors import Refused
from .content import Content, are_whole, numbers, require_finite, require_indices

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

_BLANK = b" \t\r\n\0"  # Some programs end a file with an empty line, or fill it up.


def read(data):
    """Returns the Content of a file."""
    form, elements, start = header(data)
    body = memoryview(data)[start:]
    wide = any(name == "vertex" and ("x", None, "f8") in properties for name, _, properties in elements)
    order = byte_order(form)
    if form == "ascii":  # The text is turned into a binary body of doubles, so that one reader serves both forms.
        found = numbers(data[start:], np.float64)
        if found is None:
            raise Refused("the text after its PLY header holds something that is not a number")
        body = found.astype("<f8").tobytes()
        elements = [
            (name, count, [(field, counted and "f8", "f8") for field, counted, _ in properties])
            for name, count, properties in elements
        ]
    offset, vertices, columns, others = 0, None, {}, []
    corners, sizes, faces = np.zeros(0, np.int32), 3, 0
    for name, count, properties in elements:
        try:
            rows, offset = _ply_element(body, offset, count, properties, order)
        # int() raises OverflowError if a list has an infinite length. InvalidInput is a ValueError.
        except (ValueError, OverflowError):
            raise Refused(f"the file ends inside its list of {name} elements") from None
        if name == "vertex":
            if not all(_is_column(rows.get(axis)) for axis in "xyz"):
                raise Refused("its vertices have no x, y, z")
            vertices = _positions(rows, np.float64 if wide else np.float32)
            require_finite(vertices)
            columns = {field: values for field, values in rows.items() if field not in "xyz" and _is_column(values)}
        elif name == "face" and count:
            if vertices is None:
                raise Refused("its faces stand before its vertices: save it again with another program")
            corners, sizes = _corners(rows.get("vertex_indices", rows.get("vertex_index")))
            _require_vertices(corners, sizes, len(vertices))
            faces = count
            if len(rows) > 1:
                others.append("what each face has besides its vertices")
        elif count:
            others.append(f"{count:,} elements {name}")
    if vertices is None:
        raise Refused("it has no vertices")
    require_end(bytes(body[offset:]))
    return Content(faces, vertices, corners, sizes, columns, others=tuple(others))


def require_end(rest, more=0):
    """Raises Refused unless nothing but blanks is left after all that the header declares: the bytes `rest`, and `more`."""
    if left := len(rest.strip(_BLANK)) + more:
        raise Refused(
            f"{left:,} bytes are left after all that its header declares: the numbers in its header are wrong"
        )


def _positions(rows, dtype):
    found = np.empty((len(rows["x"]), 3), dtype)
    with np.errstate(over="ignore"):  # A number that float32 cannot hold becomes infinite, and is found then.
        for axis, name in enumerate("xyz"):
            found[:, axis] = rows[name]
    return found


def _is_column(values):
    return isinstance(values, np.ndarray) and values.ndim == 1


def _corners(indices):
    """Returns the vertex at each corner, one polygon after another, and the numbers of corners: one if they are equal."""
    if indices is None or not isinstance(indices, tuple) and (indices.ndim < 2 or not indices.size):
        raise Refused("its faces name no vertices")
    if isinstance(indices, tuple) and not indices[1].all():
        # Where the header declares a vertex too many, the first face begins late and looks like this.
        raise Refused(
            f"face {np.argmin(indices[1] > 0) + 1} has no vertices: the file or the numbers in its header are damaged"
        )
    corners, sizes = indices if isinstance(indices, tuple) else (indices.ravel(), indices.shape[1])
    if corners.dtype.kind == "f":  # from a text
        if not are_whole(corners).all():
            raise Refused("its faces name vertices by numbers that are not whole")
        corners = corners.astype(np.int64)
    return np.ascontiguousarray(corners, corners.dtype.newbyteorder("=")), sizes


def _require_vertices(corners, sizes, count):
    """Requires that every corner is one of `count` vertices."""
    if not len(corners) or 0 <= corners.min() and corners.max() < count:
        return
    sizes = np.broadcast_to(sizes, len(corners) // sizes) if isinstance(sizes, int) else sizes
    starts = np.cumsum(sizes) - sizes
    require_indices(np.minimum.reduceat(corners, starts), np.maximum.reduceat(corners, starts), count, 0)


def header(data):
    """Returns (format, elements, the offset of what follows the header), for a file that begins with `data`.

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
    return form, elements, end.end()


def byte_order(form):
    return ">" if form == "binary_big_endian" else "<"


def row_type(properties, lengths, order):
    """Returns the type of the rows of an element whose lists have these lengths: {property: length}."""
    row = []
    for field, counted, kind in properties:
        if counted:
            row += [(field + " length", order + counted), (field, order + kind, (lengths[field],))]
        else:
            row.append((field, order + kind))
    return np.dtype(row)


def _ply_element(body, offset, count, properties, order):
    """Returns ({property: column}, the offset of the next element).

    The column of a list property is an array (count, length) if all lists have the same length. Otherwise it is a pair
    of arrays: the entries of one list after another, and the length of each list.
    """
    if not 0 <= count <= len(body):
        raise ValueError
    lengths, start = {}, offset
    for field, counted, kind in properties:
        if counted:
            lengths[field] = int(np.frombuffer(body, order + counted, 1, start)[0]) if count else 0
            start += np.dtype(counted).itemsize
        start += lengths.get(field, 1) * np.dtype(kind).itemsize
    dtype = row_type(properties, lengths, order)
    fits = dtype.itemsize * count <= len(body) - offset
    rows = np.frombuffer(body, dtype, count if fits else 0, offset)
    lists = [(field, counted) for field, counted, _ in properties if counted]
    if fits and all((rows[field + " length"] == dtype[field].shape[0]).all() for field, _ in lists):
        return {field: rows[field] for field, _, _ in properties}, offset + dtype.itemsize * count
    if not lists:
        raise ValueError
    types = [(counted and order + counted, order + kind) for _, counted, kind in properties]
    columns, end = package.module.list_rows(body, count, types, offset=offset)
    return {field: column for (field, _, _), column in zip(properties, columns)}, end
