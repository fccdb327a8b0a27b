# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the legend that explains the colours, in a corner of the 3D view."""

import blf
import gpu

from ..shared.numbers import NO_BREAK
from ..shared.proof.verdict import FAIL, NOT_CHECKED, PASS
from ..units import length
from . import shaders, square

# Blender's own font has this number.
_FONT = 0
# The verdict is written in so many points, all other text in fewer.
_LARGE, _POINTS = 20, 11
# All further sizes are in pixels at an interface scale of 1. The bar of colours is so wide and, without bands, so high.
_BAR = 14, 132
# The bars of the histogram are at most so long.
_BINS_WIDTH = 44
# Lines of text follow one another at this distance, and bands at least at the second one.
_ROW, _BAND_ROW = 17, 15
# There is so much space between the parts of the legend and around them, and between the legend and the edges of the view.
_GAP, _MARGIN = 10, 14
_LEAST_ROOM = 65  # in which the verdict has room in small letters
_LEAST_MARGIN = 4  # around the verdict where it has hardly room
# Stripes follow one another at this distance.
_STRIPE = 12
# The line with the verdict is so high, and the coloured square beside the verdict so wide.
_WORD, _MARK = 30, 16
# The heading makes the legend at most so wide. The name of an object in it may have 63 letters.
_HEADING = 240
# The legend has room in a view of which it takes at most these shares of the width and the height.
_MOST_WIDTH, _MOST_HEIGHT = 0.5, 0.75
# The colours of Blender's icons in the panel. The word beside them says the same without colours.
_COLOURS = {PASS: (0.47, 0.8, 0.43), FAIL: (0.88, 0.38, 0.35), NOT_CHECKED: (0.6, 0.6, 0.6)}


def free():
    _boxes.clear()


class Page:
    """Draws rectangles and text. Coordinates are in pixels of the region, with y upwards."""

    def __init__(self, context, signed=True, palette="SAFE"):
        self.scale = context.preferences.system.ui_scale
        self.region = context.region.width, context.region.height
        left, right, _ = free_part(context)
        self.room = right - left  # in which a line of text has to fit
        theme = context.preferences.themes[0].user_interface.wcol_tooltip
        self.ink, self.paper = tuple(theme.text), tuple(theme.inner)
        self.signed, self.palette = signed, palette
        blf.size(_FONT, _POINTS * self.scale)

    def rectangle(self, x, y, width, height, kind, colour=(0, 0, 0, 0), bands=0):
        shader = shaders.legend()
        shader.bind()
        shader.uniform_sampler("transfer", shaders.transfer(self.signed, self.palette))
        corners = [2 * at / size - 1 for at, size in zip((x, y, x + width, y + height), self.region * 2)]
        shader.uniform_float("corners", corners)
        shader.uniform_float("flat_colour", colour)
        detail = bands if kind == shaders.BAR else _STRIPE * self.scale
        shader.uniform_float("fill", (kind, shaders.lowest(self.signed), detail))
        gpu.state.blend_set("ALPHA")
        square.unit().draw(shader)
        gpu.state.blend_set("NONE")

    def text(self, x, y, text, faint=False, points=_POINTS):
        """Draws a line of text. `y` is the middle of its lower-case letters."""
        blf.size(_FONT, points * self.scale)
        blf.color(_FONT, *self.ink, 0.6 if faint else 1.0)
        blf.position(_FONT, x, y - blf.dimensions(_FONT, "x")[1] / 2, 0)
        blf.draw(_FONT, text)
        blf.size(_FONT, _POINTS * self.scale)

    def width(self, text, points=_POINTS):
        blf.size(_FONT, points * self.scale)
        width = blf.dimensions(_FONT, text)[0]
        blf.size(_FONT, _POINTS * self.scale)
        return width


def width_of(text):
    return blf.dimensions(_FONT, text)[0]


