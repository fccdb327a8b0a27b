# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates arrays within the tolerance in a thread and certifies the result, for every operator that decimates
meshes, and prepares what these write."""

import math

from ..job import breathe
from ..mesh import mesh_io, protect
from ..proof import kept_warnings, last_run, verdict
from ..reference import measurements, snapshots
from ..shared.decimation import Task, hole_options
from ..shared.proof import measure, report
from ..shared.surface import to_world


def options(settings, placement, threads):
    """Returns the options of the native decimate() for `settings` with the properties of decimate_settings().

    placement: an identifier of PLACEMENTS in properties/choices.py.
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
        "outside": settings.outside.lower(),
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
        made.close_holes = hole_options(settings.largest_perimeter, asked["max_normal_angle"])
    made.shares = protect.group_weights(ob, settings.vertex_group, settings.invert_vertex_group)
    if made.shares is not None:
        made.locked |= made.shares == 0
    return made


def prepared(operator, stack, writings):
    """A generator for steps(): returns the prepared transfer.Writing of each outcome, in contexts of the stack.

    writings: a function that makes the Writings. If a mesh of the operator changes meanwhile, it is called again.
    """
    operator.doing, operator.part = "Writing", ""
    operator.edited()  # What was changed until now is read below.
    writes = [stack.enter_context(write) for write in writings()]
    for i, write in enumerate(writes):
        operator.share = i / len(writes)
        for _ in write.prepare():
            yield breathe
    if operator.edited():
        # The user may have shaded the mesh meanwhile, say. It is read again, and nothing can come between now.
        stack.close()
        writes = [stack.enter_context(write) for write in writings()]
        for write in writes:
            write.prepare_at_once()
    return writes


def keep(operator, ob, outcome, layout, said):
    """Remembers the outcome of a Task at its object, whose mesh has just been written, and reports it.

    layout: the Layout of the mesh that was written; said: the name of the object, for the messages.
    """
    _, reference, result, run = outcome
    written = snapshots.surface_of(ob)
    certified = to_world(result.vertices, written.matrix), result.triangles
    other = reference.world(), reference.arrays.triangles
    measure.take_over((written.world(), written.arrays.triangles), certified, other, layout.triangles)
    measurements.remember(ob, written, run, run["tolerance"]["absolute"])
    last_run.keep(ob, run)
    kept_warnings.keep(ob, run["warnings"], run["locked"])
    for warning in run["warnings"]:
        operator.say({"WARNING"}, f"{said}{warning}")
    operator.say({"INFO"}, f"{said}{verdict.word(ob)}: {report.line(run)}")
