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
    if places.any_shown() and not reasons.off():
        _drawing.show(True)
    else:
        end()
    redraw_views()


def end():
    _drawing.end()
    _boxes.clear()


def _draw(context):
    _boxes[context.region.as_pointer()] = None
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
        box, away = Box(page, described(context, ob)), 2 * _PRESENT_ARM * page.scale
        others = [other for other in (legend.box(context.region),) if other]
        place = box.beside(context, *spot, away, others) or box.beside(context, *spot, away)
        _boxes[context.region.as_pointer()] = place
        box.draw(place)


# Pointer of a region -> (left, bottom, width, height) of the box of the present place that was last drawn there.
_boxes = {}


def box(region):
    """Returns (left, bottom, width, height) of the box of the present place in a region, or None."""
    return _boxes.get(region.as_pointer())


_drawing = ViewDrawing(_draw)


def _cross(page, x, y, arm):
    scale = page.scale
    arm, gap = arm * scale, _GAP * scale
    for thick, colour in ((3 * scale, EDGE), (scale, INK)):
        for begin in (gap, -gap - arm):
            page.rectangle(x + begin, y - thick / 2, arm, thick, shaders.FLAT, colour)
            page.rectangle(x - thick / 2, y + begin, thick, arm, shaders.FLAT, colour)


class Box:
    """Lines of text that are to be drawn in a box beside a place of a 3D view."""

    def __init__(self, page, lines):
        self._page, self._lines = page, lines
        self._margin, self._row = _MARGIN * page.scale, _ROW * page.scale
        self.size = max(map(page.width, lines)) + 2 * self._margin, len(lines) * self._row + self._margin

    def beside(self, context, x, y, away, others=()):
        """Returns (left, bottom, width, height) beside a place, inside the view: lower where it would lie over the others.

        Returns None if there is no room for it. away: the distance from the place in pixels. others: (left, bottom, width,
        height) of boxes.
        """
        width, height = self.size
        left, bottom = x + away, y - height / 2
        if left + width > legend.free_part(context)[0]:
            left = x - away - width
        left, bottom = max(left, 0), min(max(bottom, 0), context.region.height - height)
        while covered := [other for other in others if _overlap((left, bottom, width, height), other)]:
            bottom = min(other[1] for other in covered) - height - self._page.scale
            if bottom < 0:
                return None
        return left, bottom, width, height

    def draw(self, place, faint=False):
        left, bottom, width, height = place
        page = self._page
        page.rectangle(left, bottom, width, height, shaders.FLAT, page.paper)
        for i, line in enumerate(self._lines):
            y = bottom + height - self._margin / 2 - (i + 0.5) * self._row
            page.text(left + self._margin, y, line, faint=faint or i > 0)
        gpu.state.blend_set("NONE")


def _overlap(one, other):
    """Whether two rectangles have an area in common."""
    return all(one[i] < other[i] + other[i + 2] and other[i] < one[i] + one[i + 2] for i in (0, 1))
