# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates a mesh file in rounds over cells, and proves the whole.

Each round refers to the reference as it is in the file. docs/architecture.md says why the proofs of the cells compose ("Cells of
a large mesh").
"""

import contextlib
import ctypes
import math
from dataclasses import dataclass, replace
from functools import reduce
from typing import NamedTuple

import numpy as np

from ..shared.proof.verdict import Interval
from . import chunks, clipping, scratch, tile
from .cells import EVERYWHERE, Box, centroids
from .chunks import Chunk
from .tile import Tile

_MOST_ROUNDS = 6
_PARTS = 8  # chunks of the reference for each cell of the first round
# A round is not made if it is expected to remove a smaller share of the triangles, unless it is the first with a single cell.
_LEAST_GAIN = 0.02


@dataclass(frozen=True)
class Result:
    """A mesh, and what was measured of it.

    vertices: (n, 3) of the file's dtype, one at each position; triangles: (m, 3) int32; rounds: (the number of cells, the
    triangles after it) for each round that was made; forward, backward: Intervals; angle: the largest angle in degrees between a
    face and its witnesses, or None if some face has no angle; warnings: sentences, each once.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    rounds: tuple
    forward: Interval
    backward: Interval
    angle: float | None
    warnings: tuple


def bounds(mesh):
    """Returns the bounding Box of a MappedMesh. Raises Refused for a vertex that is not finite, and all else that is damaged."""
    return reduce(Box.joined, (chunks.bounds_of(corners.reshape(-1, 3)) for corners in mesh.blocks()))


def needed_space(mesh):
    """Returns the bytes that a run takes of the scratch folder at its peak, at most.

    They are the chunks of the reference, which overlap nowhere, those of the present mesh, and those that replace them. The
    records of the steps, and 16 bytes for each block of a chunk, come on top.
    """
    of_triangle = 9 * mesh.dtype.itemsize + 3 * 4  # where no vertex is shared
    return 3 * mesh.count * of_triangle


class Job(NamedTuple):
    """The work of a step in one cell."""

    cell: int  # its number in the round, from 1
    tile: Tile
    path: str  # of its record, and of its chunk if it makes one


