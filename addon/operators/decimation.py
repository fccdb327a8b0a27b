# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates arrays within the tolerance in a thread and certifies the result, for every operator that decimates meshes."""

import math
import time

import numpy as np

from .. import native
from ..errors import NotProved
from ..mesh import filling, mesh_io, protect, transfer
from ..proof import kept_warnings, last_run, measure, report, solidity, verdict
from ..proof.certify import certify
from ..reference import measurements, snapshots, volumes


def options(settings, placement, threads):
    """Returns the options of the native decimate() for `settings` with the properties of decimate_settings().

    placement: an identifier of properties.PLACEMENTS.
    """
    return {
        "placement": placement.lower(),
        "two_sided": settings.keep == "BOTH",
        "effort": settings.effort.lower(),
        "crossings": settings.crossings.lower(),
        # A property holds a float32, in which 90 and 180 degrees are slightly more.
        "max_normal_angle": round(math.degrees(settings.max_normal_angle), 4),
        "max_seconds": settings.max_seconds or None,
        "target_triangles": settings.target_triangles if settings.use_target else None,
        "outside": "error",
        "threads": threads,
    }


def task(ob, surface, reference, tolerance, settings, asked):
    """Returns the Task that decimates `surface`, that of `ob`, within the tolerance of `reference`, another Surface.

    settings: what is protected, and whether holes are closed, as in decimate_settings(); asked: the result of options().
    """
    made = Task(ob.name, surface, reference, tolerance, asked)
    made.uvs = mesh_io.corner_uvs(ob.data)
    made.locked[mesh_io.loose_edges(ob.data)] = True
    made.locked |= protect.on_edges(ob.data, settings.protect)
    made.locked |= protect.on_planes(ob.data, settings.symmetry)
    if settings.only_selected:
        made.locked |= protect.unselected(ob)
        made.selected = mesh_io.column(ob.data.polygons, "select", 1, bool)
    if settings.close_holes:
        angle = asked["max_normal_angle"]
        made.close_holes = {
            "largest_perimeter": settings.largest_perimeter or None,
            # Left as it is, *Normals* would leave open the ends of tubes, which are at right angles to the tubes.
            "max_normal_angle": None if angle == 90 else angle,
        }
    made.shares = protect.group_weights(ob, settings.vertex_group, settings.invert_vertex_group)
    if made.shares is not None:
        made.locked |= made.shares == 0
    return made


def keep(operator, ob, outcome, layout, said):
    """Remembers the outcome of a Task at its object, whose mesh has just been written, and reports it.

    layout: the Layout of the mesh that was written; said: the name of the object, for the messages.
    """
    _, reference, result, run = outcome
    written = snapshots.surface_of(ob)
    certified = mesh_io.to_world(result.vertices, written.matrix), result.triangles
    other = reference.world(), reference.arrays.triangles
    measure.take_over((written.world(), written.arrays.triangles), certified, other, layout.triangles)
    measurements.remember(ob, written, run, run["tolerance"]["absolute"])
    last_run.keep(ob, run)
    kept_warnings.keep(ob, run["warnings"], run["locked"])
    for warning in run["warnings"]:
        operator.say({"WARNING"}, f"{said}{warning}")
    operator.say({"INFO"}, f"{said}{verdict.word(ob)}: {report.line(run)}")


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
        result = transfer.Decimated.of(computed, arrays)
        clock.append(time.perf_counter())
        decimated = snapshots.Surface(mesh_io.MeshArrays(result.vertices, result.triangles, None, None), matrix)
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
        return len(transfer.Decimated.of(computed, arrays).triangles)

    def _wedges(self, arrays):
        """Returns the wedge at each corner of the triangles, or None without UV maps."""
        if self.uvs is None:
            return None
        values = self.uvs[arrays.corners]
        if isinstance(arrays, filling.FilledArrays):
            number = arrays.hole.astype(np.float32)[:, None, None]
            values = np.concatenate([values, np.broadcast_to(number, (*values.shape[:2], 1))], 2)
        return native.module.wedges(arrays.triangles, np.ascontiguousarray(values))

    def _decimate(self, arrays, volume, wedges, progress):
        return native.module.decimate(
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
        closed = native.module.close_holes(
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
        meeting = int(protect.meeting(triangles, wedges).sum())
        if meeting:
            run["locked"][kept_warnings.ISLANDS] = meeting
        vertices = len(np.unique(triangles))
        if 2 * meeting > vertices:
            run["warnings"].append(
                f"{meeting:,} of {vertices:,} vertices have to stay, because three or more UV islands meet at each of "
                "them; remove UV maps that are not needed"
            )
