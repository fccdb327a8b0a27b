# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes deviations as one HTML page that needs no other file: both directions side by side, with histograms and pictures.

Several objects have a table on top and a section each.
"""

import base64
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from html import escape
from pathlib import Path

from ..numbers import NO_BREAK
from . import report, solidity
from .deviation_drawings import LEAST_BAR, histogram, legend
from .deviation_style import STYLE
from .deviation_units import DIGITS, tolerance_text
from .verdict import FAIL, NOT_CHECKED, PASS, Interval, negligible


def page(document, pictures=()):
    """Returns the page of a deviation with its `a` and `b`, or of a report of several objects (see deviation.py).

    pictures: a list of Pictures, or one such list for each of several objects.
    """
    if "objects" in document:
        return _page_of_several(document, pictures)
    a, b = (escape(_name(document[key])) for key in ("a", "b"))
    body = f"""<h1>Deviation of {a} and {b}</h1>
{_facts(document)}
{_of_one(document, pictures, "")}
<footer>{_notes([document])}</footer>"""
    return _page(f"Deviation of {a} and {b}", body)


def _page(title, body):
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{STYLE}</style></head><body>
{body}
</body></html>
"""


def _page_of_several(document, pictures):
    runs, others = document["objects"], document["not_measured"]
    title = f"Deviation of {len(runs)} {'object' if len(runs) == 1 else 'objects'}"
    sections = "".join(
        f"""<section id="object-{i}"><h2>{escape(_name(run["a"]))}</h2>
{_facts(run)}
{_of_one(run, pictures[i] if pictures else (), f"-{i}")}
</section>
"""
        for i, run in enumerate(runs)
    )
    word = document["verdict"]
    failed = sum(run["verdict"] != PASS for run in runs)
    counted = f"{len(runs) - failed} of {len(runs) + len(others)} objects are within the tolerance, proved"
    body = f"""<h1>{title}</h1>
{_list(_about(document))}
<p class="verdict{_look(word)}">{_sign(word)}{word}. {counted}</p>
{_overview(runs, others)}
{sections}
<footer>{_notes(runs)}</footer>"""
    return _page(title, body)


def _look(word):
    """Returns the class of a verdict, with a space before it."""
    return {PASS: " within", FAIL: " beyond"}.get(word, "")


def _sign(word):
    return {PASS: "✓ ", FAIL: "✗ "}.get(word, "")


def _list(facts):
    """Returns pairs (name, HTML) as a list. A pair without a text is left out."""
    rows = "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in facts if text)
    return f'<dl class="facts">{rows}</dl>'


def _about(document):
    return [
        ("File", escape(document.get("blend_file") or "")),
        ("Date", escape(document.get("date", "").replace("T", " "))),
        ("Made by", f"Tolerance Volumes {escape(document['version'])}"),
    ]


def _facts(run):
    """Returns what was measured and how, as a list."""
    ways = "both ways" if run["two_sided"] else "one way: from the mesh to the reference"
    facts = [
        ("Mesh", _counts(run, run["a"])),
        ("Reference", _counts(run, run["b"])),
        ("Tolerance", f"{escape(tolerance_text(run))}, {ways}" if run["tolerance"] else ""),
        ("Size", f"{_length(run, run['size'])}, the longest diagonal of the reference's box, is 100&nbsp;%"),
        ("Unit", escape(run["unit"])),
    ]
    about = _about(run) if "date" in run or "blend_file" in run else []
    return _list([*facts, *about])


def _overview(runs, others):
    """Returns the table of all objects."""
    head = ("Object", "Verdict", "Mesh, at&nbsp;most", "Reference, at&nbsp;most", "Tolerance")
    head += ("Mesh beyond", "Reference beyond", "Mesh triangles", "Reference triangles")
    rows = []
    for i, run in enumerate(runs):
        word, unit = run["verdict"], _unit(run)
        rows.append(
            (
                f'<a href="#object-{i}">{escape(_name(run["a"]))}</a>',
                f'<span class="{_look(word).strip()}">{_sign(word)}{word}</span>',
                *(f"{_rounded(run[way]['largest'][1], True)}{unit}" for way in ("forward", "backward")),
                f"{run['tolerance']['absolute']:.{DIGITS}g}{unit}",
                *(_share_beyond(run, way) for way in ("forward", "backward")),
                *(f"{run[key]['triangles']:,}" for key in ("a", "b")),
            )
        )
    dashes = ("–",) * (len(head) - 2)
    rows += [(escape(other["name"]), NOT_CHECKED.replace(" ", NO_BREAK), *dashes) for other in others]
    reasons = "".join(f"<p>{escape(other['name'])}: {escape(other['reason'])}</p>" for other in others)
    return f'<div class="overview">{_table(head, rows)}</div>{reasons}'


