# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates how many triangles Decimate would leave, for the panel, before Decimate is pressed.

While the panel is drawn, decimations run in a thread, one at a time and without a proof: one at the present tolerance once
it rests, and some at others, so that the number is known at once while the tolerance is dragged (curve.py). They end when
an operator is at work, and when the mesh, its mode or a setting changes. None begins that the panel does not ask for.
"""

import bpy
from bpy.app.handlers import persistent

from .. import handlers
from . import known, runs
from .answer import Estimate, shown

__all__ = ["Estimate", "register", "shown", "unregister"]


@persistent
def _note_changes(_scene, depsgraph):
    for update in depsgraph.updates:
        if update.is_updated_geometry and isinstance(update.id, bpy.types.Mesh):
            known.changed(update.id)
            runs.cancel()


@persistent
def _before_other_data(*_):
    """Called before a file is opened and a step is undone."""
    known.other_data()
    runs.cancel()


@persistent
def _after_load(*_):
    known.forget()


_HANDLERS = (
    ("depsgraph_update_post", _note_changes),
    ("load_pre", _before_other_data),
    ("undo_pre", _before_other_data),
    ("redo_pre", _before_other_data),
    ("load_post", _after_load),
)


def register():
    handlers.add(_HANDLERS)


def unregister():
    handlers.remove(_HANDLERS)
    runs.cancel()
    known.forget()
