# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates arrays within the tolerance and certifies the result: for the add-on in a thread, and for the command."""

import math
import time

import numpy as np

from . import filling, package, volumes
from .decimated import Decimated
from .errors import NotProved
from .proof import measure, report, solidity
from .proof.certify import certify
from .surface import MeshArrays, Surface

FEWEST_LEVELS, MOST_LEVELS = 2, 6  # of a chain of levels of detail

# The cause for which the vertices that have to stay can be found in the mesh.
ISLANDS = "UV islands meet"


def seen_as(pixels, distance, fov, height):
    """Returns the length that covers so many pixels of a picture at this distance from the camera.

    fov: the vertical angle of view in degrees; height: the height of the picture in pixels.
    """
    return pixels * 2 * distance * math.tan(math.radians(fov) / 2) / height


def meeting(triangles, wedges):
    """Returns (k,) bool up to the last vertex in use: the vertices at which three or more UV islands meet.

    Decimation has to keep them. wedges: (m, 3), the wedge at each corner of the triangles.
    """
    _, one_corner_each = np.unique(wedges, return_index=True)
    return np.bincount(triangles.ravel()[one_corner_each]) > 2


def hole_options(largest_perimeter, max_normal_angle):
    """Returns the options of close_holes() for a decimation. largest_perimeter: in world units, 0 for no limit."""
    return {
        "largest_perimeter": largest_perimeter or None,
        # Left as it is, the angle of the decimation would leave open the ends of tubes, which are at right angles to the tubes.
        "max_normal_angle": None if max_normal_angle == 90 else max_normal_angle,
    }


class Task:
    """The work on one object in the thread: it reads and returns arrays and numbers, no data of Blender."""

    def __init__(self, name, surface, reference, tolerance, options):
        self.name = name
        self.surface = surface
        self.reference = reference
        self.tolerance = tolerance
        self.options = options
        self.locked = np.zeros(len(surface.arrays.vertices), bool)
        self.shares = None
        self.uvs = None
        self.close_holes = None  # the options of close_holes(), if holes are to be closed
        self.selected = None  # (polygons,) bool, if only the selected ones are to be changed

    def run(self, progress):
        clock = [time.perf_counter()]
        threads = self.options["threads"]
        built = volumes.native_volume(self.reference, self.tolerance, threads, progress)
        clock.append(time.perf_counter())
        arrays, matrix = self.surface.arrays, self.surface.matrix
        holes, stages = None, ["field", "decimate", "certify"]
        if self.close_holes is not None:
            arrays, holes = self._close(arrays, built, progress)
            stages.insert(1, "close_holes")
            clock.append(time.perf_counter())
        wedges = self._wedges(arrays)
        computed = self._decimate(arrays, built, wedges, progress)
        result = Decimated.of(computed, arrays)
        clock.append(time.perf_counter())
        decimated = Surface(MeshArrays(result.vertices, result.triangles, None, None), matrix)
        kept = computed.report["outside"]["faces"]
        certified = certify(decimated, self.reference, self.tolerance, kept, threads, progress)
        if kept:
            before = measure.largest_distance(
                (self.reference.world(), self.reference.arrays.triangles),
                (self.surface.world(), self.surface.arrays.triangles),
                self.tolerance,
                threads,
                progress,
            )
            certified["outside"]["backward_before"] = before.upper
        certified["solidity"] = solidity.compared(
            *(solidity.facts(surface, threads, progress) for surface in (self.surface, decimated))
        )
        clock.append(time.perf_counter())
        seconds = dict(zip(stages, np.diff(clock).tolist()))
        run = report.decimation_run(
            self.surface.arrays, result, computed.report, built, certified, self.options, seconds, holes
        )
        if wedges is not None:
            self._name_corners(run, arrays.triangles, wedges)
        if not report.proved(run):
            raise NotProved(report.intervals(run))
        return arrays, self.reference, result, run

    def count(self, progress, volume=None):
        """Returns the number of triangles that run() leaves, without a proof. volume: instead of that of the tolerance."""
        built = volume or volumes.native_volume(self.reference, self.tolerance, self.options["threads"], progress)
        arrays = self.surface.arrays
        if self.close_holes is not None:
            arrays, _ = self._close(arrays, built, progress)
        computed = self._decimate(arrays, built, self._wedges(arrays), progress)
        return len(Decimated.of(computed, arrays).triangles)

    def _wedges(self, arrays):
        """Returns the wedge at each corner of the triangles, or None without UV maps."""
        if self.uvs is None:
            return None
        values = self.uvs[arrays.corners]
        if isinstance(arrays, filling.FilledArrays):
            number = arrays.hole.astype(np.float32)[:, None, None]
            values = np.concatenate([values, np.broadcast_to(number, (*values.shape[:2], 1))], 2)
        return package.module.wedges(arrays.triangles, np.ascontiguousarray(values))

    def _decimate(self, arrays, volume, wedges, progress):
        return package.module.decimate(
            arrays.vertices,
            arrays.triangles,
            volume,
            to_world=self.surface.matrix,
            locked=self.locked if self.locked.any() else None,
            shares=self.shares,
            wedges=wedges,
            progress=progress,
            **self.options,
        )

    def _close(self, arrays, volume, progress):
        """Returns the arrays with holes closed, and the report of them."""
        closed = package.module.close_holes(
            arrays.vertices,
            arrays.triangles,
            volume,
            to_world=self.surface.matrix,
            shares=self.shares,
            threads=self.options["threads"],
            progress=progress,
            **self.close_holes,
        )
        arrays, holes = filling.filled(arrays, closed, self.selected, self.uvs)
        return arrays, holes | self.close_holes | {"warnings": closed.report["warnings"]}

    def _name_corners(self, run, triangles, wedges):
        """Counts the vertices where three or more UV islands meet. They have to stay, so a UV map of many islands leaves
        little to decimate: the run warns of that."""
        staying = int(meeting(triangles, wedges).sum())
        if staying:
            run["locked"][ISLANDS] = staying
        vertices = len(np.unique(triangles))
        if 2 * staying > vertices:
            run["warnings"].append(
                f"{staying:,} of {vertices:,} vertices have to stay, because three or more UV islands meet at each of "
                "them; remove UV maps that are not needed"
            )
