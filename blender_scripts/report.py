# SPDX-License-Identifier: GPL-3.0-or-later
"""How far two mesh files are from each other: certified largest distances both ways, mean, RMS, shares beyond bounds.

blender --background --python blender_scripts/report.py -- A B [--bounds 0.5%,1%] [--report FILE.json] [--threads N]
"""

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
try:
    import command_line as cli
    from addon import file_io, measure, native, report, volume
except ImportError as error:  # left alone, Blender would end with exit code 0
    print(f"report.py: Blender's Python lacks something: {error}; install Debian's python3-numpy", file=sys.stderr)
    sys.exit(2)

_DESCRIPTION = """\
Measures the surface of A against that of B, and B against A: the largest distance as an interval that is certain, the mean
and the root mean square over the area, and the share of the area that is farther than each bound."""

_EPILOG = """\
Percentages are of the size of B: the longest diagonal of its bounding box. Exit codes: 0 measured; 2 bad usage or input; 1 a
bug."""


def bounds(text):
    found = [cli.length(part) for part in text.split(",") if part.strip()]
    if not found:
        raise argparse.ArgumentTypeError("no bound is given")
    return found


def arguments():
    parser = cli.Parser("report.py", description=_DESCRIPTION, epilog=_EPILOG)
    parser.add_argument("a", metavar="A", help=" ".join(file_io.EXTENSIONS))
    parser.add_argument("b", metavar="B")
    parser.add_argument("--bounds", type=bounds, default=[], metavar="T,T", help="each N%% of size, or a length")
    parser.add_argument("--report", metavar="FILE.json", help="write the numbers there")
    parser.add_argument("--threads", type=cli.whole_number(0), default=0, metavar="N", help="0: all cores (default)")
    return parser.parse()


def main(options):
    for path in (options.a, options.b):
        file_io.extension_of(path)
    if options.report:
        cli.require_folder(options.report, "--report")
    surfaces, files = [], []
    for path in (options.a, options.b):
        found = file_io.read_file(path)
        surfaces.append(volume.joined([volume.surface_of(ob) for ob in found.objects]))
        files.append({"file": path, **found.counts})
    size = surfaces[1].size()
    lengths = [cli.in_units(bound, size) for bound in options.bounds]
    a, b = ((surface.world(), surface.arrays.triangles) for surface in surfaces)
    result = {"version": native.module.__version__, "a": files[0], "b": files[1], "size": size}
    for way, pair, label in (("forward", (a, b), "A from B"), ("backward", (b, a), "B from A")):
        largest = measure.largest_distance(*pair, threads=options.threads)
        spread = native.module.deviation(*pair[0], *pair[1], bounds=tuple(lengths), threads=options.threads)
        shares = [float(share) for share in spread.share_beyond]
        result[way] = {
            "largest": [largest.lower, largest.upper],
            "mean": float(spread.mean),
            "rms": float(spread.rms),
            "beyond": [{"bound": bound, "share": share} for bound, share in zip(lengths, shares)],
        }
        beyond = "".join(f", {100 * share:.3f} % beyond {bound:.3g}" for bound, share in zip(lengths, shares))
        print(
            f"{label}: largest {largest.lower:.4g} to {largest.upper:.4g} (at most {report.percent(largest.upper, size)}), "
            f"mean {spread.mean:.3g}, RMS {spread.rms:.3g}{beyond}"
        )
    if options.report:
        Path(options.report).write_text(json.dumps(result, indent=1) + "\n")
    return 0


cli.run(__file__, arguments, main)
