# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the labels of the active object into the 3D views, and beside the mouse what the probe reads."""

from ..operators.probe import described, distance_text, tolerance_of
from ..proof import labels
from ..shared.proof import report
from . import markers, shaders

# Pixels at an interface scale of 1.
_DOT, _BESIDE = 6, 14


def draw(context, page, taken):
    """Draws the labels of the active object where there is room.

    taken: (left, bottom, width, height) of what is drawn already. The rectangles of the labels are added.
    """
    ob = context.active_object
    if ob is None or ob.type != "MESH" or not ob.tolvol.labels or not ob.visible_in_viewport_get(context.space_data):
        return
    settings = ob.tolvol
    # The chosen label comes first, so that the others make room for it.
    for i in sorted(range(len(settings.labels)), key=lambda i: i != settings.label_index):
        label = settings.labels[i]
        found, true = labels.reading(ob, label), labels.current(ob, label)
        spot = markers.in_view(context, found.position)
        if spot is None:
            continue
        if not true:
            why = "out of date" if ob.mode == "OBJECT" else "not compared in this mode"
            lines = [f"{i + 1}: {distance_text(context, found)}, {why}"]
        elif i == settings.label_index:
            lines = described(context, ob, found)
            lines[0] = f"{i + 1}: {lines[0]}"
        else:
            share = report.percent(found.distance, tolerance_of(ob))
            lines = [f"{i + 1}: {distance_text(context, found)}, {share}"]
        _dot(page, *spot, taken)
        # Where the lines have no room, the number alone is drawn, and where that has none, the dot.
        for box in (markers.Box(page, lines), markers.Box(page, [f"{i + 1}"])):
            if place := box.beside(context, *spot, _BESIDE * page.scale, taken):
                box.draw(place, faint=not true)
                taken.append(place)
                break


def draw_hover(context, page, hover, taken):
    """Draws what the probe reads under the mouse. hover: that reading, or None; taken: as for draw()."""
    if hover is None or hover.region != context.region.as_pointer() or not hover.lines:
        return
    if hover.position is not None:
        spot = markers.in_view(context, hover.position)
        if spot is not None:
            _dot(page, *spot, taken)
    markers.Box(page, hover.lines).draw_beside(context, *hover.mouse, 2 * _BESIDE * page.scale, taken)


def _dot(page, x, y, taken):
    """Draws a dot at a place, unless it would cover text there."""
    reach = _DOT / 2 * page.scale
    if any(markers.overlap((x - reach, y - reach, 2 * reach, 2 * reach), other) for other in taken):
        return
    for size, colour in ((_DOT + 2, markers.EDGE), (_DOT, markers.INK)):
        size *= page.scale
        page.rectangle(x - size / 2, y - size / 2, size, size, shaders.FLAT, colour)
