# SPDX-License-Identifier: GPL-3.0-or-later
"""Says whether a file is within the tolerance of another, in both directions."""

import time

from ..shared.command.arguments import NOT_PROVED, file_name, in_units, length, require_within_size, whole_number
from ..shared.proof import measure, report
from ..shared.proof.verdict import Verdict
from . import mesh_files

TEXTS = (
    f"Says PASS if every point of A is within the tolerance of B and every point of B within that of A, proved,\n"
    f"else FAIL. {mesh_files.FORMATS}",
    "Percentages are of the size of B, which is the longest diagonal of its bounding box. Exit codes: 0 PASS; 2 bad usage or\n"
    "input; 3 FAIL; 1 a bug.",
)


def add(parser):
    """Adds all options to a parser."""
    parser.add_argument("a", type=file_name, metavar="A", help="the mesh that is judged")
    parser.add_argument("b", type=file_name, metavar="B", help="the reference")
    parser.add_argument(
        "--tolerance", type=length, required=True, metavar="T", help="N%% of size, or a length in the files' units"
    )
    parser.add_argument("--one-sided", action="store_true", help="judge only the distance from A to B")
    parser.add_argument("--threads", type=whole_number(1), metavar="N", help="default: all cores")


def check(options):
    """Runs the command and returns its exit code."""
    began = time.perf_counter()
    for path in (options.a, options.b):
        mesh_files.extension_of(path)
    files = [mesh_files.read(path) for path in (options.a, options.b)]
    for repair in (repair for file in files for repair in file.repairs):
        print(f"note: {repair['message']}")
    surface, reference = (mesh_files.surface_of(file.objects[0]) for file in files)
    size = reference.size()
    tolerance = in_units(options.tolerance, size)
    require_within_size(tolerance, size)
    pairs = [(each.world(), each.arrays.triangles) for each in (surface, reference)]
    ways = mesh_files.followed(
        "measuring", lambda progress: measure.both_ways(*pairs, tolerance, options.threads, progress)
    )
    found = Verdict(tolerance, *ways, two_sided=not options.one_sided)
    print(
        f"{found.word}: tolerance {100 * tolerance / size:.4g} % = {tolerance:.3g}, "
        f"A within {report.percent(found.forward.upper, size)} of B, B within {report.percent(found.backward.upper, size)} "
        f"of A ({found.ways}), {report.duration(time.perf_counter() - began)}"
    )
    return 0 if found.passed else NOT_PROVED
