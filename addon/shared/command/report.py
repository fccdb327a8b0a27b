# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the distance of two mesh files: certified largest distances both ways, statistics and histograms."""

import argparse
import datetime
import io
import sys
from pathlib import Path

from ..files import safe_files
from ..proof import deviation, deviation_pictures, report, solidity
from ..surface import joined
from . import pictures
from .arguments import NOT_PROVED, file_name, in_units, length, whole_number
from .decimate import reads

DESCRIPTION = """\
Measures the distances from the surface of A to that of B and from B to A: the largest distance as a certified interval, with its
place; mean, root mean square and percentiles over the area; the share of the area that is farther than each bound; and the parts
inside and outside, if the other surface is closed. Says of both whether they are closed, manifold, oriented and free of crossing
faces, with the number of shells, area and volume of both and the change from B to A."""

EPILOG = """\
Percentages are of the size of B, which is the longest diagonal of its bounding box. Exit codes: 0 measured; 2 bad usage or input;
3 A lacks what --require asks for; 1 a file that could not be written, or a bug. Only with exit codes 0 and 3 are reports and
pictures written, all of them or none, and never over a file that is read. Symbolic links are followed."""


def bounds(text):
    found = [length(part) for part in text.split(",") if part.strip()]
    if not found:
        raise argparse.ArgumentTypeError("no bound is given")
    return found


def requirements(text):
    words = [word.strip() for word in text.split(",")]
    for word in words:
        if word not in solidity.REQUIREMENTS:
            raise argparse.ArgumentTypeError(f"{word!r} is none of {', '.join(solidity.REQUIREMENTS)}")
    return words


def report_file(text):
    if Path(text).suffix.lower() not in deviation.EXTENSIONS:
        raise argparse.ArgumentTypeError(f"{text!r} does not end in {', '.join(deviation.EXTENSIONS)}")
    return text


def add(parser):
    """Adds all options to a parser."""
    parser.add_argument("a", type=file_name, metavar="A")
    parser.add_argument("b", type=file_name, metavar="B")
    parser.add_argument(
        "--tolerance",
        type=length,
        metavar="T",
        help="the tolerance that the distances are compared with: N%% of size, or a length",
    )
    parser.add_argument(
        "--bounds",
        type=bounds,
        default=[],
        metavar="T,T",
        help="report the share of the area beyond each of these distances; each is N%% of size, or a length",
    )
    parser.add_argument(
        "--unit", default="", metavar="NAME", help="the unit of the files' lengths, named in the report"
    )
    parser.add_argument(
        "--report",
        type=report_file,
        action="append",
        default=[],
        metavar="FILE",
        help=f"write the report to this file ({' '.join(deviation.EXTENSIONS)}); may be given more than once",
    )
    parser.add_argument(
        "--require",
        type=requirements,
        default=[],
        metavar="WORD,WORD",
        help=f"exit with code 3 unless A is all of this: {', '.join(solidity.REQUIREMENTS)}; a closed surface is oriented "
        "only if its faces look outwards",
    )
    parser.add_argument(
        "--picture", type=file_name, metavar="FILE.png", help="draw A to this file, coloured by its distance from B"
    )
    parser.add_argument("--threads", type=whole_number(1), metavar="N", help="default: all cores")


def measure(options, files):
    """Runs the command and returns its exit code. Raises Stop, Refused and the errors of the package.

    files: as in decimate.py.
    """
    with safe_files.Staged() as staged:
        return _measure(options, files, staged)


def _measure(options, files, staged):
    for path in (options.a, options.b):
        files.extension_of(path)
    reports = [safe_files.Target(path, "--report") for path in options.report]
    picture = safe_files.Target(options.picture, "--picture") if options.picture else None
    targets = [*reports, picture] if picture else reports
    read = reads("A", options.a) + reads("B", options.b)
    safe_files.require_apart([(target.name, target.place) for target in targets], read)
    if picture:
        pictures.require("--picture", options.picture)
    for target in targets:  # This refuses a folder that cannot be written to before the work begins.
        if not target.is_device:
            staged.folder(target)
    surfaces, named = [], []
    for path in (options.a, options.b):
        found = files.read(path)
        surfaces.append(joined([files.surface_of(ob) for ob in found.objects]))
        named.append({"file": path, **found.counts})
        for repair in found.repairs:
            print(f"note: {repair['message']}")
    size = surfaces[1].size()
    tolerance = in_units(options.tolerance, size) if options.tolerance else None
    lengths = [in_units(bound, size) for bound in options.bounds]
    given_in = "percent" if options.tolerance and options.tolerance[1] else "length"
    asked = (*surfaces, size, tolerance, lengths, options.unit, options.threads)
    result = files.followed("measuring", lambda progress: deviation.deviation(*asked, progress, given_in=given_in))
    date = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
    result |= {"a": named[0], "b": named[1], "date": date}
    for label, name in (("A", "a"), ("B", "b")):
        print(f"{label}: {solidity.line(result['solidity'][name])}")
    print(f"A: {solidity.measures_line(*(result['solidity'][key] for key in ('a', 'b', 'change')))}")
    for way, label in (("forward", "A from B"), ("backward", "B from A")):
        print(_line(result[way], label, size))
    if picture:
        pair = [(surface.world(), surface.arrays.triangles) for surface in surfaces]
        png = io.BytesIO()
        reach = deviation_pictures.reach(result)
        pictures.save_deviation(png, *pair, reach, size, options.a, options.threads)
        staged.write(picture, png.getvalue())
    drawn = _drawn(surfaces, result, options)
    for path, target in zip(options.report, reports):
        staged.write(target, deviation.content(result, path, drawn))
    staged.publish()
    lacking = solidity.lacking(result["solidity"]["a"])
    missed = [f"not {word} ({lacking[word]})" for word in options.require if word in lacking]
    if missed:
        print(f"--require: A is {', '.join(missed)}", file=sys.stderr)
    return NOT_PROVED if missed else 0


def _drawn(surfaces, result, options):
    """Returns the pictures of both directions, if there is an .html report."""
    if not any(Path(path).suffix.lower() == ".html" for path in options.report):
        return []
    if reason := deviation_pictures.unavailable():
        print(f"note: no pictures in the report: {reason}")
        return []
    names = [Path(path).name for path in (options.a, options.b)]
    captions = [f"{own}, coloured by its distance from {other}" for own, other in (names, names[::-1])]
    up = pictures.up_axis(options.a)
    return deviation_pictures.drawn(*surfaces, result, captions, up=up, threads=options.threads)


def _line(way, label, size):
    lower, upper = way["largest"]
    place = ", ".join(f"{x:.6g}" for x in way["position"])
    beyond = "".join(f", {100 * entry['share']:.3f} % beyond {entry['bound']:.3g}" for entry in way["beyond"])
    return (
        f"{label}: largest {lower:.4g} to {upper:.4g} (at most {report.percent(upper, size)}) at ({place}), "
        f"mean {way['mean']:.3g}, RMS {way['rms']:.3g}{beyond}"
    )
