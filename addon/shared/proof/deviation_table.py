# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a deviation, or a report of several objects, as a table (.csv)."""

import csv
import io

from . import report
from .deviation_units import tolerance_text
from .spreadsheet import harmless

_COLUMNS = ("direction", "quantity", "at", "value", "lower", "upper")


def table(document):
    """Returns a deviation as CSV: each row has one number, its parameter, and the ends of its range if it has one.

    In a report of several objects a column before the others names the object. Text that a spreadsheet would take for a
    formula gets a ' before it.
    """
    if "objects" in document:
        rows = [("object", *_COLUMNS)]
        rows += [("", *row) for row in _about(document)]
        rows += [("", "", "verdict", "", document["verdict"], "", "")]
        rows += [(other["name"], "", "not measured", "", other["reason"], "", "") for other in document["not_measured"]]
        for run in document["objects"]:
            rows += [(run["a"]["name"], *row) for row in _of_one(run)]
    else:
        rows = [_COLUMNS, *_about(document), *_of_one(document)]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([harmless(cell) for cell in row] for row in rows)
    return text.getvalue()


def _about(document):
    return [
        ("", name, "", document[name] or "", "", "") for name in ("version", "date", "blend_file") if name in document
    ]


def _of_one(run):
    """Returns the rows of one deviation."""
    rows = [("", "unit", "", run["unit"], "", ""), ("", "size", "", run["size"], "", "")]
    if run["tolerance"]:
        rows += [
            ("", "tolerance", "", run["tolerance"]["absolute"], "", ""),
            ("", "tolerance as text", "", tolerance_text(run), "", ""),
            ("", "directions", "", 2 if run["two_sided"] else 1, "", ""),
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
    return rows


def _flat(label):
    """Yields the entries of a label, each coordinate of its position by itself."""
    for key, value in label.items():
        if key == "position":
            yield from zip("xyz", value)
        else:
            yield key, value


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
