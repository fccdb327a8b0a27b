# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws over the 3D views what belongs to places of the active object: the crosses of *Worst Point*, the labels and what the
probe reads. One handler draws all of it, so that each box of text knows where the others are."""

import bpy

from ..proof import places, probing
from ..redraw import redraw_views
from . import labels, legend, markers, reasons
from .view_drawing import ViewDrawing


def refresh():
    """Adds the draw handler while there is anything to draw, and removes it afterwards."""
    if bpy.app.background:
        return
    wanted = places.any_shown() or probing.hover() is not None
    wanted = wanted or any(ob.type == "MESH" and ob.tolvol.labels for ob in bpy.data.objects)
    _drawing.show(wanted and not reasons.off())
    redraw_views()


def end():
    _drawing.end()


def _draw(context):
    page = legend.Page(context)
    taken = legend.adjusting(context)
    if box := legend.box(context.region):
        taken.append(box)
    if context.space_data.overlay.show_overlays:
        if place := markers.draw(context, page, taken):
            taken.append(place)
        labels.draw(context, page, taken)
    labels.draw_hover(context, page, probing.hover(), taken)


_drawing = ViewDrawing(_draw)
