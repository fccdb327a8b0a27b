# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks the places of *Worst Point* in the 3D views: a cross at each, a larger one with a label at the present one."""

import bpy
import gpu
from bpy_extras.view3d_utils import location_3d_to_region_2d

from ..operators.places import described
from ..proof import places
from ..redraw import redraw_views
from . import legend, reasons, shaders
from .view_drawing import ViewDrawing

# Pixels at an interface scale of 1: the arms of a cross, the gap in its middle, and the label's distance from it.
_ARM, _PRESENT_ARM, _GAP = 6, 16, 4
_ROW, _MARGIN = 17, 8
INK, EDGE = (1, 1, 1, 1), (0, 0, 0, 0.8)


def refresh():
    """Adds the draw handler while there are places, and removes it afterwards."""
    if bpy.app.background:
        return
    _drawing.show(places.any_shown() and not reasons.off())
    redraw_views()


def end():
    _drawing.end()


def _draw(context):
    ob = context.active_object
    found, at, _ = places.shown(ob)
    if not found or not context.space_data.overlay.show_overlays or not ob.visible_in_viewport_get(context.space_data):
        return
    page = legend.Page(context)
    for i, place in enumerate(found):
        spot = location_3d_to_region_2d(context.region, context.region_data, place.position)
        if spot is not None:
            _cross(page, *spot, _PRESENT_ARM if i == at else _ARM)
    spot = location_3d_to_region_2d(context.region, context.region_data, found[at].position)
    if spot is not None:
        beside(page, context, *spot, described(context, ob), 2 * _PRESENT_ARM * page.scale)


_drawing = ViewDrawing(_draw)


def _cross(page, x, y, arm):
    scale = page.scale
    arm, gap = arm * scale, _GAP * scale
    for thick, colour in ((3 * scale, EDGE), (scale, INK)):
        for begin in (gap, -gap - arm):
            page.rectangle(x + begin, y - thick / 2, arm, thick, shaders.FLAT, colour)
            page.rectangle(x - thick / 2, y + begin, thick, arm, shaders.FLAT, colour)


def beside(page, context, x, y, lines, away, faint=False):
    """Draws lines of text in a box beside a place, inside the view. away: the gap between them in pixels."""
    scale = page.scale
    margin, row = _MARGIN * scale, _ROW * scale
    width, height = max(map(page.width, lines)) + 2 * margin, len(lines) * row + margin
    left, bottom = x + away, y - height / 2
    if left + width > legend.free_part(context)[0]:
        left = x - away - width
    left, bottom = max(left, 0), min(max(bottom, 0), context.region.height - height)
    page.rectangle(left, bottom, width, height, shaders.FLAT, page.paper)
    for i, line in enumerate(lines):
        page.text(left + margin, bottom + height - margin / 2 - (i + 0.5) * row, line, faint=faint or i > 0)
    gpu.state.blend_set("NONE")