def shortened(text, room):
    """Returns as many letters of a text as fit with an ellipsis behind them, or the whole text if that fits."""
    if width_of(text) <= room:
        return text
    while text and width_of(f"{text}\u2026") > room:
        text = text[:-1].rstrip()
    return f"{text}\u2026"


def draw(context, heading, note, word, of, colours, shares, palette):
    """Draws the legend.

    heading: the top line. If it is long, its end is left out.
    note: the lowest line.
    word: the verdict, in large letters on top; of: what the verdict is of, beside it, if it is not of what is coloured.
    colours: the Scale.
    shares: the Shares, or None while they are not known.

    Where the rows of many bands have no room, their shares are left out. Where the legend has no room, it is the word alone.
    """
    page = Page(context, colours.signed, palette)
    scale = page.scale
    texts = [""] * (colours.counted + 1)
    if shares is not None:
        texts = [percent(share) for share in (*shares.bands, shares.outside)]
    for rows in (texts[:-1], []):
        bar_height = max(_BAR[1], len(rows) * _BAND_ROW) * scale
        labels = _labels(context, colours, _ROW * scale / bar_height)
        bar_width, bins_width = _BAR[0] * scale, _BINS_WIDTH * scale
        row, gap = _ROW * scale, _GAP * scale
        label_width = max([width_of(text) for _, text in labels] + [width_of("Outside")])
        share_width = max(width_of(text) for text in [*texts, "88.8 %"])
        columns = bins_width + bar_width + label_width + share_width + 2 * gap
        width = max(columns, min(width_of(heading), _HEADING * scale), width_of(note)) + 2 * gap
        width = max(width, page.width(word, _LARGE) + _MARK * scale + 3 * gap + (width_of(of) + gap if of else 0))
        height = 3 * row + _WORD * scale + bar_height + 4 * gap
        place = _place(context, width, height, scale)
        if place is not None or len(rows) * _BAND_ROW <= _BAR[1]:
            break
    if place is None:
        _draw_word(context, page, word)
        return
    left, bottom = place
    _paper(context, page, left, bottom, width, height)
    x, y = left + gap + bins_width, bottom + gap + row / 2
    label_x, right = x + bar_width + gap, left + width - gap
    page.text(left + gap, y, note, faint=True)
    y += row
    page.rectangle(x, y - bar_width / 2, bar_width, bar_width, shaders.STRIPES)
    page.text(label_x, y, "Outside")
    page.text(right - width_of(texts[-1]), y, texts[-1])
    y += row / 2 + gap
    page.rectangle(x, y, bar_width, bar_height, shaders.BAR, bands=colours.bands)
    if shares is not None:
        _draw_histogram(page, x, y, bins_width, bar_height, shares.histogram)
    for part, text in labels:
        at = y + part * bar_height
        page.rectangle(x + bar_width, at - scale / 2, 4 * scale, scale, shaders.FLAT, (*page.ink, 1))
        page.text(label_x, at, text)
    for i, text in enumerate(rows):
        page.text(right - width_of(text), y + (i + 0.5) / len(rows) * bar_height, text, faint=True)
    top = bottom + height - gap
    page.text(left + gap, top - row / 2, shortened(heading, width - 2 * gap))
    at, mark = top - row - _WORD * scale / 2, _MARK * scale
    page.rectangle(left + gap, at - mark / 2, mark, mark, shaders.FLAT, (*_COLOURS[word], 1))
    page.text(left + mark + 2 * gap, at, word, points=_LARGE)
    page.text(left + mark + 3 * gap + page.width(word, _LARGE), at, of, faint=True)


def _draw_histogram(page, x, y, width, height, histogram):
    """Draws the bins beside the bar of colours, at the height of their distances. They grow to the left, from x on."""
    most = max(histogram)
    for i, share in enumerate(histogram):
        if share > 0:
            # What is there has to be seen, be it little.
            long = max(share / most * (width - 2 * page.scale), page.scale)
            at, step = y + i / len(histogram) * height, height / len(histogram)
            page.rectangle(x - 2 * page.scale - long, at, long, step, shaders.FLAT, (*page.ink, 0.5))