def _share_beyond(run, way):
    """Returns the share of a surface that is farther away than the tolerance."""
    if Interval(*run[way]["largest"]).within(run["tolerance"]["absolute"]):
        return "0&nbsp;%"
    share = next(entry for entry in run[way]["beyond"] if entry["bound"] == run["tolerance"]["absolute"])["share"]
    return f"{100 * share:.3g}&nbsp;%"


def _of_one(run, pictures, suffix):
    """Returns what a section and the page of one object have in common. suffix: ends the names of its drawings."""
    a, b = (escape(_name(run[key])) for key in ("a", "b"))
    highest = max(max(run[way]["histogram"]["shares"]) for way in ("forward", "backward"))
    articles = "".join(
        _article(run, way, from_, to, highest, suffix) for way, from_, to in (("forward", a, b), ("backward", b, a))
    )
    figures = "".join(_figure(run, picture, f"{i}{suffix}") for i, picture in enumerate(pictures))
    return f"""{_verdict(run)}
{f'<div class="pictures">{figures}</div>' if figures else ""}
<p>{a}: {escape(solidity.line(run["solidity"]["a"]))}<br>{b}: {escape(solidity.line(run["solidity"]["b"]))}</p>
{_measures(run, a, b)}
<div class="ways">{articles}</div>
{_labels(run)}"""


def _figure(run, picture, name):
    colours = legend(picture, run["unit"], f"picture-{name}") if picture.reach else ""
    return (
        f'<figure><img alt="{escape(picture.caption)}" src="data:image/png;base64,'
        f'{base64.b64encode(picture.png).decode()}"><figcaption>{escape(picture.caption)}</figcaption>{colours}</figure>'
    )


def _name(mesh):
    return mesh["name"] if "name" in mesh else Path(mesh["file"]).name


def _counts(run, mesh):
    whole = escape(str(mesh.get("file", mesh.get("name"))))
    holes = ""
    if "holes" in mesh:
        unit = f"{NO_BREAK}{run['unit']}" if run["unit"] else ""
        holes = f"; {escape(report.holes_closed(mesh['holes'], lambda value: f'{value:.4g}{unit}'))}"
    return f"{whole}: {mesh['vertices']:,} vertices, {mesh['triangles']:,} triangles{holes}"


def _rounded(value, up, digits=DIGITS):
    """Returns a number as text, rounded up or down so that a proved bound does not look better than it is.

    A relative difference of 1e-7, the rounding of float32, is ignored.
    """
    slack = 1 - 1e-7 if up == (value > 0) else 1 + 1e-7
    rounding = ROUND_CEILING if up else ROUND_FLOOR
    return f"{Context(prec=digits, rounding=rounding).create_decimal_from_float(value * slack):g}"


def _between(ends, scale=1.0, digits=DIGITS - 1):
    return f"{_rounded(scale * ends[0], False, digits)} to&nbsp;{_rounded(scale * ends[1], True, digits)}"


def _unit(run):
    return f"&nbsp;{escape(run['unit'])}" if run["unit"] else ""


def _in_unit(run):
    return f" in {escape(run['unit'])}" if run["unit"] else ""


def _length(run, value):
    return f"{value:.4g}{_unit(run)}"


def _share(value, range_):
    return f"{100 * value:.3g}&nbsp;%", f"{_between(range_, 100, 3)}&nbsp;%"


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
    said = f"Tolerance {escape(tolerance_text(run))}: "
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


