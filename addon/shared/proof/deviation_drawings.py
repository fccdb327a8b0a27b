# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the histograms and the legends of the page of a deviation as SVG.

Bars beyond the tolerance are striped as well, for those who do not tell the colours apart.
"""

import math
from html import escape

from .. import package
from .deviation_style import BEYOND, LINE, WITHIN

LEAST_BAR = 1.5  # least height of a bar in pixels, so that a share of one in a million can be seen

# Size and margins of the drawing of a histogram, in pixels. On a telephone it is about as wide as its text is readable.
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 400, 220, 50, 14, 30, 44
_LETTER = 7  # pixels; hardly any letter or digit is wider
_TICKS = 4  # about so many numbers stand side by side below a histogram

# The size of a legend, and the place of its bar, in pixels.
_LEGEND, _BAR_FROM, _BAR_TO, _BAR_HEIGHT = (400, 66), 30, 370, 14
_STOPS = 33  # number of colours of a legend; the browser mixes those between


def _ticks(lower, upper, count):
    """Returns round numbers from lower to upper, about `count` of them."""
    rough = (upper - lower) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if factor * power >= rough * (1 - 1e-9))
    return [i * step for i in range(math.ceil(lower / step - 1e-9), math.floor(upper / step + 1e-9) + 1)]


def _number(value):
    """Returns a number of an axis in at most nine letters."""
    return f"{value:.4g}".replace("-", "−").replace("e−0", "e−").replace("e+0", "e")


def _text(x, y, text, anchor="middle"):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{text}</text>'


def histogram(run, way, highest, name, axis):
    """Returns the histogram of a direction. highest: the share that the axis has room for; name: unlike that of all other
    drawings of the page; axis: the HTML that names distance and unit."""
    edges, shares = run[way]["histogram"]["edges"], run[way]["histogram"]["shares"]
    tolerance = run["tolerance"]["absolute"] if run["tolerance"] else math.inf
    signed = bool(run[way]["sides"])
    floor, end = _HEIGHT - _BOTTOM, _WIDTH - _RIGHT

    def across(value):
        return _LEFT + (value - edges[0]) / (edges[-1] - edges[0]) * (end - _LEFT)

    def up(share):
        return (floor - _TOP) * share / highest

    parts = []
    for share in _ticks(0, 100 * highest, 4):
        y = floor - up(share / 100)
        parts.append(f'<path d="M{_LEFT} {y:.1f}H{end}" stroke="#e4e4e4"/>')
        parts.append(_text(_LEFT - 6, y + 4, f"{share:g}&#160;%", "end"))
    for lower, upper, share in zip(edges, edges[1:], shares):
        if share > 0:
            height = max(up(share), LEAST_BAR)
            beyond = min(abs(lower), abs(upper)) >= tolerance * (1 - 1e-9)
            fill = f"url(#stripes-{name})" if beyond else WITHIN
            parts.append(
                f'<rect x="{across(lower) + 0.3:.2f}" y="{floor - height:.2f}" '
                f'width="{max(across(upper) - across(lower) - 0.6, 0.3):.2f}" height="{height:.2f}" fill="{fill}"/>'
            )
    parts.append(f'<path d="M{_LEFT} {floor}H{end}" stroke="{LINE}"/>')
    for value in _ticks(edges[0], edges[-1], _TICKS):
        label = _number(value)
        half = _LETTER * len(label) / 2
        parts.append(f'<path d="M{across(value):.1f} {floor}v5" stroke="{LINE}"/>')
        parts.append(_text(min(across(value), _WIDTH - half), floor + 18, label))
    if math.isfinite(tolerance):
        lines = [across(line) for line in ((-tolerance, tolerance) if signed else (tolerance,))]
        parts += [
            f'<path d="M{x:.1f} {_TOP - 4}V{floor}" stroke="{BEYOND}" stroke-width="2" stroke-dasharray="6 4"/>'
            for x in lines
        ]
        parts += _tolerance_labels(lines)
    parts.append(_text((_LEFT + end) / 2, _HEIGHT - 6, f"inside ← {axis} → outside" if signed else axis))
    return f"""<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="Histogram of the distance"><defs>
{_stripes(name, BEYOND, "#fff", 6)}</defs>
{"".join(parts)}</svg>"""


def _tolerance_labels(lines):
    """Returns the labels of the lines at the tolerance. One label for both stands where two would meet."""
    y, labels = _TOP - 12, ("−tolerance", "tolerance") if len(lines) == 2 else ("tolerance",)
    widths = [_LETTER * len(label) for label in labels]
    if len(lines) == 2 and lines[1] - lines[0] < sum(widths) + _LETTER:
        return [_text(sum(lines) / 2, y, "±tolerance")]
    if len(lines) == 1 and lines[0] - widths[0] < 0:
        return [_text(lines[0], y, labels[0], "start")]
    anchors = ("start", "end") if len(lines) == 2 else ("end",)
    return [_text(x, y, label, anchor) for x, label, anchor in zip(lines, labels, anchors)]


def _stripes(name, first, second, width):
    return (
        f'<pattern id="stripes-{name}" width="{width}" height="{width}" patternUnits="userSpaceOnUse" '
        f'patternTransform="rotate(45)"><rect width="{width}" height="{width}" fill="{first}"/>'
        f'<rect width="{width / 3:g}" height="{width}" fill="{second}"/></pattern>'
    )


def legend(picture, unit, name):
    """Returns the colours of a Picture with their distances. unit: as text; name: unlike that of all other drawings."""
    transfer = "signed" if picture.signed else "magnitude"
    colours = package.module.transfer_colours(transfer)
    stops = "".join(
        f'<stop offset="{i / (_STOPS - 1):.4f}" stop-color="#{bytes(colours[i * (len(colours) - 1) // (_STOPS - 1)]).hex()}"/>'
        for i in range(_STOPS)
    )
    parts = [
        f'<rect x="{_BAR_FROM}" y="2" width="{_BAR_TO - _BAR_FROM}" height="{_BAR_HEIGHT}" fill="url(#colours-{name})"/>'
    ]
    ends = (-picture.reach, 0, picture.reach) if picture.signed else (0, picture.reach / 2, picture.reach)
    unit = escape(f" {unit}") if unit else ""
    for x, value, anchor in zip((_BAR_FROM, (_BAR_FROM + _BAR_TO) / 2, _BAR_TO), ends, ("start", "middle", "end")):
        parts.append(_text(x, _BAR_HEIGHT + 18, f"{_number(value)}{unit}" if value else "0", anchor))
    if picture.signed:
        parts.append(_text((_BAR_FROM + 2 * _BAR_TO) / 3, 57, "blue inside, red outside"))
    dark, light = (f"rgb({','.join(map(str, colour))})" for colour in package.module.OUTSIDE_COLOURS)
    parts.append(
        f'<rect x="{_BAR_FROM}" y="46" width="14" height="14" fill="url(#stripes-{name})"/>'
        + _text(_BAR_FROM + 22, 57, "farther away", "start")
    )
    return (
        f'<svg viewBox="0 0 {_LEGEND[0]} {_LEGEND[1]}" role="img" aria-label="Colours of the distance"><defs>'
        f'<linearGradient id="colours-{name}">{stops}</linearGradient>'
        f"{_stripes(name, dark, light, 9)}</defs>{''.join(parts)}</svg>"
    )