def _labels(context, colours, row):
    """Returns the labels of the bar as [(their height as a share of the bar, text)].

    row: the height of a line as a share of the bar. The tolerance is marked where it is not at the end of the bar.
    """
    lowest, span = colours.lowest, colours.reach - colours.lowest
    found = {part: _label(context, lowest + part * span, colours.signed) for part in (0, 0.5, 1)}
    if colours.coloured_beyond:
        for value in (-colours.tolerance, colours.tolerance) if colours.signed else (colours.tolerance,):
            part = (value - lowest) / span
            text = f"{_label(context, value, colours.signed)} (tolerance)"
            if not colours.signed and abs(part - 0.5) < row:
                del found[0.5]  # The middle of a range means less than the tolerance.
            # Beside the end of the range, or beside 0, the mark stands without its text.
            found[part] = text if min(abs(part - other) for other in found) >= row else ""
    return list(found.items())


def _place(context, width, height, scale):
    """Returns left and bottom of the legend, or None if it would take too much of the view."""
    left, right, low = free_part(context)
    if width > _MOST_WIDTH * (right - left) or height > _MOST_HEIGHT * (context.region.height - low):
        return None
    return _corner(context, width, height, _MARGIN * scale)


def _draw_word(context, page, word):
    """Draws the verdict alone where the legend has no room: in large letters, or else in small ones."""
    for points, margin in ((_LARGE, _MARGIN), (_POINTS, _LEAST_MARGIN)):
        size = page.scale * points / _LARGE
        gap, mark = _GAP * size, _MARK * size
        width, height = page.width(word, points) + mark + 3 * gap, _WORD * size
        if place := _corner(context, width, height, margin * size):
            _paper(context, page, *place, width, height)
            x, y = place[0] + gap, place[1] + height / 2
            page.rectangle(x, y - mark / 2, mark, mark, shaders.FLAT, (*_COLOURS[word], 1))
            page.text(x + mark + gap, y, word, points=points)
            return


def draw_note(context, text, word):
    """Draws one line of text and the verdict in place of the legend, or where they have no room, the verdict alone."""
    page = Page(context)
    gap, line = _GAP * page.scale, f"{text}. {word}"
    width, height = width_of(line) + 2 * gap, _ROW * page.scale + gap
    if place := _corner(context, width, height, _MARGIN * page.scale):
        _paper(context, page, *place, width, height)
        page.text(place[0] + gap, place[1] + height / 2, line)
    else:
        _draw_word(context, page, word)


def _label(context, value, signed):
    if value == 0:
        return "0"
    sign = "" if not signed else "+" if value > 0 else "\u2212"
    return sign + length(context, abs(value))


def percent(share):
    """Returns a share as text. A share above 0 is never shown as 0.0 %, and one below 1 never as 100.0 %."""
    percent = 100 * round(share, 9)  # A sum of shares has rounding errors.
    if 0 < percent < 0.1:
        return f"<{NO_BREAK}0.1{NO_BREAK}%"
    if 99.9 < percent < 100:
        return f">{NO_BREAK}99.9{NO_BREAK}%"
    return f"{percent:.1f}{NO_BREAK}%"


def free_part(context, region=None):
    """Returns (left, right, bottom): the edges, in pixels of the region, of the part of the view that neither the toolbar, nor
    the sidebar, nor a region at the bottom covers. region: that of the context if it is None."""
    region = region or context.region
    left, right, bottom = 0, region.width, 0
    for other in context.area.regions:
        if other == region or other.width <= 1 or other.height <= 1:
            continue
        if other.alignment == "RIGHT" and other.type in {"UI", "TOOLS"}:
            right = min(right, other.x - region.x)
        elif other.alignment == "LEFT" and other.type in {"UI", "TOOLS"}:
            left = max(left, other.x + other.width - region.x)
        elif other.alignment == "BOTTOM" and other.y <= region.y + bottom:
            bottom = max(bottom, other.y + other.height - region.y)
    return left, right, bottom


