# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the triangles of a binary PLY or STL file a block at a time, without the whole file in memory."""

import os
from pathlib import Path

import numpy as np

from ..shared.errors import Refused
from ..shared.files import ply_file, stl_file
from ..shared.files.content import require_finite, require_indices
from .cells import lowest_and_highest

EXTENSIONS = (".ply", ".stl")

_HEADER = 1 << 20  # bytes that hold the header of any PLY file
_BLOCK = 1 << 19  # triangles that are read at once


class _Blocks:
    def __init__(self, mesh):
        self._mesh = mesh

    def __len__(self):
        return -(-self._mesh.count // _BLOCK)

    def __iter__(self):
        for first in range(0, self._mesh.count, _BLOCK):
            yield self._mesh.corners(first, min(first + _BLOCK, self._mesh.count))


class MappedMesh:
    """The triangles of a file. Raises Refused, which names the file, for one that is damaged.

    count: the number of triangles; dtype: float32 or float64, as the file stores its coordinates.
    """

    def __init__(self, path):
        self.path = Path(path)
        try:
            with open(path, "rb") as file:
                head = file.read(_HEADER)
            self._stamp = self._seen()
            self.size = self._stamp[0]
        except OSError as error:
            raise Refused(f"{path}: {error.strerror}") from None
        try:
            if not head:
                raise Refused("the file is empty")
            (self._map_stl if self.path.suffix.lower() == ".stl" else self._map_ply)(head)
            if not self.count:
                raise Refused("the file has no faces")
        except Refused as error:
            raise Refused(f"{path}: {error}") from None

    def _seen(self):
        found = os.stat(self.path)
        return found.st_size, found.st_mtime_ns, found.st_ino

    def require_unchanged(self):
        """Raises Refused if the file is not the one that it was at first."""
        try:
            if self._seen() == self._stamp:
                return
        except OSError:
            pass
        raise Refused(f"{self.path} was changed while it was read: start again")

    def _map_stl(self, head):
        self.count = int.from_bytes(head[80:84], "little")
        if len(head) < 84 or self.size != 84 + self.count * stl_file.TRIANGLE.itemsize:
            raise Refused("this is no binary STL file, or it is truncated: only binary files can be read in parts")
        self._vertices, self._offset, self._row, self.dtype = None, 84, stl_file.TRIANGLE, np.dtype(np.float32)

    def _map_ply(self, head):
        form, elements, offset = ply_file.header(head)
        if form == "ascii":
            raise Refused("this PLY file is a text: only binary files can be read in parts; save it as a binary one")
        order = ply_file.byte_order(form)
        self._vertices, self.count = None, 0
        for name, count, properties in elements:
            lists = [field for field, counted, _ in properties if counted]
            is_face = name == "face"
            if lists and not (is_face and len(lists) == 1):
                raise Refused(f"its {name} elements hold lists that cannot be read in parts")
            row = ply_file.row_type(properties, dict.fromkeys(lists, 3), order)
            if offset + count * row.itemsize > self.size:
                more = ", or has faces that are no triangles" if is_face else ""
                raise Refused(f"the file ends inside its list of {name} elements{more}")
            if name == "vertex":
                if not {"x", "y", "z"} <= set(row.names):
                    raise Refused("its vertices have no x, y, z")
                self._vertices = np.memmap(self.path, row, "r", offset, (count,))
                self.dtype = np.dtype(ply_file.position_type(properties))
            elif is_face:
                if not lists or lists[0] not in ("vertex_indices", "vertex_index"):
                    raise Refused("its faces name no vertices")
                self._offset, self._row, self._list, self.count = offset, row, lists[0], count
            offset += count * row.itemsize
        if self._vertices is None:
            raise Refused("it has no vertices")
        if self.count:
            # Faces of more corners leave bytes behind, too, so they are looked for first.
            self._require_triangles(np.fromfile(self.path, self._row, 1, offset=self._offset), 0)
            with open(self.path, "rb") as file:
                file.seek(offset)
                rest = file.read(_HEADER)
            ply_file.require_end(rest, self.size - offset - len(rest))

    def blocks(self):
        """Returns an iterable with a length: the corners of all triangles a block at a time, (k, 3, 3) each."""
        return _Blocks(self)

    def corners(self, first, last):
        """Returns the corners of the triangles from `first` to before `last`, (k, 3, 3) of dtype."""
        rows = np.fromfile(self.path, self._row, last - first, offset=self._offset + first * self._row.itemsize)
        if len(rows) != last - first:
            self.require_unchanged()
            raise Refused(f"{self.path}: the file could not be read to its end; check the disk")
        try:
            return self._soup(rows, first) if self._vertices is None else self._indexed(rows, first)
        except Refused as error:
            raise Refused(f"{self.path}: {error}") from None

    @staticmethod
    def _soup(rows, first):
        corners = np.ascontiguousarray(rows["corners"])
        require_finite(corners.reshape(-1, 3), lambda row: 3 * first + row + 1)
        return corners

    def _require_triangles(self, rows, first):
        sizes = rows[self._list + " length"]
        if (sizes != 3).any():
            bad = int(np.argmax(sizes != 3))
            raise Refused(
                f"face {first + bad + 1} has {sizes[bad]} vertices: only files of triangles can be read in parts; cut the "
                "faces into triangles with another program"
            )

    def _indexed(self, rows, first):
        self._require_triangles(rows, first)
        index = rows[self._list].astype(np.int64)
        require_indices(*lowest_and_highest(index), len(self._vertices), 0, first)
        corners = np.empty((len(index), 3, 3), self.dtype)
        for axis, name in enumerate("xyz"):
            corners[:, :, axis] = self._vertices[name][index]
        require_finite(corners.reshape(-1, 3), lambda row: int(index.ravel()[row]) + 1)
        return corners
