# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the run of the last operation on an object, and tells whether it is still about the object's mesh.

A run of a decimation is described in report.py. A run of any other operation is {operation, solidity}: the name of the
operation, and the result of solidity.compared().
"""

import json

import numpy as np

from ..mesh import mesh_io
from ..reference import measurements, snapshots


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
