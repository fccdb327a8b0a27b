# SPDX-License-Identifier: GPL-3.0-or-later
"""Chunks: files of parts of a mesh, in the scratch folder."""

import errno
import os
import uuid
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ..shared import package
from ..shared.errors import NotWritten, Refused
from .cells import Box

_AT_ONCE = 1 << 16  # triangles whose corners are looked at together
_COUNTS = np.dtype("<i8")  # A block begins with the number of its vertices and that of its triangles.
_INDEX = np.dtype("<i4")
_READERS = 4  # threads that read: each has a chunk in memory, for which the plan has no room.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True)
class Chunk:
    """A file of blocks. Each has two counts, its vertices, and its triangles by the numbers of their corners among these (int32).

    dtype: of the vertices, float32 or float64; count: the number of triangles. Without triangles there is no block.
    """

    path: str
    dtype: str
    count: int
    bounds: Box
    checksum: int

    @classmethod
    def read_from(cls, record):
        return cls(**(record | {"bounds": Box(*map(tuple, record["bounds"].values()))}))

    def record(self):
        return asdict(self)

    def mesh(self):
        """Returns (vertices, triangles), in which a position may have several vertices.

        Raises Refused where the file is not as it was written.
        """
        try:
            data = Path(self.path).read_bytes()
        except OSError as error:
            raise Refused(f"{self.path}: {error.strerror}") from None
        if zlib.crc32(data) != self.checksum:
            raise Refused(f"{self.path} is damaged: remove the scratch folder and start again")
        parts, at = [], 0

        def take(dtype, count):
            nonlocal at
            found = np.frombuffer(data, dtype, count, at)
            at += found.nbytes
            return found

        while at < len(data):
            vertices, triangles = take(_COUNTS, 2)
            parts.append((take(self.dtype, 3 * vertices).reshape(-1, 3), take(_INDEX, 3 * triangles).reshape(-1, 3)))
        return joined(parts)


class Writer:
    """Writes a chunk block by block. Nothing is where the chunk will be before end()."""

    def __init__(self, path):
        # A task may be done twice at once, when its worker has only lost the connection.
        self._path, self._partial = str(path), f"{path}.{uuid.uuid4().hex}.partial"
        self._count, self._bounds, self._checksum, self._dtype = 0, bounds_of(np.empty((0, 3))), 0, "<f4"
        self._write(b"", "wb")

    def _write(self, data, mode="ab"):
        # The file is closed between two blocks, because there may be more chunks than files that can be open at once.
        try:
            with open(self._partial, mode) as file:
                file.write(data)
        except OSError as error:
            raise failed(error, self._path) from None

    def add(self, corners):
        """Adds a block of triangles, (k, 3, 3), all of one dtype; adds nothing for none."""
        if not len(corners):
            return
        vertices, triangles = mesh_of(corners.astype(corners.dtype.newbyteorder("<"), copy=False))
        counts = np.array([len(vertices), len(triangles)], _COUNTS)
        data = b"".join((counts.tobytes(), vertices.tobytes(), triangles.astype(_INDEX, copy=False).tobytes()))
        self._write(data)
        self._count += len(triangles)
        self._bounds = self._bounds.joined(bounds_of(vertices))
        self._checksum = zlib.crc32(data, self._checksum)
        self._dtype = vertices.dtype.str

    def end(self):
        """Puts the chunk in its place and returns it."""
        try:
            with open(self._partial, "rb+") as file:
                os.fsync(file.fileno())
            os.replace(self._partial, self._path)
        except OSError as error:
            raise failed(error, self._path) from None
        return Chunk(self._path, self._dtype, self._count, self._bounds, self._checksum)


def write(path, corners):
    """Writes triangles, (k, 3, 3), and returns their Chunk."""
    writer = Writer(path)
    writer.add(corners)
    return writer.end()


def failed(error, path):
    """Returns the NotWritten for an OSError of a file in the scratch folder."""
    if error.errno == errno.ENOENT:
        return NotWritten(f"{path}: {error.strerror}: the scratch folder has been removed; start again")
    if error.errno in _FULL:
        return NotWritten(f"{path}: {error.strerror}; what is done is kept: free some space, and go on with --resume")
    return NotWritten(f"{path}: {error.strerror}")


def mesh_of(corners):
    """Returns (vertices, triangles) of triangles, (k, 3, 3), with one vertex at each position."""
    vertices, number = package.module.weld(corners.reshape(-1, 3), threads=1)
    return vertices, number.reshape(-1, 3)


def bounds_of(points):
    """Returns the bounding Box of points, (n, 3)."""
    if not len(points):
        return Box((np.inf,) * 3, (-np.inf,) * 3)
    return Box(tuple(points.min(0).tolist()), tuple(points.max(0).tolist()))


def gather(chunks, box, threads):
    """Returns (vertices, triangles): the triangles of some chunks, in their order, whose own bounding box meets a box.

    Each position has one vertex, and each vertex is used.
    """

    def part(chunk):
        vertices, triangles = chunk.mesh()
        if box.contains(chunk.bounds):
            return vertices, triangles
        return selected(vertices, triangles, of_corners(vertices, triangles, box.meets_triangles))

    near = [chunk for chunk in chunks if chunk.count and chunk.bounds.meets(box)]
    with ThreadPoolExecutor(min(threads or os.cpu_count(), _READERS)) as pool:
        vertices, triangles = joined(list(pool.map(part, near)))
    vertices, number = package.module.weld(vertices, threads=threads)
    return vertices, number[triangles]


def of_corners(vertices, triangles, tell):
    """Returns tell(corners), (k,) bool, for triangles, (k, 3) indices.

    tell gets (j, 3, 3) at a time, so that the corners of all triangles are never in memory together.
    """
    found = [tell(vertices[triangles[at : at + _AT_ONCE]]) for at in range(0, len(triangles), _AT_ONCE)]
    return np.concatenate(found) if found else np.zeros(0, bool)


def selected(vertices, triangles, chosen):
    """Returns (vertices, triangles): the triangles for which chosen, (k,) bool, holds, and the vertices that they use."""
    triangles = triangles[chosen]
    used = np.zeros(len(vertices), bool)
    used[triangles] = True
    number = np.cumsum(used, dtype=np.int32) - 1
    return vertices[used], number[triangles]


def joined(meshes):
    """Returns (vertices, triangles) of some meshes together, whose vertices stay apart. They are fewer than 2**31."""
    if not meshes:
        return np.empty((0, 3), np.float32), np.empty((0, 3), np.int32)
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    return (
        np.concatenate([vertices for vertices, _ in meshes]),
        np.concatenate([triangles + np.int32(first) for (_, triangles), first in zip(meshes, firsts)]),
    )
