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

_NEED_FLOAT64 = {"f8", "i4", "u4"}  # the types of numbers that float32 cannot hold

_BLANK = b" \t\r\n\0"  # Some programs end a file with an empty line, or fill it up.


def read(data):
    """Returns the Content of a file."""
    form, elements, start = header(data)
    body = memoryview(data)[start:]
    order, declared = byte_order(form), {name: properties for name, _, properties in elements}
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
        except ValueError:  # InvalidInput is one.
            lengths = any(counted for _, counted, _ in properties)
            damaged = ", or the length of a list there is negative or not whole" if lengths else ""
            raise Refused(f"the file ends inside its list of {name} elements{damaged}") from None
        if name == "vertex":
            if not all(_is_column(rows.get(axis)) for axis in "xyz"):
                raise Refused("its vertices have no x, y, z")
            vertices = _positions(rows, position_type(declared[name]))
            require_finite(vertices)
            columns = _columns(rows, declared[name])
            if lists := [field for field, counted, _ in properties if counted]:
                others.append(f"the lists {', '.join(lists)} of its vertices")
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


def position_type(properties):
    """Returns the type that holds the positions of vertices with these properties exactly: np.float32 or np.float64."""
    kinds = {kind for field, _, kind in properties if field in ("x", "y", "z")}
    return np.float64 if kinds & _NEED_FLOAT64 else np.float32


def _columns(rows, declared):
    """Returns the numbers of the vertices besides their positions, {property: (n,)}, in the types that the header declares."""
    found = {}
    for field, _, kind in declared:
        values = rows[field]
        if field in ("x", "y", "z") or not _is_column(values):
            continue
        if values.dtype.kind == "f" and kind[0] != "f":  # of a text
            least, most = np.iinfo(kind).min, np.iinfo(kind).max
            kind = kind if (are_whole(values) & (values >= least) & (values <= most)).all() else "f8"
        found[field] = values.astype(kind) if values.dtype.itemsize == 8 else values
    return found


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
    first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    # Where lines end with \r alone, a \n behind the header would be data.
    last = first and re.search(rb"[\r\n]end_header[ \t]*" + (rb"\r" if first[1] == b"\r" else rb"(\r\n|\n|\r)"), data)
    if not last:
        raise Refused("this is not a PLY file: its header is missing or has no end")
    lines = [line.decode("latin-1").split() for line in re.split(rb"[\r\n]+", data[: last.start()])]
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
    _require_sound(elements)
    return form, elements, last.end()


def _require_sound(elements):
    for name, count, properties in elements:
        if count < 0:
            raise Refused(f"its PLY header declares {count} elements {name}")
        _require_different([field for field, _, _ in properties], f"properties of its {name} elements are")
    _require_different([name for name, _, _ in elements], "of its elements are")


def _require_different(names, what):
    if twice := [name for name in names if names.count(name) > 1]:
        raise Refused(f"its PLY header is damaged: several {what} named {twice[0]}")


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
    if count > len(body):
        raise ValueError
    lengths, start = {}, offset
    for field, counted, kind in properties:
        if counted:
            length = np.frombuffer(body, order + counted, 1, start)[0] if count else 0
            if not 0 <= length <= len(body):  # This also refuses NaN.
                raise ValueError
            lengths[field] = int(length)
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
