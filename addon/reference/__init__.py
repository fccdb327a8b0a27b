# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the reference of an object, its tolerance volumes, and the distances that were measured from it."""

from bpy.app.handlers import persistent

from .. import handlers
from ..shared import volumes
from . import measurements, snapshots


@persistent
def _forget_shown(*_):
    measurements.forget()
    snapshots.notify()


@persistent
def _forget_changed(_scene, depsgraph):
    if changed := {update.id.original for update in depsgraph.updates if update.is_updated_geometry}:
        measurements.forget_changed(changed)


@persistent
def forget_all(*_):
    measurements.forget()
    snapshots.forget()
    volumes.forget()
    snapshots.notify()


_HANDLERS = (
    ("depsgraph_update_post", _forget_changed),
    ("undo_post", _forget_shown),
    ("redo_post", _forget_shown),
    ("load_post", forget_all),
)


def register():
    handlers.add(_HANDLERS)


def unregister():
    handlers.remove(_HANDLERS)
    forget_all()
