# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the labels of the active object into the 3D views, and beside the mouse what the probe reads."""

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d

from ..operators.probe import described, distance_text, tolerance_of
from ..proof import labels, probing
from ..redraw import redraw_views
from ..shared.proof import report
from . import legend, markers, reasons, shaders
from .view_drawing import ViewDrawing

# Pixels at an interface scale of 1.
_DOT, _BESIDE = 6, 14


def refresh():
    """Adds the draw handler while an object has labels or the probe is at work, and removes it afterwards."""
    if bpy.app.background:
        return
    wanted = probing.hover() is not None or any(ob.type == "MESH" and ob.tolvol.labels for ob in bpy.data.objects)
    _drawing.show(wanted and not reasons.off())
    redraw_views()


def end():
    _drawing.end()


def _draw(context):
    page = legend.Page(context)
    if context.space_data.overlay.show_overlays:
        _draw_labels(context, page, context.active_object)
    _draw_hover(context, page, probing.hover())


_drawing = ViewDrawing(_draw)


def _draw_labels(context, page, ob):
    if ob is None or ob.type != "MESH" or not ob.tolvol.labels or not ob.visible_in_viewport_get(context.space_data):
        return
    settings = ob.tolvol
    taken = [box for box in (legend.box(context.region), markers.box(context.region)) if box]
    # The chosen label comes first, so that the others make room for it.
    for i in sorted(range(len(settings.labels)), key=lambda i: i != settings.label_index):
        label = settings.labels[i]
        found, true = labels.reading(ob, label), labels.current(ob, label)
        spot = location_3d_to_region_2d(context.region, context.region_data, found.position)
        if spot is None:
            continue
        if not true:
            lines = [f"{i + 1}: {distance_text(context, found)}, out of date"]
        elif i == settings.label_index:
            lines = described(context, ob, found)
            lines[0] = f"{i + 1}: {lines[0]}"
        else:
            share = report.percent(found.distance, tolerance_of(ob))
            lines = [f"{i + 1}: {distance_text(context, found)}, {share}"]
        _dot(page, *spot)
        # Where the lines have no room, the number alone is drawn, and where that has none, the dot.
        for box in (markers.Box(page, lines), markers.Box(page, [f"{i + 1}"])):
            if place := box.beside(context, *spot, _BESIDE * page.scale, taken):
                box.draw(place, faint=not true)
                taken.append(place)
                break


def _draw_hover(context, page, hover):
    if hover is None or hover.region != context.region.as_pointer() or not hover.lines:
        return
    if hover.position is not None:
        spot = location_3d_to_region_2d(context.region, context.region_data, hover.position)
        if spot is not None:
            _dot(page, *spot)
    box = markers.Box(page, hover.lines)
    box.draw(box.beside(context, *hover.mouse, 2 * _BESIDE * page.scale))


def _dot(page, x, y):
    for size, colour in ((_DOT + 2, markers.EDGE), (_DOT, markers.INK)):
        size *= page.scale
        page.rectangle(x - size / 2, y - size / 2, size, size, shaders.FLAT, colour)
