# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the reference of an object, its tolerance volumes, and the distances that were measured from it."""

import bpy
from bpy.app.handlers import persistent

from . import measurements, snapshots, volumes


@persistent
def _forget_shown(*_):
    measurements.forget()
    snapshots.notify()


@persistent
def _forget_changed(_scene, depsgraph):
    if any(update.is_updated_geometry for update in depsgraph.updates):
        measurements.forget()


@persistent
def forget_all(*_):
    measurements.forget()
    snapshots.forget()
    volumes.forget()
    snapshots.notify()


def register():
    bpy.app.handlers.depsgraph_update_post.append(_forget_changed)
    bpy.app.handlers.undo_post.append(_forget_shown)
    bpy.app.handlers.redo_post.append(_forget_shown)
    bpy.app.handlers.load_post.append(forget_all)


def unregister():
    bpy.app.handlers.load_post.remove(forget_all)
    bpy.app.handlers.redo_post.remove(_forget_shown)
    bpy.app.handlers.undo_post.remove(_forget_shown)
    bpy.app.handlers.depsgraph_update_post.remove(_forget_changed)
    forget_all()
