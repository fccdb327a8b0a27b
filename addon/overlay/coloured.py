# SPDX-License-Identifier: GPL-3.0-or-later
"""Says which surface is coloured for an object: its mesh by the distance from the reference, or the reference by the distance
from the mesh."""

from dataclasses import dataclass

import numpy as np

from ..mesh import mesh_io
from ..redraw import redraw_views
from ..reference import snapshots, tolerances
from . import field
from .surface import Triangles

# Fingerprint of a reference -> its Triangles.
_references = {}


@dataclass(frozen=True)
class Coloured:
    triangles: Triangles
    model: np.ndarray  # (4, 4) float64 from the vertices to the world
    to_frame: np.ndarray  # (4, 4) float64 from the vertices to the frame of the tree
    field: field.Field  # the surface from which the distances are measured
    signed: bool
    present: bool  # whether the field is of the mesh as it is now

    @property
    def tree(self):
        return self.field.tree

    @property
    def to_world(self):
        """Returns (4, 4): the matrix from the vertices to the space in which the tree has its lengths."""
        return np.linalg.inv(self.field.to_frame) @ self.to_frame

    @property
    def state(self):
        """A value that is another one once the distances may be others."""
        return self.triangles.changes, id(self.triangles), id(self.field), self.to_world.tobytes()


def is_reference(ob):
    """Whether the reference of `ob` is coloured and not its mesh."""
    return ob.tolvol.deviation_surface == "REFERENCE"


def tolerance_of(ob):
    return tolerances.tolerance_length(ob.tolvol, ob.tolvol.snapshot_size)


def of(ob, surface):
    """Returns (Coloured, None), or (None, why there is none yet). surface: the Surface of `ob`, which is up to date."""
    tolerance, model = tolerance_of(ob), mesh_io.matrix_array(ob.matrix_world)
    if is_reference(ob):
        found, reason = field.field_of_mesh(ob, surface, tolerance, redraw_views)
        if found is None:
            return None, reason
        to_frame, present = field.reference_to_frame(found, ob), field.is_of(found, ob, surface)
        matrix = snapshots.reference_matrix(ob)
        return Coloured(reference_triangles(ob), matrix, to_frame, found, False, present), None
    found, reason = field.field_of(ob, tolerance, redraw_views)
    if found is None:
        return None, reason
    signed = ob.tolvol.deviation_kind == "SIGNED" and found.tree.closed
    return Coloured(surface, model, field.vertex_to_frame(found, ob), found, signed, True), None


def reference_triangles(ob):
    """Returns the Triangles of the object's reference, which never change."""
    key = ob.tolvol.snapshot_fingerprint
    if key not in _references:
        arrays = mesh_io.read_mesh(ob.tolvol.snapshot)
        _references[key] = Triangles(arrays.vertices, arrays.triangles)
    return _references[key]


def keep_only(objects):
    """Forgets what was kept for references except for those of these objects."""
    for key in _references.keys() - {ob.tolvol.snapshot_fingerprint for ob in objects}:
        del _references[key]
