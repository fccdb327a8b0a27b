# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses, breaks and shortens text so that it fits the region that is drawn: the sidebar, or the preferences."""

import re
import textwrap

import blf
import bpy

_FONT = 0  # Blender's own
# Pixels of the region's width that tabs, margins and the icon take from the text of a label.
_BESIDE_TEXT = 85
# Pixels that tabs and margins take from the width of a box, and that a label takes from its text.
_BESIDE_BOX, _BESIDE_LABEL = 64, 4
# A line may end after a space, and after a part of a path.
_PIECES = re.compile(r"[^ /\\]+[ /\\]*|[ /\\]+")


def _measures(context):
    """Sets the font of the panels. Returns the width of the region in pixels, and the scale of the interface."""
    scale = context.preferences.system.ui_scale
    blf.size(_FONT, context.preferences.ui_styles[0].widget.points * scale)
    return max(context.region.width, 100), scale


def _room(context):
    """Sets the font of the panels. Returns how many pixels a text may be wide."""
    width, scale = _measures(context)
    return width - _BESIDE_TEXT * scale


def _room_in_box(context, share):
    """Sets the font of the panels. Returns how many pixels a text may be wide that has this share of a box's width."""
    width, scale = _measures(context)
    return share * (width - _BESIDE_BOX * scale) - _BESIDE_LABEL * scale


def _width(text):
    return blf.dimensions(_FONT, text)[0]


def fitting(context, *texts, share=None):
    """Returns the first of the texts that fits the region, or the last.

    share: the part of a box's width that is for the text, if a name stands beside it.
    """
    room = _room(context) if share is None else _room_in_box(context, share)
    return next((text for text in texts if _width(text) <= room), texts[-1])


def wrapped(context, text, most=None):
    """Returns the text as lines that fit the region. most: so many lines at most; the last one then ends in an ellipsis."""
    room, lines = _room(context), [""]
    for piece in _PIECES.findall(text):
        if lines[-1] and _width((lines[-1] + piece).rstrip()) > room:
            lines.append("")
        if len(lines) - 1 == most:
            lines = lines[:most]
            lines[-1] = _shortened(lines[-1], room)
            break
        lines[-1] += piece
    return [line.rstrip() for line in lines]


def _shortened(line, room):
    """Returns as many words of a line as fit with an ellipsis behind them, at least one."""
    words = line.split()
    while len(words) > 1 and _width(" ".join(words) + "\u2026") > room:
        words.pop()
    return " ".join(words).rstrip(".,:;") + "\u2026"


_BESIDE_FIELD = 0.4  # the share of the width that Blender gives to the name of a property beside its field
# Pixels that the arrow of a menu takes from the choice beside it, and a box to be ticked from its text.
_ARROW, _TICK = 16, 22


def _fits_field(context, text, taken):
    """Whether a text has room in a field beside a name. taken: pixels of the field that are for something else."""
    room = _room_in_box(context, 1 - _BESIDE_FIELD) - taken * context.preferences.system.ui_scale
    return _width(text) <= room


def fits_tick(context, text):
    """Whether the text of a box to be ticked has room beside the name of a row."""
    return _fits_field(context, text, _TICK)


def _fits(context, known):
    """Whether the name of a property has room beside its field, and each choice of a menu in the field."""
    if not fitting(context, known.name, "", share=_BESIDE_FIELD):
        return False
    choices = known.enum_items if known.type == "ENUM" and not known.is_enum_flag else ()
    return all(_fits_field(context, choice.name, _ARROW) for choice in choices)


def property_fields(context, layout, settings, *names):
    """Draws properties, each with its name beside its field, or above the field if name or choices have no room there."""
    for name in names:
        known = settings.rna_type.properties[name]  # bl_rna of an operator does not list its properties.
        if _fits(context, known):
            # In a row, the buttons of a property with several choices are beside each other.
            layout.row(align=True).prop(settings, name)
            continue
        column = layout.column(align=True)
        column.use_property_split = False
        column.label(text=known.name)
        named = {"expand": True} if known.type == "ENUM" and known.is_enum_flag else {"text": ""}
        column.row(align=True).prop(settings, name, **named)


_POPUP = 100  # characters in a line


def popup_text(text):
    """Returns the text of an error in lines for Blender's popup, which does not break lines and is cut off at the edge of the
    window. Without a window it is the text in one line, as scripts show it."""
    if bpy.app.background:
        return text
    # The status bar shows all lines in one, without the ends of lines: a blank has to part their words.
    return " \n".join(textwrap.wrap(text, _POPUP, break_long_words=False, break_on_hyphens=False))


def text_lines(context, layout, text, icon):
    """Draws a label, broken into lines that fit the region. Returns the number of lines."""
    column, lines = layout.column(align=True), wrapped(context, text)
    for i, line in enumerate(lines):
        column.label(text=line, icon="BLANK1" if i and icon != "NONE" else icon)
    return len(lines)
