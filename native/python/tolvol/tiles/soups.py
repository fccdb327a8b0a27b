# SPDX-License-Identifier: GPL-3.0-or-later
"""Soups: files of triangles by the coordinates of their corners, in the scratch folder."""

import errno
import os
import uuid
import zlib
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ..shared.errors import NotWritten, Refused
from .cells import Box

_BLOCK = 1 << 16  # triangles
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True)
class Soup:
    """A file of triangles: float32 or float64, nine numbers for each."""

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

    def corners(self):
        """Returns the triangles, (count, 3, 3). Raises Refused where the file is not as it was written."""
        try:
            data = Path(self.path).read_bytes()
        except OSError as error:
            raise Refused(f"{self.path}: {error.strerror}") from None
        if zlib.crc32(data) != self.checksum:
            raise Refused(f"{self.path} is damaged: remove the scratch folder and start again")
        return np.frombuffer(data, self.dtype).reshape(-1, 3, 3)


class Writer:
    """Writes a soup part by part. Nothing is where the soup will be before end()."""

    def __init__(self, path):
        # A task may be done twice at once, when its worker has only lost the connection.
        self._path, self._partial = str(path), f"{path}.{uuid.uuid4().hex}.partial"
        self._count, self._bounds, self._checksum, self._dtype = 0, bounds_of(np.empty((0, 3, 3))), 0, "<f4"
        self._write(b"", "wb")

    def _write(self, data, mode="ab"):
        # The file is closed between two parts, because there may be more soups than files that can be open at once.
        try:
            with open(self._partial, mode) as file:
                file.write(data)
        except OSError as error:
            raise failed(error, self._path) from None

    def add(self, corners):
        """Adds triangles, (k, 3, 3)."""
        if not len(corners):
            return
        data = np.ascontiguousarray(corners, corners.dtype.newbyteorder("<"))
        self._write(data)
        self._count += len(data)
        self._bounds = self._bounds.joined(bounds_of(data))
        self._checksum = zlib.crc32(data, self._checksum)
        self._dtype = data.dtype.str

    def end(self):
        """Puts the soup in its place and returns it."""
        try:
            with open(self._partial, "rb+") as file:
                os.fsync(file.fileno())
            os.replace(self._partial, self._path)
        except OSError as error:
            raise failed(error, self._path) from None
        return Soup(self._path, self._dtype, self._count, self._bounds, self._checksum)


def write(path, corners):
    """Writes triangles, (k, 3, 3), and returns their Soup."""
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


def bounds_of(corners):
    if not len(corners):
        return Box((np.inf,) * 3, (-np.inf,) * 3)
    points = corners.reshape(-1, 3)
    return Box(tuple(points.min(0).tolist()), tuple(points.max(0).tolist()))


def gather(soups, box):
    """Returns all triangles of some soups whose bounding box meets a box, (k, 3, 3), in the order of the soups."""
    found = []
    for soup in soups:
        if not soup.count or not soup.bounds.meets(box):
            continue
        corners = soup.corners()
        for first in range(0, len(corners), _BLOCK):
            block = corners[first : first + _BLOCK]
            found.append(block[box.meets_triangles(block)])
    return np.concatenate(found) if found else np.empty((0, 3, 3))
