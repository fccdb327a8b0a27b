# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the reference of an object, its tolerance volumes, and the distances that were measured from it."""

from bpy.app.handlers import persistent

from .. import handlers
from ..shared import volumes
from . import instances, measurements, snapshots


@persistent
def _forget_shown(*_):
    measurements.forget()
    snapshots.notify()


@persistent
def _forget_changed(_scene, depsgraph):
    # Blender does not tell of each change: a frame that is changed leaves some out. So the next one it tells of is for all.
    if any(update.is_updated_geometry for update in depsgraph.updates):
        measurements.forget()


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
    instances.register()


def unregister():
    instances.unregister()
    handlers.remove(_HANDLERS)
    forget_all()