def _article(run, way, from_, to, highest, suffix):
    found = run[way]
    lower, upper = found["largest"]
    place = ", ".join(f"{x:.6g}" for x in found["position"])
    face = f"triangle {found['triangle']:,}" if found["face"] is None else f"face {found['face']:,}"
    whole = run["tolerance"]["absolute"] if run["tolerance"] else None
    relative = f", {_rounded(100 * upper / whole, True, 4)}&nbsp;% of the tolerance" if whole else ""
    if _is_rounding(run, upper):
        spread = f'<p class="muted">Nothing deviates but by rounding: {from_} lies on {to}.</p>'
    else:
        spread = f"""{_block("Statistics over the area", _statistics(run, found))}
{_bands(run, found)}
{_sides(run, found, to)}"""
    return f"""<article><h3>{from_} from {to}</h3>
<p class="muted">Largest distance, proved to be at most</p>
<p class="largest">{_rounded(upper, True)}{_unit(run)}</p>
<p>{_rounded(100 * upper / run["size"], True, 4)}&nbsp;% of size{relative}; at least {_rounded(lower, False)}{_unit(run)}
at ({place}), {face}.</p>
{_block("Share of the area by distance", histogram(run, way, highest, f"{way}{suffix}", f"distance{_in_unit(run)}"))}
{spread}
</article>"""


# Without a tolerance, what is a smaller share of the size is no more than rounding.
_ROUNDING = 1e-10


def _is_rounding(run, value):
    """Whether the digits of a distance say nothing."""
    return negligible(value, run["tolerance"]["absolute"]) if run["tolerance"] else value < _ROUNDING * run["size"]


def _block(heading, content):
    """Returns a part of an article that is not divided between two sheets of paper."""
    return f'<div class="block"><h4>{heading}</h4>{content}</div>'


def _table(head, rows):
    cells = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    heads = "".join(f"<th>{cell}</th>" for cell in head)
    return f'<div class="table"><table><thead><tr>{heads}</tr></thead><tbody>{cells}</tbody></table></div>'


def _statistics(run, found):
    rows = [("Mean", found["mean"], found["mean_range"]), ("Root mean square", found["rms"], found["rms_range"])]
    rows += [
        (f"{entry['percent']:g}&nbsp;% of area within", entry["distance"], entry["range"])
        for entry in found["percentiles"]
    ]
    return _table(
        ("", f"distance{_in_unit(run)}", _of(run), "certainly"),
        [(what, *_estimated(run, value), _between(ends)) for what, value, ends in rows],
    )


def _estimated(run, value):
    """Returns an estimated distance as text, and its share of the tolerance or the size."""
    return ("almost 0", "") if _is_rounding(run, value) else (f"{value:.4g}", _relative(run, value))


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
    table = _table((f"distance{_in_unit(run)}", "share", "certainly"), rows)
    return _block("Share of the area in each band", table)


def _sides(run, found, to):
    sides = found["sides"]
    if not sides:
        return f'<p class="muted">{to} is not closed, so it has no inside.</p>'
    inside, ends = sides["share_inside"], sides["share_inside_range"]
    rows = [
        ("inside", *_share(inside, ends), _rounded(sides["inside"][1], True)),
        ("outside", *_share(1 - inside, [1 - ends[1], 1 - ends[0]]), _rounded(sides["outside"][1], True)),
    ]
    return _block(
        f"Sides of {to}",
        _table(("", "area", "certainly", f"farthest at most{_in_unit(run)}"), rows)
        + f"<p>The signed mean, with distances outside above 0, is {sides['mean']:+.3g}{_unit(run)}, certainly "
        f"{_between(sides['mean_range'])}.</p>",
    )


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
    return f'<div class="block"><h3>Labels</h3>{_table(head, rows)}</div>' if rows else ""


def _notes(runs):
    """Returns how to read the page."""
    samples = sum(run[way]["samples"] for run in runs for way in ("forward", "backward"))
    error = max(run[way]["mean_error"] / run["size"] for run in runs for way in ("forward", "backward"))
    return (
        f"<p>A distance is measured from a point of one surface to the nearest point of the other. The largest distance is a "
        f"certified interval. The statistics are estimated from {samples:,} samples; the standard error of a mean is at most "
        f"{100 * error:.2g}&nbsp;% of the size. Beside each number is an interval that certainly contains the true number, "
        f"whatever lies between the samples. Bars beyond the tolerance are striped. Bars that would be too low to be seen "
        f"are drawn {LEAST_BAR} pixels high. The pictures are drawn from an interpolated field and prove nothing.</p>"
    )
