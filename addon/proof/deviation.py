# SPDX-License-Identifier: GPL-3.0-or-later
"""The deviation of two surfaces, both ways: what is measured, and the files it is written to.

A deviation is a dictionary as a .json report holds it; lengths are in the units of the surfaces, shares are of the area
(0 to 1), and what ends in _range, as `largest` itself, is an interval that the true number is certainly in:

    version, method, unit, size   `size` is what 100 % is
    tolerance                     {absolute, percent}, or None
    a, b                          {name or file, vertices, triangles}
    forward, backward             a from b, and b from a; each:
        largest, position, triangle, face               where it was seen; face: the polygon, None in several objects
        mean, mean_range, mean_error, rms, rms_range    mean_error: of the estimate, a standard deviation at most
        percentiles   [{percent, distance, range}]
        beyond        [{bound, share, range}]           farther than the bound
        sides         {mean, mean_range, share_inside, share_inside_range, inside, outside}, where the other surface is
                      closed, else None: `inside`, `outside` are the largest distances there
        histogram     {edges, shares}                   with the sign, where there are sides
        samples, spacing
"""

import csv
import io
import json
import re
from pathlib import Path

import numpy as np

from .. import native
from . import deviation_page, measure

PERCENTILES = (50, 90, 95, 99, 99.9)
EXTENSIONS = (".json", ".csv", ".html")

_METHOD = "certified interval; one sample for each piece of the surface, ranges from bounds on the pieces"
_FORMULA = "=+-@\uff1d\uff0b\uff0d\uff20"  # the latter: the wide ones of East Asian fonts
_BINS = 30  # a side of the histogram, about


def deviation(a, b, size, tolerance=None, bounds=(), unit="", threads=0, progress=None):
    """The dictionary described above but for `a` and `b`, of two Surfaces."""
    bounds = sorted({*bounds, *([] if tolerance is None else [tolerance])})
    ways = {}
    for way, surface, other in (("forward", a, b), ("backward", b, a)):
        pair = (surface.world(), surface.arrays.triangles), (other.world(), other.arrays.triangles)
        spread = native.module.deviation(
            *pair[0], *pair[1], bounds=bounds, percentiles=PERCENTILES, threads=threads, progress=progress
        )
        ways[way] = measure.largest_distance(*pair, tolerance, threads, progress), spread, surface.arrays.polygons
    # The same scale both ways, so that the histograms can be compared.
    edges = _edges(max(largest.upper for largest, _, _ in ways.values()), tolerance)
    return {
        "version": native.module.__version__,
        "method": _METHOD,
        "unit": unit,
        "size": size,
        "tolerance": None if tolerance is None else {"absolute": tolerance, "percent": 100 * tolerance / size},
        **{way: _way(*found, bounds, edges) for way, found in ways.items()},
    }


def _edges(largest, tolerance):
    """Of the histogram from 0 on; the tolerance is one of them, unless it is too small to be seen."""
    top = max(largest, tolerance or 0.0) or 1.0
    bins = int(_BINS * tolerance / top) if tolerance else 0
    width = tolerance / bins if bins else top / _BINS
    return width * np.arange(np.ceil(top / width * (1 - 1e-9)) + 1)


def _way(largest, spread, polygons, bounds, edges):
    sides = spread.sides
    if sides:
        edges = np.concatenate([-edges[:0:-1], edges])
    most = largest.upper  # the bounds on the pieces do not know it
    # A distance may be above the end of the interval by its rounding.
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
    """The bytes of a deviation with its `a` and `b`, in the format that the extension of a path names.

    pictures: (caption, bytes of a PNG) pairs, for the page alone.
    """
    writers = {
        ".json": lambda: json.dumps(run, indent=1) + "\n",
        ".csv": lambda: table(run),
        ".html": lambda: deviation_page.page(run, pictures),
    }
    # A name of a file may have bytes that are no text.
    return writers[Path(path).suffix.lower()]().encode("utf-8", "backslashreplace")


def table(run):
    """The same as CSV: one number a row, with the parameter it is for and the ends of its range where it has one.

    Text that a spreadsheet would take for a formula has a ' before it.
    """
    rows = [("direction", "quantity", "at", "value", "lower", "upper")]
    rows += [("", "version", "", run["version"], "", ""), ("", "unit", "", run["unit"], "", "")]
    rows += [("", "size", "", run["size"], "", "")]
    if run["tolerance"]:
        rows += [("", "tolerance", "", run["tolerance"]["absolute"], "", "")]
    for name in ("a", "b"):
        rows += [("", f"{name} {key}", "", value, "", "") for key, value in run[name].items()]
    for way in ("forward", "backward"):
        rows += [(way, *row) for row in _rows(run[way])]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([_harmless(cell) for cell in row] for row in rows)
    return text.getvalue()


def _harmless(cell):
    """Names come from files of other people: as a formula one could run programs where the table is opened."""
    if not isinstance(cell, str):
        return cell
    line = re.sub(r"[\t\r\n]", " ", cell)  # a lone \r would begin a row for some readers
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
