# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the deviation of two surfaces in both directions and writes it as .json, .csv or .html.

A deviation is a dictionary, as a .json report holds it. Lengths are in the units of the surfaces, and shares are shares
of the area (0 to 1). `largest` and every entry whose name ends in _range is an interval that certainly contains the true
number:

    version, method, unit, size   `size` is the length that is 100 %
    tolerance                     {absolute, percent}, or None
    two_sided                     whether both directions have to be within the tolerance for the verdict, or `forward` alone
    verdict                       PASS or FAIL (verdict.py), or None without a tolerance
    a, b                          {name or file, vertices, triangles}; a also has `holes`, as in report.py, if the last
                                  decimation closed holes
    labels                        only if the probe has left some: [{on, position, distance, side, share_of_tolerance,
                                  current}]; on: "mesh" or "reference"; side: "inside", "outside" or None; current: whether
                                  the label was read in this state of both, or before a change
    solidity                      {a, b}: facts about both (solidity.py); {change}: solidity.change(), a against b
    forward, backward             a from b, and b from a; each:
        largest, position, triangle, face               position: the point with the largest distance found, in this
                                                        triangle and face; face: the polygon, None for several objects
        mean, mean_range, mean_error, rms, rms_range    mean_error: the standard error of `mean`, at most
        percentiles   [{percent, distance, range}]
        beyond        [{bound, share, range}]           share: of the area, farther away than the bound
        sides         {mean, mean_range, share_inside, share_inside_range, inside, outside} if the other surface is
                      closed, else None; `mean` is signed, `inside` and `outside` are the largest distances on each side
        histogram     {edges, shares}                   of signed distances if there are sides
        samples, spacing
"""

import csv
import io
import json
import re
from pathlib import Path

import numpy as np

from .. import native
from . import deviation_page, measure, report, solidity
from .verdict import Verdict

PERCENTILES = (50, 90, 95, 99, 99.9)
EXTENSIONS = (".json", ".csv", ".html")

_METHOD = "certified interval; one sample for each piece of the surface, ranges from bounds on the pieces"
# A spreadsheet takes text that begins with one of these for a formula; the last four are the full-width forms.
_FORMULA = "=+-@\uff1d\uff0b\uff0d\uff20"
_BINS = 30  # the approximate number of bins on each side of the histogram


def deviation(a, b, size, tolerance=None, bounds=(), unit="", threads=None, progress=None, two_sided=True):
    """Returns the dictionary that is described above, without `a` and `b`, for two Surfaces."""
    bounds = sorted({*bounds, *([] if tolerance is None else [tolerance])})
    ways = {}
    for way, surface, other in (("forward", a, b), ("backward", b, a)):
        pair = (surface.world(), surface.arrays.triangles), (other.world(), other.arrays.triangles)
        spread = native.module.deviation(
            *pair[0], *pair[1], bounds=bounds, percentiles=PERCENTILES, threads=threads, progress=progress
        )
        ways[way] = measure.largest_distance(*pair, tolerance, threads, progress), spread, surface.arrays.polygons
    facts = {name: solidity.facts(surface, threads, progress) for name, surface in (("a", a), ("b", b))}
    largest = [measured for measured, _, _ in ways.values()]
    # Both histograms have the same scale, so that they can be compared.
    edges = _edges(max(found.upper for found in largest), tolerance)
    return {
        "version": native.module.__version__,
        "method": _METHOD,
        "unit": unit,
        "size": size,
        "tolerance": None if tolerance is None else {"absolute": tolerance, "percent": 100 * tolerance / size},
        "two_sided": two_sided,
        "verdict": None if tolerance is None else Verdict(tolerance, *largest, two_sided=two_sided).word,
        "solidity": facts | {"change": solidity.change(facts["a"], facts["b"])},
        **{way: _way(*of_way, bounds, edges) for way, of_way in ways.items()},
    }


def _edges(largest, tolerance):
    """Returns the edges of the bins from 0 on. The tolerance is one of the edges unless it is below a bin's width."""
    top = max(largest, tolerance or 0.0) or 1.0
    bins = int(_BINS * tolerance / top) if tolerance else 0
    width = tolerance / bins if bins else top / _BINS
    return width * np.arange(np.ceil(top / width * (1 - 1e-9)) + 1)


