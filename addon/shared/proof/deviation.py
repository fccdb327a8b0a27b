# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the deviation of two surfaces in both directions and writes it as .json, .csv or .html.

A deviation is a dictionary, as a .json report holds it. Lengths are in the unit that it names, and shares are shares
of the area (0 to 1). `largest` and every entry whose name ends in _range is an interval that certainly contains the true
number:

    version, method, unit, size   `size` is the length that is 100 %
    date, blend_file              only of Save Report: local time with its offset, ISO 8601; the name of the file, or None
    tolerance                     {absolute, percent, given_in}, or None; given_in: "percent" or "length"
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

A report of several objects is a dictionary, too: {version, date, blend_file, verdict, objects, not_measured}. `verdict` is
that of all, `objects` are their deviations, and `not_measured` are selected objects as {name, reason}.
"""

import json
from pathlib import Path

import numpy as np

from .. import package
from . import deviation_page, deviation_table, measure, solidity
from .verdict import NOT_CHECKED, Verdict, together

PERCENTILES = (50, 90, 95, 99, 99.9)
EXTENSIONS = (".json", ".csv", ".html")

_METHOD = "certified interval; one sample for each piece of the surface, ranges from bounds on the pieces"
_BINS = 30  # the approximate number of bins on each side of the histogram


def deviation(
    a, b, size, tolerance=None, bounds=(), unit="", threads=None, progress=None, two_sided=True, given_in="percent"
):
    """Returns the dictionary that is described above, without `a` and `b`, for two Surfaces.

    unit: the name of the unit of the surfaces; given_in: whether the tolerance was given as "percent" or "length".
    """
    bounds = sorted({*bounds, *([] if tolerance is None else [tolerance])})
    ways = {}
    for number, (way, surface, other) in enumerate((("forward", a, b), ("backward", b, a))):
        pair = (surface.world(), surface.arrays.triangles), (other.world(), other.arrays.triangles)
        with measure.part_of(progress, number / 2, number / 2 + 0.25):
            spread = package.module.deviation(
                *pair[0], *pair[1], bounds=bounds, percentiles=PERCENTILES, threads=threads, progress=progress
            )
        with measure.part_of(progress, number / 2 + 0.25, number / 2 + 0.5):
            largest = measure.largest_distance(*pair, tolerance, threads, progress, again=False)
        ways[way] = largest, spread, surface.arrays.polygons
    facts = {name: solidity.facts(surface, threads, progress, again=False) for name, surface in (("a", a), ("b", b))}
    largest = [measured for measured, _, _ in ways.values()]
    # Both histograms have the same scale, so that they can be compared.
    edges = _edges(max(found.upper for found in largest), tolerance)
    return {
        "version": package.module.__version__,
        "method": _METHOD,
        "unit": unit,
        "size": size,
        "tolerance": None
        if tolerance is None
        else {"absolute": tolerance, "percent": 100 * tolerance / size, "given_in": given_in},
        "two_sided": two_sided,
        "verdict": None if tolerance is None else Verdict(tolerance, *largest, two_sided=two_sided).word,
        "solidity": facts | {"change": solidity.change(facts["a"], facts["b"])},
        **{way: _way(*of_way, bounds, edges) for way, of_way in ways.items()},
    }


def several(runs, not_measured, about):
    """Returns the report of several objects. not_measured: {name, reason}; about: date and blend_file."""
    words = [run["verdict"] for run in runs] + [NOT_CHECKED] * bool(not_measured)
    return {
        "version": package.module.__version__,
        **about,
        "verdict": together(words),
        "objects": runs,
        "not_measured": not_measured,
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
            {"bound": bound, "share": 0.0, "range": [0.0, 0.0]}
            if largest.within(bound)
            else {"bound": bound, "share": share, "range": ends}
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


def content(document, path, pictures=()):
    """Returns the bytes of a file, in the format of the path's extension.

    document: a deviation with its `a` and `b`, or a report of several objects; pictures: a list of Pictures, which only the
    .html page shows, or one such list for each of several objects.
    """
    writers = {
        ".json": lambda: json.dumps(document, indent=1) + "\n",
        ".csv": lambda: deviation_table.table(document),
        ".html": lambda: deviation_page.page(document, pictures),
    }
    # The name of a file may have bytes that are not valid text.
    return writers[Path(path).suffix.lower()]().encode("utf-8", "backslashreplace")
