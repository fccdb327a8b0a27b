# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Deviation colours the mesh in the 3D view at every pixel by its distance to the reference, or the reference by its
distance to the mesh, and draws a legend.

While no object shows its deviation, the overlay has no handlers and holds no memory. The graphics driver computes the
distances: they are shown, not proved.
"""

import functools

import bpy
from bpy.app.handlers import persistent

from .. import native, preferences
from ..background import queue
from ..proof import labels as kept_labels
from ..proof import places, probing
from ..redraw import redraw_views
from ..reference import snapshots
from . import annotations, coloured, draw, field, geometry_buffer, legend, moving, reasons, shaders, shares, square
from .surface import Surface

_surfaces = {}  # name of an object that shows its deviation -> Surface
_drawing = []  # draw handlers


def shows(ob):
    """Whether the deviation of `ob` is shown."""
    return ob.name in _surfaces


def refresh():
    """Adds and removes surfaces and handlers as the settings of the objects demand.

    It is called whenever a reference or a setting may have changed.
    """
    if not preferences.use_gl(bpy.context):
        reasons.broken.clear()  # When drawing is turned on again, the driver is tried again.
    annotations.refresh()
    names = _wanted()
    if not names:
        _end()
        return
    for name in _surfaces.keys() - names:
        del _surfaces[name]
        shares.forget(name)
    for name in names:
        _surfaces.setdefault(name, Surface()).touch(True)
    objects = [bpy.data.objects[name] for name in names]
    field.keep_only({field.key_of(ob) for ob in objects})
    references = [ob for ob in objects if coloured.is_reference(ob)]
    field.keep_only_meshes({ob.name for ob in references})
    coloured.keep_only(references)
    if not _drawing:
        _begin()
    redraw_views()


def _wanted():
    """Returns the names of the objects that show their deviation."""
    if native.module is None or reasons.off():
        return set()
    meshes = (ob for ob in bpy.data.objects if ob.type == "MESH" and ob.library is None)
    return {ob.name for ob in meshes if ob.tolvol.show_deviation and ob.tolvol.snapshot is not None}


def _begin():
    for function, when in ((draw.surfaces, "POST_VIEW"), (draw.legend_of_one, "POST_PIXEL")):
        _drawing.append(bpy.types.SpaceView3D.draw_handler_add(_guarded(function), (), "WINDOW", when))
    bpy.app.handlers.depsgraph_update_post.append(_note_changes)
    bpy.app.handlers.frame_change_post.append(_note_frame)


def _end():
    if _drawing:
        for handler in _drawing:
            bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
        _drawing.clear()
        bpy.app.handlers.depsgraph_update_post.remove(_note_changes)
        bpy.app.handlers.frame_change_post.remove(_note_frame)
        queue.stop(*field.TASKS, *shares.TASKS)
        redraw_views()
    _surfaces.clear()
    shares.forget()
    field.keep_only(set())
    field.keep_only_meshes(set())
    coloured.keep_only([])
    legend.free()
    geometry_buffer.free()
    square.free()
    shaders.free()


def _guarded(function):
    """Wraps a draw handler: after the first refusal by the graphics driver the overlay ends, and the panel says why."""

    @functools.wraps(function)
    def call():
        if not all(name in bpy.data.objects for name in _surfaces):  # An object was renamed.
            bpy.app.timers.register(refresh, first_interval=0)
        try:
            function(bpy.context, _surfaces)
        except (RuntimeError, SystemError) as error:
            reasons.broken[:] = [str(error)]
            bpy.app.timers.register(_end, first_interval=0)

    return call


@persistent
def _note_changes(_scene, depsgraph):
    # Objects may have been added, removed or renamed.
    if depsgraph.id_type_updated("SCENE") and _wanted() != _surfaces.keys():
        refresh()
        return
    changed = {update.id.original: update.is_updated_geometry for update in depsgraph.updates}
    for name, surface in _surfaces.items():
        ob = bpy.data.objects.get(name)
        if ob is None or not (ob in changed or ob.data in changed):
            continue
        geometry = changed.get(ob, False) or changed.get(ob.data, False)
        # Blender does not count a sculpt stroke or a change of the selection as a change of the geometry.
        if geometry or ob.mode != "OBJECT":
            surface.touch(geometry and ob.mode != "SCULPT")


@persistent
def _note_frame(*_):
    for surface in _surfaces.values():
        surface.touch(True)


@persistent
def _forget_places(*_):
    places.forget()
    legend.forget_moved()


def register():
    moving.register()
    bpy.app.handlers.load_post.append(_forget_places)
    snapshots.listeners.append(refresh)
    for kept in (places, kept_labels, probing):
        kept.listeners.append(annotations.refresh)


def unregister():
    bpy.app.handlers.load_post.remove(_forget_places)
    places.forget()
    for kept in (places, kept_labels, probing):
        kept.listeners.remove(annotations.refresh)
    annotations.end()
    snapshots.listeners.remove(refresh)
    _end()
    moving.unregister()
    reasons.broken.clear()