class Rounds:
    """A run. `each(stage, title, function, jobs)` yields function(job, progress) for all jobs, and shows the progress.

    The stage is "read", whose jobs are to be done here and in their order, "decimation" or "certify". The jobs of these are each
    a Job, for any process, in any order.
    """

    def __init__(self, mesh, plan, folder, tolerance, options, each):
        self._mesh, self._plan, self._scratch, self._each = mesh, plan, folder, each
        self._tolerance, self._options = tolerance, options

    def run(self):
        """Returns the Result. Raises NotWritten where the scratch folder is full, after which the run can go on."""
        reference = present = self._reference()
        box = reduce(Box.joined, (chunk.bounds for chunk in reference))
        # Far from the origin the measuring of clipped triangles adds more than the headroom of a decimation.
        loss = clipping.STEEP_LOSS * clipping.rounding((box.lower, box.upper))
        shorter = max(self._tolerance - 4 * loss, self._tolerance / 2)
        made, angles, warnings, boxes = [], [0.0], {}, None
        for number in range(_MOST_ROUNDS):
            wanted = self._boxes(number, present, made)
            if not wanted:
                break
            boxes = wanted
            # The first of several rounds leaves so many triangles between the cells that a thorough search is in vain.
            options = self._options if number or len(boxes) == 1 else {**self._options, "effort": "fast"}
            like = Tile(None, present, reference, shorter, options, self._plan.grid_memory())
            done = self._steps("decimation", f"round {number + 1}", f"round{number}", decimate, like, boxes)
            before, present = present, tuple(Chunk.read_from(record["chunk"]) for record in done)
            if before != reference:
                self._scratch.remove_chunks(before)
            angles += [record["angle"] for record in done]
            warnings |= dict.fromkeys(text for record in done for text in record["warnings"])
            made.append((len(boxes), sum(chunk.count for chunk in present)))
        if len(boxes) > 1:
            needed = math.ceil(1.05 * self._plan.needed(present) / 1e6)  # Other cells may leave a little more.
            text = (
                f"the last round had {len(boxes)} cells: with about --memory {needed}MB it would have one, which may leave "
                "fewer triangles"
            )
            warnings[text] = None
        vertices, triangles = chunks.gather(present, EVERYWHERE, self._options["threads"])
        like = Tile(None, present, reference, self._tolerance, self._options)
        measured = self._steps("certify", "measuring", "measured", measure, like, boxes)
        forward, backward = (
            Interval(max(record[way][0] for record in measured), max(record[way][1] for record in measured))
            for way in ("forward", "backward")
        )
        angle = None if None in angles else max(angles)
        return Result(vertices, triangles, tuple(made), forward, backward, angle, tuple(warnings))

    def _reference(self):
        """Returns the chunks of the triangles of the file, each of a part of space."""
        if record := self._scratch.record("reference"):
            return tuple(map(Chunk.read_from, record["chunks"]))
        parts = self._plan.parts(_PARTS * len(self._plan.first.boxes))
        writers = [chunks.Writer(self._scratch.path(f"reference_{i:05}")) for i in range(len(parts.boxes))]

        def write(corners, progress):
            number = parts.of(centroids(corners))
            order = np.argsort(number, kind="stable")
            ends = np.searchsorted(number[order], np.arange(len(writers) + 1))
            for writer, begin, end in zip(writers, ends, ends[1:]):
                writer.add(corners[order[begin:end]])

        for _ in self._each("read", "reading", write, self._mesh.blocks()):
            pass
        self._mesh.require_unchanged()
        found = tuple(writer.end() for writer in writers)
        self._scratch.keep("reference", {"chunks": [chunk.record() for chunk in found]})
        return found

    def _boxes(self, number, present, made):
        """Returns the boxes of the cells of a round, or None if there is no such round.

        They are kept, because the chunks that they depend on are removed.
        """
        if record := self._scratch.record(f"cells{number}"):
            return [Box(*map(tuple, box)) for box in record["boxes"]]
        if not number:
            cells = self._plan.first
        elif number == 1 and made[0][0] == 1:
            return None
        else:
            cells = self._plan.later(present)
            is_vain = len(made) > 1 and _expected_gain([self._mesh.count, *(count for _, count in made)]) < _LEAST_GAIN
            # The first round with a single cell is never in vain.
            if not cells or (is_vain and (len(cells.boxes) > 1 or made[-1][0] == 1)):
                return None
        self._scratch.keep(f"cells{number}", {"boxes": [(box.lower, box.upper) for box in cells.boxes]})
        return cells.boxes

    def _steps(self, stage, title, name, work, like, boxes):
        """Returns the records of the work in all cells, and does what has none yet."""
        jobs = [
            Job(i + 1, replace(like, cell=box), str(self._scratch.path(f"{name}_{i:05}")))
            for i, box in enumerate(boxes)
        ]
        missing = [job for i, job in enumerate(jobs) if self._scratch.record(f"{name}_{i:05}") is None]
        for _ in self._each(stage, title, work, missing):
            pass
        return [self._scratch.record(f"{name}_{i:05}") for i in range(len(jobs))]


def _expected_gain(counts):
    """Returns the share of the triangles that the round after the ones that left these counts may remove.

    It falls by about the same factor from round to round. counts: three at least, the first is of the reference.
    """
    before, last = (1 - after / count if count else 0 for count, after in zip(counts[-3:-1], counts[-2:]))
    return last * min(1, last / before) if before > 0 else last


def decimate(job, progress=None):
    """Does the work of a round in one cell, and notes that it is done."""
    chunk, angle, warnings = tile.decimate(job.tile, job.path, progress)
    _give_back()
    scratch.keep(job.path, {"chunk": chunk.record(), "angle": angle, "warnings": warnings})


def measure(job, progress=None):
    """Measures both distances in one cell, and notes them."""
    forward, backward = tile.measure(job.tile, progress)
    _give_back()
    scratch.keep(job.path, {"forward": forward, "backward": backward})


def _give_back():
    """Gives the memory that is free in this process back to the system: glibc keeps much of it, in pieces that are too small
    for the next cell."""
    with contextlib.suppress(AttributeError, OSError, TypeError):  # Other systems have no malloc_trim().
        ctypes.CDLL(None).malloc_trim(0)
