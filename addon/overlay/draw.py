# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the surfaces of the objects that show their deviation, and the legend of one of them, into the 3D views."""

from dataclasses import dataclass, replace

import gpu
import numpy as np

from ..proof import verdict
from ..reference import measurements
from ..units import typed
from . import coloured, field, geometry_buffer, legend, reasons, shaders, shares, square
from .coloured import Coloured, tolerance_of
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


@dataclass(frozen=True)
class Drawn:
    """What is drawn of an object, and how."""

    what: Coloured
    scale: Scale
    palette: str


def _scale_of(context, ob, what, settings):
    """Returns the Scale of a Coloured alone. settings: those of the object that chooses range and bands."""
    reach = tolerance = tolerance_of(ob)
    if settings.deviation_range == "AUTOMATIC":
        reach = shares.automatic_reach(ob.name, what) or 0.0
    elif settings.deviation_range == "FIXED":
        reach = typed(settings.deviation_limit, context.scene.unit_settings)
    bands = settings.band_count if settings.use_bands else 0
    return Scale(tolerance, what.signed, reach, bands)


def with_scales(context, found):
    """Returns {object: Drawn} for {object: Coloured}. Selected objects get one scale, as the active one of them demands."""
    selected = [ob for ob in found if ob.select_get()]
    leader = context.active_object if context.active_object in selected else None
    groups = [[ob] for ob in found if not leader or ob not in selected] + ([selected] if leader else [])
    drawn = {}
    for group in groups:
        settings = (leader if leader in group else group[0]).tolvol
        scales = [_scale_of(context, ob, found[ob], settings) for ob in group]
        # Where nothing deviates, an automatic range ends at the tolerance.
        reach = max(scale.reach for scale in scales) or max(scale.tolerance for scale in scales)
        reach = max(reach, *(field.finest(found[ob].tree) for ob in group))
        signed = all(scale.signed for scale in scales)
        for ob, scale in zip(group, scales):
            drawn[ob] = Drawn(found[ob], replace(scale, reach=reach, signed=signed), settings.deviation_palette)
    return drawn


def _drawn(context, shown):
    """Returns ({object: Drawn} of the objects in view, {object: why nothing is drawn of it}). shown: {name: Surface}."""
    found, missing = {}, {}
    for ob in _in_view(context, shown):
        reason = reasons.hidden(ob)
        if not reason:
            shown[ob.name].update(ob, context.evaluated_depsgraph_get())
            found[ob], reason = coloured.of(ob, shown[ob.name])
        if reason:
            found.pop(ob, None)
            missing[ob] = reason
    return with_scales(context, found), missing


def surfaces(context, shown):
    """Draws the surfaces of the objects in view. shown: {name of the object: Surface}."""
    drawn, _ = _drawn(context, shown)
    if not drawn:
        return
    # Of two objects at one pixel, the nearer one is visible.
    gpu.state.depth_mask_set(True)
    references = [ob for ob in drawn if coloured.is_reference(ob)]
    try:
        for ob in drawn.keys() - set(references):
            _draw(context, ob, drawn[ob])
        if references:
            # The mesh, which lies about where the reference is, would cover parts of it: references are drawn over
            # everything.
            gpu.state.active_framebuffer_get().clear(depth=1.0)
        for ob in references:
            _draw(context, ob, drawn[ob])
    finally:
        gpu.state.blend_set("NONE")
        gpu.state.depth_mask_set(False)
        gpu.state.depth_test_set("NONE")


def _draw(context, ob, drawn):
    what, shading = drawn.what, context.space_data.shading
    x_ray = shading.type == "SOLID" and shading.show_xray
    told = shaders.told(
        context.region_data.perspective_matrix,
        what.model,
        _eye(context.region_data, what.to_frame @ np.linalg.inv(what.model)),
        drawn.scale.tolerance * what.tree.scale,
        what.field.leaves,
        drawn.scale,
        _STRIPE * context.preferences.system.ui_scale,
        ob.tolvol.deviation_opacity * (shading.xray_alpha if x_ray else 1),
    )
    buffer = geometry_buffer.of_size(gpu.state.viewport_get()[2:])
    _fill(buffer, drawn, told)
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.blend_set("ALPHA")
    shader = shaders.surface()
    shader.bind()
    for name in ("colours", "depths"):
        shader.uniform_sampler(name, getattr(buffer, name))
    shader.uniform_block("told", told)
    square.unit().draw(shader)
    if ob.mode == "EDIT" and not x_ray and not coloured.is_reference(ob):
        # The coloured surface covers Blender's edges but not its vertices, so the edges are drawn again.
        theme = context.preferences.themes[0].view_3d
        shader = shaders.lines()
        shader.bind()
        shader.uniform_block("told", told)
        for selected, colour in ((False, theme.wire_edit), (True, theme.edge_select)):
            shader.uniform_float("flat_colour", (*colour, 1))
            what.triangles.draw_edges(shader, what.to_frame, selected)


