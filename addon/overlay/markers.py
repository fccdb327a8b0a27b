# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks the places of *Worst Point* in the 3D views: a cross at each, a larger one with a box of text at the present one."""

import gpu
from bpy_extras.view3d_utils import location_3d_to_region_2d

from ..proof import places
from . import legend, shaders

# Pixels at an interface scale of 1: the arms of a cross, the gap in its middle, and the distance of the box from it.
_ARM, _PRESENT_ARM, _GAP = 6, 16, 4
_ROW, _MARGIN = 17, 8
# A box that takes a larger share of the view shows no more than the number of the place.
_MUCH = 0.15
INK, EDGE = (1, 1, 1, 1), (0, 0, 0, 0.8)


def draw(context, page, taken):
    """Draws the places of the active object. Returns (left, bottom, width, height) of the box, or None if there is none.

    taken: rectangles of the same form that are covered. A cross that would touch one is left out, and the box lies over one
    only if it has no other room.
    """
    ob = context.active_object
    found, at, _ = places.shown(ob)
    if not found or not ob.visible_in_viewport_get(context.space_data):
        return None
    spots = [in_view(context, place.position) for place in found]
    for i, spot in enumerate(spots):
        if spot is not None:
            arm = (_PRESENT_ARM if i == at else _ARM) * page.scale
            around = spot[0] - arm, spot[1] - arm, 2 * arm, 2 * arm
            if not any(overlap(around, other) for other in taken):
                _cross(page, *spot, arm)
    if spots[at] is None:
        return None
    box = Box(page, places.described(context, ob))
    if box.covers_much(context):
        box = Box(page, [f"{at + 1} of {len(found)}"])
    return box.draw_beside(context, *spots[at], 2 * _PRESENT_ARM * page.scale, taken)


def in_view(context, position):
    """Returns where a place is drawn in the region, in pixels, or None if it is not in the region."""
    spot = location_3d_to_region_2d(context.region, context.region_data, position)
    if spot is None or not (0 <= spot[0] <= context.region.width and 0 <= spot[1] <= context.region.height):
        return None
    return spot


def _cross(page, x, y, arm):
    """Draws a cross with a gap in its middle. arm: the length of its arms in pixels."""
    scale = page.scale
    gap = _GAP * scale
    for thick, colour in ((3 * scale, EDGE), (scale, INK)):
        for begin in (gap, -gap - arm):
            page.rectangle(x + begin, y - thick / 2, arm, thick, shaders.FLAT, colour)
            page.rectangle(x - thick / 2, y + begin, thick, arm, shaders.FLAT, colour)


class Box:
    """Lines of text that are to be drawn in a box beside a place of a 3D view."""

    def __init__(self, page, lines):
        """The lines are cut where the free part of the view is not as wide."""
        self._page = page
        self._margin, self._row = _MARGIN * page.scale, _ROW * page.scale
        self._lines = [legend.shortened(line, page.room - 2 * self._margin) for line in lines]
        self.size = max(map(page.width, self._lines)) + 2 * self._margin, len(lines) * self._row + self._margin

    def covers_much(self, context):
        """Whether the box takes more than _MUCH of the free part of the view."""
        left, right, low = legend.free_part(context)
        return self.size[0] * self.size[1] > _MUCH * (right - left) * (context.region.height - low)

    def beside(self, context, x, y, away, others=()):
        """Returns (left, bottom, width, height) at the right or the left of a place, or else above or below it, in the free
        part of the view and not over the others; or at the first of these sides that has room, but lower.

        Returns None if there is no room for it. away: the distance from the place in pixels. others: (left, bottom, width,
        height) of boxes.
        """
        width, height = self.size
        least, right, low = legend.free_part(context)
        high = context.region.height
        if width > right - least or height > high - low:
            return None
        level, middle = y - height / 2, x - width / 2
        beside = [(left, level) for left in (x + away, x - away - width) if least <= left <= right - width]
        above = [(middle, bottom) for bottom in (y + away, y - away - height) if low <= bottom <= high - height]
        places = [
            (min(max(left, least), right - width), min(max(bottom, low), high - height), width, height)
            for left, bottom in beside + above or [(middle, level)]
        ]
        free = [place for place in places if not any(overlap(place, other) for other in others)]
        if free:
            return free[0]
        left, bottom, _, _ = places[0]
        while covered := [other for other in others if overlap((left, bottom, width, height), other)]:
            bottom = min(other[1] for other in covered) - height - self._page.scale
            if bottom < low:
                return None
        return left, bottom, width, height

    def draw_beside(self, context, x, y, away, others):
        """Draws the lines beside a place, over the others if there is no room elsewhere. Returns the rectangle, or None if the
        view is too small."""
        place = self.beside(context, x, y, away, others) or self.beside(context, x, y, away)
        if place:
            self.draw(place)
        return place

    def draw(self, place, faint=False):
        left, bottom, width, height = place
        page = self._page
        page.rectangle(left, bottom, width, height, shaders.FLAT, page.paper)
        for i, line in enumerate(self._lines):
            y = bottom + height - self._margin / 2 - (i + 0.5) * self._row
            page.text(left + self._margin, y, line, faint=faint or i > 0)
        gpu.state.blend_set("NONE")


def overlap(one, other):
    """Whether two rectangles have an area in common."""
    return all(one[i] < other[i] + other[i + 2] and other[i] < one[i] + one[i + 2] for i in (0, 1))
