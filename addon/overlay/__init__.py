# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Deviation: the mesh in the 3D view coloured at every pixel by its distance to the reference, with a legend.

While no object shows it there is neither a handler nor memory. Distances are read from a grid and interpolated: they
are shown, not proved.
"""

import functools

import bpy
import gpu
from bpy.app.handlers import persistent
from mathutils import Matrix, Vector

from .. import mesh_io, native, preferences, volume
from . import field, legend, shaders, work
from .surface import Surface

# In clip space, towards the eye: some steps of a depth buffer of 24 bits, so that equal surfaces do not fight.
_NEARER = 1e-6
_STRIPE = 12  # pixels from one stripe to the next
_SHARES_EVERY = 0.25  # seconds, at most so often

_surfaces = {}  # name of an object that shows its deviation -> Surface
_shares = {}  # name -> (of which changes and grid, the shares)
_handlers = []  # of drawing
_broken = None  # why Blender's drawing failed


def reason(ob):
    """Why the deviation of `ob` is not shown where it should be, or None."""
    settings = ob.tolvol
    if bpy.app.background:
        return "Blender runs without a window"
    if not preferences.use_gl(bpy.context):
        return "Drawing is turned off in the add-on's preferences"
    if _broken is not None:
        return f"The graphics driver refused: {_broken}"
    if settings.snapshot is None:
        return "Set the reference first"
    if why := volume.stale_reason(ob):
        return f"The reference is out of date: {why}"
    if ob.mode == "SCULPT" and ob.use_dynamic_topology_sculpting:
        return "Not shown while sculpting with Dyntopo"
    if ob.mode == "SCULPT" and any(modifier.type == "MULTIRES" for modifier in ob.modifiers):
        return "Not shown while sculpting with Multiresolution"
    return None


def unsigned_reason(ob):
    """Why only the magnitude can be shown, or None; known once the deviation is shown."""
    found = field.known(ob)
    if found is not None and not found.grid.closed:
        return "Magnitude only: the reference is open, so it has no inside"
    return None


def _wanted():
    """The names of the objects that show their deviation."""
    if bpy.app.background or native.module is None or not preferences.use_gl(bpy.context):
        return set()
    objects = (ob for ob in bpy.data.objects if ob.type == "MESH")
    return {ob.name for ob in objects if ob.tolvol.show_deviation and ob.tolvol.snapshot is not None}


def refresh():
    """Begins or ends to show what is to be shown now. Called whenever a reference or a setting changes."""
    names = _wanted()
    if not names:
        _end()
    else:
        for name in _surfaces.keys() - names:
            del _surfaces[name]
            _shares.pop(name, None)
        for name in names - _surfaces.keys():
            _surfaces[name] = Surface()
        for surface in _surfaces.values():  # an undo may have changed any
            surface.touch(True)
        field.keep_only({field.key_of(bpy.data.objects[name]) for name in names})
        _begin()
    _redraw()


def _begin():
    if _handlers:
        return
    add = bpy.types.SpaceView3D.draw_handler_add
    _handlers.append(add(_guarded(_draw_surfaces), (), "WINDOW", "POST_VIEW"))
    _handlers.append(add(_guarded(_draw_legend), (), "WINDOW", "POST_PIXEL"))
    bpy.app.handlers.depsgraph_update_post.append(_note_changes)
    bpy.app.handlers.frame_change_post.append(_note_frame)


def _end():
    for handler in _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(handler, "WINDOW")
    if _handlers:
        bpy.app.handlers.depsgraph_update_post.remove(_note_changes)
        bpy.app.handlers.frame_change_post.remove(_note_frame)
    _handlers.clear()
    _surfaces.clear()
    _shares.clear()
    work.stop()
    field.keep_only(set())
    legend.free()
    shaders.free()


@persistent
def _note_changes(_scene, depsgraph):
    if depsgraph.id_type_updated("SCENE"):  # objects came or went, or were renamed
        names = _wanted()
        if names != _surfaces.keys():
            refresh()
            return
    for update in depsgraph.updates:
        changed = update.id.original
        for name, surface in _surfaces.items():
            ob = bpy.data.objects.get(name)
            if ob is None or changed not in (ob, ob.data):
                continue
            # A stroke of sculpting moves vertices and is no change of the geometry to Blender.
            if update.is_updated_geometry or ob.mode == "SCULPT":
                surface.touch(ob.mode != "SCULPT")


@persistent
def _note_frame(*_):
    for surface in _surfaces.values():
        surface.touch(True)


def _guarded(draw):
    """What a driver refuses once it is not asked again: the overlay ends and the panel says why."""

    @functools.wraps(draw)
    def call():
        global _broken
        try:
            draw(bpy.context)
        except (RuntimeError, SystemError, ValueError) as error:
            _broken = str(error)
            bpy.app.timers.register(_end, first_interval=0)

    return call


def _in_view(context):
    """The objects to be drawn in this view."""
    space = context.space_data
    if not space.overlay.show_overlays or space.shading.type == "WIREFRAME":
        return []
    found = (context.view_layer.objects.get(name) for name in _surfaces)
    return [
        ob
        for ob in found
        if ob is not None and ob.visible_in_viewport_get(space) and ob.display_type in {"SOLID", "TEXTURED"}
    ]


def tolerance_of(ob):
    return volume.tolerance_length(ob.tolvol, ob.tolvol.snapshot_size)


def signed(ob, grid):
    return ob.tolvol.deviation_kind == "SIGNED" and grid.closed


def _draw_surfaces(context):
    objects = [ob for ob in _in_view(context) if not reason(ob)]
    if not objects:
        return
    depsgraph = context.evaluated_depsgraph_get()
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    gpu.state.blend_set("ALPHA")
    for ob in objects:
        surface = _surfaces[ob.name]
        surface.update(ob, depsgraph)
        found, _ = field.field_of(ob, tolerance_of(ob), _redraw)
        if found is not None:
            _draw(context, ob, surface, found)
    gpu.state.blend_set("NONE")
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _draw(context, ob, surface, found):
    to_nodes = field.vertex_to_nodes(found, ob)
    view = context.region_data
    inverse = view.view_matrix.inverted()
    eye = inverse.translation.to_4d() if view.is_perspective else inverse.col[2]
    world_to_nodes = Matrix(to_nodes.tolist()) @ ob.matrix_world.inverted()
    shader = shaders.surface()
    shader.bind()
    shader.uniform_sampler("transfer", shaders.transfer(signed(ob, found.grid)))
    shader.uniform_sampler("field", found.texture)
    told = shaders.told(
        view.perspective_matrix, ob.matrix_world, to_nodes, world_to_nodes @ Vector(eye),
        tolerance_of(ob) / found.grid.spacing, signed(ob, found.grid), _STRIPE * context.preferences.system.ui_scale,
        ob.tolvol.deviation_opacity)
    shader.uniform_block("told", told)
    surface.draw(shader)


def _draw_legend(context):
    objects = _in_view(context)
    if not objects:
        return
    ob = context.active_object if context.active_object in objects else objects[0]
    why = reason(ob)
    found = None
    if not why:
        found, why = field.field_of(ob, tolerance_of(ob), _redraw)
    if why:
        legend.draw_note(context, f"Deviation of {ob.name}: {why}" if len(objects) > 1 else f"Deviation: {why}")
        return
    is_signed = signed(ob, found.grid)
    shares = _shares_of(ob, found)
    legend.draw(context, f"Deviation of {ob.name}", is_signed, tolerance_of(ob), shares and legend.fold(shares, is_signed))


def _shares_of(ob, found):
    """The last ones known; computed anew in a thread when the mesh, its place or the tolerance is another."""
    name, surface, tolerance = ob.name, _surfaces[ob.name], tolerance_of(ob)
    if surface.vertices is None or not len(surface.triangles):
        return None
    to_world = mesh_io.matrix_array(Matrix(field.vertex_to_nodes(found, ob).tolist()))
    about = surface.changes, id(found), tolerance, to_world.tobytes()
    known = _shares.get(name)
    if known is None or known[0] != about:
        edges = [tolerance * k / 4 for k in range(-4, 5)]
        # Through the nodes, which is where the mesh is drawn.
        import numpy as np
        placement = np.linalg.inv(found.to_nodes) @ field.vertex_to_nodes(found, ob)
        vertices, triangles = surface.vertices, surface.triangles

        def finish(shares, error):
            if error is None and name in _surfaces:
                _shares[name] = about, shares
            _redraw()

        work.later(
            ("shares", name),
            _SHARES_EVERY if known else 0,
            lambda: lambda _progress: found.grid.shares(vertices, triangles, edges, placement),
            finish,
        )
    return known and known[1]


def _redraw():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def register():
    volume.listeners.append(refresh)


def unregister():
    volume.listeners.remove(refresh)
    _end()
