# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the surfaces of the objects that show their deviation, and the legend of one of them, into the 3D views."""

import gpu
import numpy as np

from ..mesh import mesh_io
from ..proof import verdict
from ..redraw import redraw_views
from ..reference import measurements, tolerances
from ..units import typed
from . import field, legend, reasons, shaders, shares
from .scale import Scale

_STRIPE = 12  # pixels from one stripe to the next


def _in_view(context, names):
    """Returns the named objects that this 3D view shows with faces."""
    space = context.space_data
    if not space.overlay.show_overlays or space.shading.type == "WIREFRAME":
        return []
    depsgraph = context.evaluated_depsgraph_get()
    found = (context.view_layer.objects.get(name) for name in names)
    return [
        ob
        for ob in found
        if ob is not None
        and ob.display_type in {"SOLID", "TEXTURED"}
        and ob.evaluated_get(depsgraph).visible_in_viewport_get(space)
    ]


def _tolerance(ob):
    return tolerances.tolerance_length(ob.tolvol, ob.tolvol.snapshot_size)


def _signed(ob, tree):
    return ob.tolvol.deviation_kind == "SIGNED" and tree.closed


def scale_of(context, ob, tree):
    """Returns the Scale of the colours of `ob`."""
    settings, tolerance = ob.tolvol, _tolerance(ob)
    reach = tolerance
    if settings.deviation_range == "AUTOMATIC":
        reach = shares.automatic_reach(ob) or tolerance
    elif settings.deviation_range == "FIXED":
        reach = typed(settings.deviation_limit, context.scene.unit_settings)
    bands = settings.band_count if settings.use_bands else 0
    return Scale(tolerance, _signed(ob, tree), max(reach, field.finest(tree)), bands)


def _shares(ob, surface, found, scale):
    """Returns the shares of the bands of the present Scale, or None while they are not known."""
    automatic = ob.tolvol.deviation_range == "AUTOMATIC"
    return shares.known(ob, surface, found, scale, automatic, redraw_views)


def surfaces(context, shown):
    """Draws the surfaces of the objects in view. shown: {name of the object: Surface}."""
    objects = [ob for ob in _in_view(context, shown) if not reasons.hidden(ob)]
    if not objects:
        return
    depsgraph = context.evaluated_depsgraph_get()
    gpu.state.depth_test_set("LESS_EQUAL")
    # NEARER may let two layers pass the depth test at one pixel. Writing depths makes the nearer layer visible.
    gpu.state.depth_mask_set(True)
    gpu.state.blend_set("ALPHA")
    for ob in objects:
        surface = shown[ob.name]
        surface.update(ob, depsgraph)
        found, _ = field.field_of(ob, _tolerance(ob), redraw_views)
        if found is not None:
            _draw(context, ob, surface, found)
    gpu.state.blend_set("NONE")
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _draw(context, ob, surface, found):
    shading = context.space_data.shading
    x_ray = shading.type == "SOLID" and shading.show_xray
    to_frame = field.vertex_to_frame(found, ob)
    if ob.tolvol.deviation_range == "AUTOMATIC":
        _shares(ob, surface, found, scale_of(context, ob, found.tree))  # It finds the range.
    told = shaders.told(
        context.region_data.perspective_matrix,
        ob.matrix_world,
        to_frame,
        _eye(context.region_data, to_frame @ np.linalg.inv(mesh_io.matrix_array(ob.matrix_world))),
        _tolerance(ob) * found.tree.scale,
        found.leaves,
        scale_of(context, ob, found.tree),
        _STRIPE * context.preferences.system.ui_scale,
        ob.tolvol.deviation_opacity * (shading.xray_alpha if x_ray else 1),
    )
    shader = shaders.surface()
    shader.bind()
    shader.uniform_sampler("transfer", shaders.transfer(_signed(ob, found.tree)))
    found.bind(shader)
    shader.uniform_block("told", told)
    if x_ray:
        # In X-ray mode the depth buffer is empty. A first pass writes the depths, so that the second draws only the
        # nearest layer.
        gpu.state.color_mask_set(False, False, False, False)
        surface.draw(shader)
        gpu.state.color_mask_set(True, True, True, True)
    surface.draw(shader)
    if ob.mode == "EDIT" and not x_ray:
        # The coloured surface covers Blender's edges but not its vertices, so the edges are drawn again.
        theme = context.preferences.themes[0].view_3d
        shader = shaders.lines()
        shader.bind()
        shader.uniform_block("told", told)
        for selected, colour in ((False, theme.wire_edit), (True, theme.edge_select)):
            shader.uniform_float("flat_colour", (*colour, 1))
            surface.draw_edges(shader, selected)


def _eye(view, world_to_frame):
    """Returns the eye in the frame, (x, y, z, 1). A view without perspective has a direction instead, (x, y, z, 0)."""
    inverse = view.view_matrix.inverted()
    eye = (*inverse.translation, 1) if view.is_perspective else inverse.col[2]
    return world_to_frame @ np.array(eye)


def legend_of_one(context, shown):
    """Draws the legend of the active object if that is in view, else of another object."""
    quarters = context.space_data.region_quadviews
    objects = _in_view(context, shown)
    if not objects or (quarters and context.region_data != quarters[-1]):
        return
    ob = context.active_object if context.active_object in objects else objects[0]
    found, reason = None, reasons.hidden(ob)
    if not reason:
        found, reason = field.field_of(ob, _tolerance(ob), redraw_views)
    heading = f"Deviation of {ob.name}"
    if found is None:
        legend.draw_note(context, f"{heading}: {reason}. {verdict.word(ob)}")
        return
    scale = scale_of(context, ob, found.tree)
    bands = _shares(ob, shown[ob.name], found, scale)
    legend.draw(context, heading, note(ob), verdict.word(ob), scale, bands)


def note(ob):
    """Returns the note below the legend, which says that the colours prove nothing.

    In Sculpt Mode the colours show the stored mesh, without the modifiers that deform it afterwards.
    """
    on_top, how = measurements.on_top(ob), "with"
    if ob.mode == "SCULPT":
        on_top, how = [name for name in on_top if name == "modifiers"], "without"
    return f"Colours {how} its {' and '.join(on_top)}, not proved" if on_top else "Colours not proved"