def _way(largest, spread, polygons, bounds, edges):
    sides = spread.sides
    if sides:
        edges = np.concatenate([-edges[:0:-1], edges])
    most = largest.upper  # This bound is narrower than the bounds on the pieces, so it limits the other ranges too.
    # A distance may be above the end of the interval by its own rounding error.
    shares, _ = np.histogram(np.clip(spread.distances, edges[0], edges[-1]), edges, weights=spread.weights)
    return {
        "largest": [largest.lower, largest.upper],
        "position": list(largest.position),
        "triangle": largest.triangle,
        "face": None if polygons is None else int(polygons[largest.triangle]),
        "mean": spread.mean,
        "mean_range": list(spread.mean_range),
        "mean_error": spread.mean_error,
        "rms": spread.rms,
        "rms_range": list(spread.rms_range),
        "percentiles": [
            {"percent": percent, "distance": distance, "range": [lower, min(upper, most)]}
            for percent, distance, (lower, upper) in zip(
                PERCENTILES, spread.percentiles.tolist(), spread.percentiles_range.tolist()
            )
        ],
        "beyond": [
            {"bound": bound, "share": share, "range": ends}
            for bound, share, ends in zip(bounds, spread.share_beyond.tolist(), spread.share_beyond_range.tolist())
        ],
        "sides": sides
        and {
            "mean": sides.mean,
            "mean_range": list(sides.mean_range),
            "share_inside": sides.share_inside,
            "share_inside_range": list(sides.share_inside_range),
            "inside": [sides.inside[0], min(sides.inside[1], most)],
            "outside": [sides.outside[0], min(sides.outside[1], most)],
        },
        "histogram": {"edges": edges.tolist(), "shares": shares.tolist()},
        "samples": len(spread.distances),
        "spacing": spread.spacing,
    }


def content(run, path, pictures=()):
    """Returns the bytes of a file for a deviation with its `a` and `b`, in the format of the path's extension.

    pictures: pairs (caption, bytes of a PNG), which only the .html page shows.
    """
    writers = {
        ".json": lambda: json.dumps(run, indent=1) + "\n",
        ".csv": lambda: table(run),
        ".html": lambda: deviation_page.page(run, pictures),
    }
    # The name of a file may have bytes that are not valid text.
    return writers[Path(path).suffix.lower()]().encode("utf-8", "backslashreplace")


def table(run):
    """Returns a deviation as CSV: each row has one number, its parameter, and the ends of its range if it has one.

    Text that a spreadsheet would take for a formula gets a ' before it.
    """
    rows = [("direction", "quantity", "at", "value", "lower", "upper")]
    rows += [("", "version", "", run["version"], "", ""), ("", "unit", "", run["unit"], "", "")]
    rows += [("", "size", "", run["size"], "", "")]
    if run["tolerance"]:
        rows += [
            ("", "tolerance", "", run["tolerance"]["absolute"], "", ""),
            ("", "verdict", "", run["verdict"], "", ""),
        ]
    for name in ("a", "b"):
        rows += [("", f"{name} {key}", "", value, "", "") for key, value in run[name].items() if key != "holes"]
        holes = report.hole_rows(run[name]["holes"]) if "holes" in run[name] else ()
        rows += [("", f"{name} {key}", at, value, "", "") for key, at, value in holes]
        facts = run["solidity"][name].items()
        rows += [("", f"{name} {key}", "", "" if value is None else value, "", "") for key, value in facts]
    change = run["solidity"]["change"].items()
    rows += [("", f"change of {key}", "", "" if value is None else value, "", "") for key, value in change]
    for i, label in enumerate(run.get("labels", ())):
        rows += [
            ("", f"label {i + 1} {key}", "", "" if value is None else value, "", "") for key, value in _flat(label)
        ]
    for way in ("forward", "backward"):
        rows += [(way, *row) for row in _rows(run[way])]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([_harmless(cell) for cell in row] for row in rows)
    return text.getvalue()


def _flat(label):
    """Yields the entries of a label, each coordinate of its position by itself."""
    for key, value in label.items():
        if key == "position":
            yield from zip("xyz", value)
        else:
            yield key, value


def _harmless(cell):
    """Makes text safe for a spreadsheet: names come from other people's files, and as a formula a name could run a
    program where the table is opened."""
    if not isinstance(cell, str):
        return cell
    line = re.sub(r"[\t\r\n]", " ", cell)  # Some readers of CSV begin a new row at a lone \r.
    return f"'{line}" if line.lstrip()[:1] in tuple(_FORMULA) else line


def _rows(way):
    yield "largest", "", way["largest"][0], *way["largest"]
    for axis, value in zip("xyz", way["position"]):
        yield "position", axis, value, "", ""
    yield "triangle", "", way["triangle"], "", ""
    yield "face", "", "" if way["face"] is None else way["face"], "", ""
    yield "mean", "", way["mean"], *way["mean_range"]
    yield "mean_error", "", way["mean_error"], "", ""
    yield "rms", "", way["rms"], *way["rms_range"]
    for entry in way["percentiles"]:
        yield "percentile", entry["percent"], entry["distance"], *entry["range"]
    for entry in way["beyond"]:
        yield "share beyond", entry["bound"], entry["share"], *entry["range"]
    if way["sides"]:
        sides = way["sides"]
        yield "signed mean", "", sides["mean"], *sides["mean_range"]
        yield "share inside", "", sides["share_inside"], *sides["share_inside_range"]
        yield "largest inside", "", sides["inside"][0], *sides["inside"]
        yield "largest outside", "", sides["outside"][0], *sides["outside"]
    for edge, share in zip(way["histogram"]["edges"], way["histogram"]["shares"]):
        yield "histogram from", edge, share, "", ""
    yield "samples", "", way["samples"], "", ""
    yield "spacing", "", way["spacing"], "", ""