def _fill(buffer, drawn, told):
    """Draws a surface into a geometry buffer, and computes the colours of its pixels."""
    what = drawn.what
    gpu.state.blend_set("NONE")
    with buffer.of_places.bind():
        buffer.of_places.clear(color=(0, 0, 0, 0), depth=1)
        gpu.state.depth_test_set("LESS_EQUAL")
        shader = shaders.geometry()
        shader.bind()
        shader.uniform_block("told", told)
        what.triangles.draw(shader, what.to_frame)
    gpu.state.depth_test_set("NONE")
    with buffer.of_colours.bind():
        shader = shaders.colours()
        shader.bind()
        shader.uniform_sampler("transfer", shaders.transfer(drawn.scale.signed, drawn.palette))
        shader.uniform_sampler("places", buffer.places)
        what.field.bind(shader)
        shader.uniform_block("told", told)
        square.unit().draw(shader)


def _eye(view, world_to_frame):
    """Returns the eye in the frame, (x, y, z, 1). A view without perspective has a direction instead, (x, y, z, 0)."""
    inverse = view.view_matrix.inverted()
    eye = (*inverse.translation, 1) if view.is_perspective else inverse.col[2]
    return world_to_frame @ np.array(eye)


def legend_of_one(context, shown):
    """Draws the legend of the active object if that is in view, else of another object. Selected objects have one legend."""
    legend.forget_box(context.region)
    if not legend.belongs_here(context):
        return
    drawn, missing = _drawn(context, shown)
    objects = [*drawn, *missing]
    if not objects:
        return
    ob = context.active_object if context.active_object in objects else objects[0]
    of_reference = "the reference of " if coloured.is_reference(ob) else ""
    if ob in missing:
        legend.draw_note(context, f"Deviation of {of_reference}{ob.name}: {missing[ob]}", verdict.word(ob))
        return
    together = [other for other in drawn if other.select_get()] if ob.select_get() else [ob]
    scale = drawn[ob].scale
    counted = shares.together(shares.known(other.name, drawn[other].what, drawn[other].scale) for other in together)
    if len(together) == 1:
        heading, below = f"Deviation of {of_reference}{ob.name}", note(ob)
    else:
        heading, below = f"Deviation of {len(together)} objects", "Colours not proved"
        if any(drawn[other].scale.tolerance != scale.tolerance for other in together):
            scale = replace(scale, tolerance=scale.reach)  # There is no one tolerance to be marked.
    if not all(drawn[other].what.present for other in together):
        below, counted = "Colours of before the last change", None
    word = verdict.together(verdict.word(other) for other in together)
    legend.draw(context, heading, below, word, judged(context, together), scale, counted, drawn[ob].palette)


def judged(context, objects):
    """Returns words for the legend that say what its verdict is about, or "" if it is about the coloured surface and the
    active object."""
    active, words = context.active_object, []
    if active is not None and active.type == "MESH" and active not in objects:
        words.append("of another object" if len(objects) == 1 else "of other objects")
    names = [name for ob in objects if ob.mode != "SCULPT" for name in measurements.on_top(ob)]
    if names:
        words.append(f"without {' and '.join(dict.fromkeys(names))}")
    return ", ".join(words)


def note(ob):
    """Returns the note below the legend, which says that the colours prove nothing.

    In Sculpt Mode the colours show the stored mesh, without the modifiers that deform it afterwards.
    """
    on_top, how = measurements.on_top(ob), "with"
    if ob.mode == "SCULPT":
        on_top, how = [name for name in on_top if name == "modifiers"], "without"
    return f"Colours {how} its {' and '.join(on_top)}, not proved" if on_top else "Colours not proved"