def belongs_here(context):
    """Whether the legend belongs into this region: a quad view has one legend, in its upper right quarter, or in another one
    if the sidebar covers that."""
    quarters = [region for region in context.area.regions if region.type == "WINDOW"]

    def worth(region):
        left, right, _ = free_part(context, region)
        return min(right - left, _LEAST_ROOM * context.preferences.system.ui_scale), region.x + region.y

    return context.region == max(quarters, key=worth)


def adjusting(context):
    """Returns (left, bottom, width, height) of each panel of *Adjust Last Operation* over the view, in pixels of the region."""
    region = context.region
    return [
        (other.x - region.x, other.y - region.y, other.width, other.height)
        for other in context.area.regions
        if other.type == "HUD" and other.width > 1 and other.height > 1
    ]


# Pointer of a 3D view -> where the user has put its legend: the share of the free way from the left and from below.
_moved = {}
# Pointer of a region -> (left, bottom, width, height) of the legend that was last drawn there.
_boxes = {}


def _paper(context, page, left, bottom, width, height):
    page.rectangle(left, bottom, width, height, shaders.FLAT, page.paper)
    _boxes[context.region.as_pointer()] = left, bottom, width, height


def box(region):
    """Returns (left, bottom, width, height) of the legend in a region, or None."""
    return _boxes.get(region.as_pointer())


def reaches(box, spot, clear):
    """Whether a legend comes nearer to a spot of the region, along both axes, than `clear` pixels. box: as box() returns it."""
    left, bottom, width, height = box
    return left - clear < spot[0] < left + width + clear and bottom - clear < spot[1] < bottom + height + clear


def forget_box(region):
    """Notes that a region is about to be drawn anew: it may have no legend then."""
    _boxes[region.as_pointer()] = None


def any_drawn():
    """Whether regions are drawn that may have a legend."""
    return bool(_boxes)


def move(context, left, bottom):
    """Puts the legend of a 3D view to a place, or as near to it as it stays in the free part of the view."""
    _, _, width, height = box(context.region)
    low, room = _room(context, width, height, _MARGIN * context.preferences.system.ui_scale)
    shares = [(at - least) / free if free > 0 else 0 for at, least, free in zip((left, bottom), low, room)]
    _moved[context.space_data.as_pointer()] = tuple(min(max(share, 0), 1) for share in shares)


def moved(context):
    """Returns where the user has put the legend of a 3D view, for move_back(), or None."""
    return _moved.get(context.space_data.as_pointer())


def move_back(context, place):
    """Puts the legend of a 3D view to a place that moved() has returned."""
    if place is None:
        _moved.pop(context.space_data.as_pointer(), None)
    else:
        _moved[context.space_data.as_pointer()] = place


def forget_moved():
    """Brings the legends of all views back to their first places."""
    _moved.clear()


def _room(context, width, height, margin):
    """Returns the least left and bottom that a box may have in the free part of the view, and how far it may go from there."""
    left, right, low = free_part(context)
    room = right - left - width - 2 * margin, context.region.height - low - height - 2 * margin
    return (left + margin, low + margin), room


def _corner(context, width, height, margin):
    """Returns left and bottom of a box where the user has put it, or else in the lower right corner of the free part of the
    view.

    Returns None if there is no room for the box.
    """
    low, room = _room(context, width, height, margin)
    if min(room) < 0:
        return None
    if place := moved(context):
        return tuple(least + share * free for least, share, free in zip(low, place, room))
    left, bottom = low[0] + room[0], low[1]
    for x, y, other_width, other_height in adjusting(context):
        if x + other_width > left:
            bottom = max(bottom, y + other_height)
    return (left, bottom) if bottom <= low[1] + room[1] else None
