# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the run of the last operation on an object, and tells whether it is still about the object's mesh.

A run of a decimation is described in shared/proof/report.py. A run of any other operation is {operation, solidity}: the name of
the operation, and the result of solidity.compared().
"""

import functools
import json

import numpy as np

from ..mesh import mesh_io
from ..reference import measurements, snapshots
from ..shared.proof import report, solidity
from ..units import area, length, volume

# What reading JSON can raise that a damaged file holds in place of what was written.
DAMAGED = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError)


def keep(ob, run):
    """Stores the run of an operation on `ob`, whose mesh has just been measured, in place of that of the operation before."""
    ob.tolvol.last_run_of = ob.tolvol.measurement.fingerprint
    ob.tolvol.last_run_matrix = ob.tolvol.measurement.matrix
    ob.tolvol.last_run = json.dumps(run)


def clear(ob):
    """Forgets the run, as the mesh is replaced by another one."""
    ob.tolvol.last_run = ob.tolvol.last_run_of = ""


def shown(ob):
    """Returns the run as JSON, for drawing, or "" if it is of another mesh or of another shape in the world.

    Outside Object Mode it is "": Blender may be changing the mesh there, and Python does not see the changes.
    """
    settings = ob.tolvol
    if not settings.last_run or ob.mode != "OBJECT" or settings.last_run_of != measurements.shown_fingerprint(ob):
        return ""
    before, now = snapshots.stored_matrix(settings.last_run_matrix), mesh_io.matrix_array(ob.matrix_world)
    return settings.last_run if measurements.same_shape(before, now) else ""


def stays(ob):
    """Whether mesh and place of the object are those that the last operation left."""
    place = np.float32(mesh_io.matrix_array(ob.matrix_world))
    same_place = np.array_equal(np.float32(ob.tolvol.last_run_matrix).reshape(4, 4), place)
    return same_place and ob.tolvol.last_run_of == mesh_io.read_mesh(ob.data).fingerprint()


def remembered(text, context):
    """Returns two lines about a run that a .blend file keeps as JSON, or None if the text is damaged.

    The lines are the counts() of a decimation, or None of another operation; and the facts about the result, or None if
    the run is of an earlier version.
    """
    try:
        run = json.loads(text)
        decimated = "operation" not in run
        counted = report.counts(run, functools.partial(length, context)) if decimated else None
        if decimated and "solidity" not in run:
            return counted, None
        return counted, facts(run["solidity"], context)
    except DAMAGED:
        return None


def remembered_holes(text):
    """Returns the entry "holes" of a run that a .blend file keeps as JSON, or None if there is none that can be read."""
    try:
        holes = json.loads(text)["holes"]
        return holes if holes and report.holes_closed(holes) and [*report.hole_rows(holes)] else None
    except DAMAGED:
        return None


def facts(compared, context):
    """Returns the facts about a result as text for the panel, in the scene's units. compared: of solidity.compared()."""
    return solidity.summary(compared, functools.partial(area, context), functools.partial(volume, context))
