# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps readings of the probe as labels of an object, which Blender saves with the file.

A label remembers the state in which it was read. It is out of date once mesh, place or reference have changed, and is then
shown as such: measuring again makes it true.
"""

import numpy as np

from ..mesh import mesh_io
from ..reference import measurements, snapshots
from ..shared.surface import to_world
from .probing import Reading

# Functions that are called when labels were added, changed or removed.
listeners = []


def add(ob, reading):
    """Stores a Reading as the last label of `ob`, which becomes the chosen one."""
    label = ob.tolvol.labels.add()
    write(ob, label, reading)
    ob.tolvol.label_index = len(ob.tolvol.labels) - 1
    notify()


def write(ob, label, reading):
    """Stores a Reading of the present state of `ob` in a label."""
    inverse = np.linalg.inv(mesh_io.matrix_array(ob.matrix_world))
    label.place = to_world(reading.position[None], inverse)[0]
    label.on_reference, label.side, label.share = reading.on_reference, reading.side, reading.share
    label.distance = reading.distance
    label.fingerprint = measurements.shown_fingerprint(ob)
    label.matrix = mesh_io.matrix_array(ob.matrix_world).ravel()
    label.reference = measurements.about_reference(ob)


def current(ob, label):
    """Whether a label is true of `ob` as it is now. It is quick enough to be called while drawing.

    Outside Object Mode it is not known, and the result is False.
    """
    if ob.mode != "OBJECT" or ob.tolvol.snapshot is None or snapshots.stale_reason(ob):
        return False
    if label.fingerprint != measurements.shown_fingerprint(ob) or label.reference != measurements.about_reference(ob):
        return False
    if not snapshots.sound(1 + label.distance):
        return False  # The file is damaged.
    before, now = snapshots.stored_matrix(label.matrix), mesh_io.matrix_array(ob.matrix_world)
    own = ob.tolvol.snapshot_kind == "SELF"
    return bool(measurements.same_shape(before, now) if own else np.array_equal(before, now))


def reading(ob, label):
    """Returns a label as a Reading, at its place on the object as it is now."""
    position = to_world(np.array(label.place, np.float64)[None], mesh_io.matrix_array(ob.matrix_world))
    return Reading(position[0], label.on_reference, label.distance, label.side, label.share)


def listed(ob, tolerance):
    """Returns the labels of `ob` as entries of a report (deviation.py)."""
    entries = []
    for label in ob.tolvol.labels:
        found = reading(ob, label)
        entries.append(
            {
                "on": "reference" if found.on_reference else "mesh",
                "position": found.position.tolist(),
                "distance": found.distance,
                "side": found.side or None,
                "share_of_tolerance": found.distance / tolerance,
                "current": current(ob, label),
            }
        )
    return entries


def notify():
    for listener in listeners:
        listener()
