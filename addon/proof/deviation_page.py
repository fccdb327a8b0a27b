# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a deviation as one HTML page that needs no other file: both directions side by side, with histograms as SVG.

The colours are from the palette of M. Okabe and K. Ito, which the colour-blind can tell apart. Bars beyond the tolerance
are striped as well.
"""

import base64
import math
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from html import escape
from pathlib import Path

from ..units import NO_BREAK
from . import report, solidity
from .verdict import FAIL, PASS, Interval

_WITHIN, _BEYOND, _LINE = "#0072B2", "#D55E00", "#1a1a1a"

_STYLE = f"""
:root {{ color-scheme: light; font: 15px/1.45 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #1a1a1a; }}
body {{ max-width: 80rem; margin: 0 auto; padding: 2rem 1.5rem 3rem; background: #fff; }}
h1 {{ font-size: 1.6rem; margin: 0 0 .2rem; }}
h2 {{ font-size: 1.15rem; margin: 0 0 .6rem; }}
h3 {{ font-size: .95rem; margin: 1.4rem 0 .3rem; }}
p {{ margin: .3rem 0; }}
.muted, th, figcaption, footer {{ color: #555; font-weight: normal; }}
.verdict {{ width: fit-content; margin: .8rem 0; padding: .35rem .8rem; border-radius: .3rem; font-weight: 600;
  border: 2px solid #888; }}
.verdict.within {{ border-color: {_WITHIN}; color: {_WITHIN}; }}
.verdict.beyond {{ border-color: {_BEYOND}; color: #a34700; }}
.ways {{ display: grid; grid-template-columns: repeat(auto-fit, minmax(31rem, 1fr)); gap: 1.5rem; margin-top: 1rem; }}
article {{ border: 1px solid #d0d0d0; border-radius: .5rem; padding: 1.1rem 1.3rem; }}
.largest {{ font-size: 1.9rem; font-weight: 600; line-height: 1.2; }}
table {{ font-size: .93rem; border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }}
th, td {{ text-align: right; white-space: nowrap; padding: .16rem .35rem; border-bottom: 1px solid #ececec; }}
th:first-child, td:first-child {{ text-align: left; padding-left: 0; }}
.measures table {{ width: auto; }}
svg {{ display: block; width: 100%; height: auto; }}
svg text {{ font-size: 12px; fill: #333; }}
figure {{ margin: 1.5rem 0 0; }}
figure img {{ max-width: 100%; }}
footer {{ margin-top: 2rem; font-size: .87rem; border-top: 1px solid #d0d0d0; padding-top: .8rem; }}
"""

# Size and margins of the drawing of a histogram, in pixels.
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 560, 240, 50, 12, 30, 44
_LEAST_BAR = 1.5  # least height of a bar in pixels, so that a share of one in a million can be seen


def page(run, pictures=()):
    """Returns the page of a deviation with its `a` and `b` (see deviation.py). pictures: pairs (caption, bytes of a PNG)."""
    a, b = (escape(_name(run[key])) for key in ("a", "b"))
    figures = "".join(
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{base64.b64encode(png).decode()}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
        for caption, png in pictures
    )
    highest = max(max(run[way]["histogram"]["shares"]) for way in ("forward", "backward"))
    articles = "".join(
        _article(run, way, from_, to, highest) for way, from_, to in (("forward", a, b), ("backward", b, a))
    )
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>Deviation of {a} and {b}</title><style>{_STYLE}</style></head><body>
<h1>Deviation of {a} and {b}</h1>
<p class="muted">{_counts(run, run["a"])}<br>{_counts(run, run["b"])}; size, which is 100&nbsp;%: {_length(run, run["size"])}</p>
{_verdict(run)}
<p>{a}: {escape(solidity.line(run["solidity"]["a"]))}<br>{b}: {escape(solidity.line(run["solidity"]["b"]))}</p>
{_measures(run, a, b)}
<div class="ways">{articles}</div>
{_labels(run)}
{figures}
<footer>{_notes(run)}</footer>
</body></html>
"""


def _name(mesh):
    return mesh["name"] if "name" in mesh else Path(mesh["file"]).name


def _counts(run, mesh):
    whole = escape(str(mesh.get("file", mesh.get("name"))))
    holes = ""
    if "holes" in mesh:
        unit = f"{NO_BREAK}{run['unit']}" if run["unit"] else ""
        holes = f"; {escape(report.holes_closed(mesh['holes'], lambda value: f'{value:.4g}{unit}'))}"
    return f"{whole}: {mesh['vertices']:,} vertices, {mesh['triangles']:,} triangles{holes}"


def _rounded(value, up, digits=4):
    """Returns a number as text, rounded up or down so that a proved bound does not look better than it is.

    A relative difference of 1e-7, the rounding of float32, is ignored.
    """
    slack = 1 - 1e-7 if up == (value > 0) else 1 + 1e-7
    rounding = ROUND_CEILING if up else ROUND_FLOOR
    return f"{Context(prec=digits, rounding=rounding).create_decimal_from_float(value * slack):g}"


def _between(ends, scale=1.0):
    return f"{_rounded(scale * ends[0], False, 3)} to {_rounded(scale * ends[1], True, 3)}"


def _unit(run):
    return f"&nbsp;{escape(run['unit'])}" if run["unit"] else ""


def _in_unit(run):
    return f" in {escape(run['unit'])}" if run["unit"] else ""


def _length(run, value):
    return f"{value:.4g}{_unit(run)}"


def _share(value, range_):
    return f"{100 * value:.3g}&nbsp;%", f"{_between(range_, 100)}&nbsp;%"


def _relative(run, value):
    """Returns a length in percent of the tolerance, or of the size if there is no tolerance."""
    whole = run["tolerance"]["absolute"] if run["tolerance"] else run["size"]
    return f"{100 * value / whole:.3g}&nbsp;%"


def _of(run):
    return "of tolerance" if run["tolerance"] else "of size"


def _measures(run, a, b):
    """Returns the table of shells, area and volume of both."""
    of_a, of_b, changes = (run["solidity"][key] for key in ("a", "b", "change"))
    units = ("", "&sup2;", "&sup3;")
    rows = [
        (f"{name.capitalize()}{f'{_in_unit(run)}{power}' if power and run['unit'] else ''}", *texts)
        for (name, *texts), power in zip(solidity.measures(of_a, of_b, changes), units)
    ]
    return f'<div class="measures">{_table(("", a, b, "change"), rows)}</div>'


def _verdict(run):
    if not run["tolerance"]:
        return ""
    tolerance = run["tolerance"]["absolute"]
    said = f"Tolerance {_length(run, tolerance)} ({run['tolerance']['percent']:.4g}&nbsp;% of size): "
    names = [escape(_name(run[key])) for key in ("a", "b")]
    found = [Interval(*run[way]["largest"]) for way in ("forward", "backward")]
    about = "both" if run["two_sided"] else names[0]
    found, names = (found, names) if run["two_sided"] else (found[:1], names[:1])
    if run["verdict"] == PASS:
        verb = "are" if run["two_sided"] else "is"
        return f'<p class="verdict within">✓ {PASS}. {said}{about} {verb} within the tolerance, proved</p>'
    beyond = [name for name, interval in zip(names, found) if interval.beyond(tolerance)]
    why = (
        f"beyond the tolerance, proved: {' and '.join(beyond)}"
        if beyond
        else ("not decided, because the interval of a largest distance contains the tolerance")
    )
    return f'<p class="verdict beyond">✗ {FAIL}. {said}{why}</p>'


def _article(run, way, from_, to, highest):
    found = run[way]
    lower, upper = found["largest"]
    place = ", ".join(f"{x:.6g}" for x in found["position"])
    face = f"triangle {found['triangle']:,}" if found["face"] is None else f"face {found['face']:,}"
    whole = run["tolerance"]["absolute"] if run["tolerance"] else None
    relative = f", {100 * upper / whole:.4g}&nbsp;% of the tolerance" if whole else ""
    return f"""<article><h2>{from_} from {to}</h2>
<p class="muted">Largest distance, proved to be at most</p>
<p class="largest">{_rounded(upper, True)}{_unit(run)}</p>
<p>{100 * upper / run["size"]:.4g}&nbsp;% of size{relative}; at least {_rounded(lower, False)}{_unit(run)}
at ({place}), {face}.</p>
<h3>Share of the area by distance</h3>
{_histogram(run, way, highest)}
<h3>Statistics over the area</h3>
{_statistics(run, found)}
{_bands(run, found)}
{_sides(run, found, to)}
</article>"""


def _table(head, rows):
    cells = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><tr>{''.join(f'<th>{cell}</th>' for cell in head)}</tr>{cells}</table>"


def _statistics(run, found):
    rows = [("Mean", found["mean"], found["mean_range"]), ("Root mean square", found["rms"], found["rms_range"])]
    rows += [
        (f"{entry['percent']:g}&nbsp;% of area within", entry["distance"], entry["range"])
        for entry in found["percentiles"]
    ]
    return _table(
        ("", f"distance{_in_unit(run)}", _of(run), "certainly"),
        [(what, f"{value:.4g}", _relative(run, value), _between(ends)) for what, value, ends in rows],
    )


def _bands(run, found):
    beyond = found["beyond"]
    if not beyond:
        return ""
    rows, before = [], {"share": 1.0, "range": [1.0, 1.0]}
    for i, entry in enumerate(beyond):
        range_ = [before["range"][0] - entry["range"][1], before["range"][1] - entry["range"][0]]
        from_ = f"{beyond[i - 1]['bound']:.4g}" if i else "0"
        band = f"{from_} to {entry['bound']:.4g}"
        rows.append((band, *_share(before["share"] - entry["share"], [max(0.0, range_[0]), min(1.0, range_[1])])))
        before = entry
    rows.append((f"beyond {before['bound']:.4g}", *_share(before["share"], before["range"])))
    return "<h3>Share of the area in each band</h3>" + _table((f"distance{_in_unit(run)}", "share", "certainly"), rows)


def _sides(run, found, to):
    sides = found["sides"]
    if not sides:
        return f'<p class="muted">{to} is not closed, so it has no inside.</p>'
    inside, ends = sides["share_inside"], sides["share_inside_range"]
    rows = [
        ("inside", *_share(inside, ends), _rounded(sides["inside"][1], True)),
        ("outside", *_share(1 - inside, [1 - ends[1], 1 - ends[0]]), _rounded(sides["outside"][1], True)),
    ]
    return (
        f"<h3>Sides of {to}</h3>"
        + _table(("", "area", "certainly", f"farthest at most{_in_unit(run)}"), rows)
        + f"<p>The signed mean, with distances outside above 0, is {sides['mean']:+.3g}{_unit(run)}, certainly "
        f"{_between(sides['mean_range'])}.</p>"
    )


def _ticks(lower, upper, count=6):
    """Round numbers from lower to upper, about `count` of them."""
    rough = (upper - lower) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if factor * power >= rough * (1 - 1e-9))
    return [i * step for i in range(math.ceil(lower / step - 1e-9), math.floor(upper / step + 1e-9) + 1)]


def _histogram(run, way, highest):
    edges, shares = run[way]["histogram"]["edges"], run[way]["histogram"]["shares"]
    tolerance = run["tolerance"]["absolute"] if run["tolerance"] else math.inf
    signed = bool(run[way]["sides"])
    floor = _HEIGHT - _BOTTOM

    def across(value):
        return _LEFT + (value - edges[0]) / (edges[-1] - edges[0]) * (_WIDTH - _LEFT - _RIGHT)

    def up(share):
        return (floor - _TOP) * share / highest

    parts = []
    for share in _ticks(0, 100 * highest, 4):
        y = floor - up(share / 100)
        parts.append(f'<path d="M{_LEFT} {y:.1f}H{_WIDTH - _RIGHT}" stroke="#e4e4e4"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{share:g}&#160;%</text>')
    for lower, upper, share in zip(edges, edges[1:], shares):
        if share > 0:
            height = max(up(share), _LEAST_BAR)
            beyond = min(abs(lower), abs(upper)) >= tolerance * (1 - 1e-9)
            fill = f"url(#stripes-{way})" if beyond else _WITHIN
            parts.append(
                f'<rect x="{across(lower) + 0.4:.2f}" y="{floor - height:.2f}" '
                f'width="{across(upper) - across(lower) - 0.8:.2f}" height="{height:.2f}" fill="{fill}"/>'
            )
    parts.append(f'<path d="M{_LEFT} {floor}H{_WIDTH - _RIGHT}" stroke="{_LINE}"/>')
    for value in _ticks(edges[0], edges[-1]):
        parts.append(f'<path d="M{across(value):.1f} {floor}v5" stroke="{_LINE}"/>')
        parts.append(f'<text x="{across(value):.1f}" y="{floor + 18}" text-anchor="middle">{value:.6g}</text>')
    if math.isfinite(tolerance):
        for line in (-tolerance, tolerance) if signed else (tolerance,):
            x = across(line)
            anchor = "end" if line > 0 else "start"
            parts.append(
                f'<path d="M{x:.1f} {_TOP - 4}V{floor}" stroke="{_BEYOND}" stroke-width="2" stroke-dasharray="6 4"/>'
                f'<text x="{x:.1f}" y="{_TOP - 12}" text-anchor="{anchor}">{"−" if line < 0 else ""}tolerance</text>'
            )
    axis = f"inside ← distance{_in_unit(run)} → outside" if signed else f"distance{_in_unit(run)}"
    parts.append(f'<text x="{(_LEFT + _WIDTH - _RIGHT) / 2}" y="{_HEIGHT - 6}" text-anchor="middle">{axis}</text>')
    return f"""<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="Histogram of the distance"><defs>
<pattern id="stripes-{way}" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">
<rect width="6" height="6" fill="{_BEYOND}"/><rect width="2" height="6" fill="#fff"/></pattern></defs>
{"".join(parts)}</svg>"""


def _labels(run):
    """Returns the table of the labels that the probe has left, or nothing without labels."""
    rows = [
        (
            i + 1,
            label["on"],
            ", ".join(f"{x:.6g}" for x in label["position"]),
            f"{label['distance']:.4g}",
            label["side"] or "",
            f"{100 * label['share_of_tolerance']:.3g}&nbsp;%",
            "" if label["current"] else "before a change: out of date",
        )
        for i, label in enumerate(run.get("labels", ()))
    ]
    head = ("label", "on", f"point{_in_unit(run)}", f"distance{_in_unit(run)}", "side", "of tolerance", "")
    return f"<h2>Labels</h2>{_table(head, rows)}" if rows else ""


def _notes(run):
    samples = " and ".join(f"{run[way]['samples']:,}" for way in ("forward", "backward"))
    spacing, errors = (
        " and ".join(_length(run, run[way][key]) for way in ("forward", "backward"))
        for key in ("spacing", "mean_error")
    )
    return (
        f"<p>A distance is measured from a point of one surface to the nearest point of the other. The largest distance is a "
        f"certified interval. The statistics are estimated from {samples} samples (mean spacing {spacing}); the standard "
        f"error of the mean is at most {errors}. Beside each number is an interval that certainly contains the true number, "
        f"whatever lies between the samples. Bars beyond the tolerance are striped. Bars that would be too low to be seen "
        f"are drawn {_LEAST_BAR} pixels high.</p>"
        f"<p>Tolerance Volumes {escape(run['version'])}</p>"
    )
