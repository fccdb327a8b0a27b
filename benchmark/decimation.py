# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures triangles, certified distances and times of tolvol.decimate, of the same loop without checks, and of OpenMesh.

blender --background --python benchmark/decimation.py -- [MESH...] --tolerance 1% --json FILE
    [--one-sided] [--hostile [--method NAME]] [--threads N]

Without MESH the script takes Blender's monkey with 62,976 and with 251,904 triangles and with noise. Times are the best of
three turns, in seconds; `ratio` is (field + decimate) / unbounded. Exit codes: 0 if all results are proved, 2 for bad usage or
input, 3 if any result is not proved.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parent / "blender_scripts")]
import command_line as cli  # noqa: E402
import hostile  # noqa: E402
import models  # noqa: E402
import table1  # noqa: E402
import tables  # noqa: E402
from addon.native import module as tolvol  # noqa: E402
from machine import machine  # noqa: E402
from peak_memory import PeakMemory  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "build" / "release" / "python"))

REPEATS = 3


class Stopwatch:
    """Keeps the shortest time of each of several calls. The calls take turns, so that a drift of the machine's speed affects
    all of them alike."""

    def __init__(self):
        self.seconds = {}

    def __call__(self, name, call, *arguments):
        started = time.perf_counter()
        result = call(*arguments)
        elapsed = time.perf_counter() - started
        self.seconds[name] = min(elapsed, self.seconds.get(name, elapsed))
        return result


def measure(name, vertices, triangles, options):
    """Returns one entry of `meshes`."""
    import tolvol_baselines  # This module is built with the tests and never packed.

    threads = options.threads
    tolerance = cli.in_units(options.tolerance, tolvol.diagonal(vertices, triangles))
    two_sided = not options.one_sided

    def build():
        return tolvol.ToleranceVolume(vertices, triangles, tolerance, threads=threads)

    def decimate(volume):
        return tolvol.decimate(vertices, triangles, volume, two_sided=two_sided, threads=threads)

    def unbounded(count):
        return tolvol.decimate(vertices, triangles, None, target_triangles=count, threads=threads)

    memory = PeakMemory()
    decimate(build())
    held = memory.peak() - memory.before

    timed = Stopwatch()
    for _ in range(REPEATS):
        volume = timed("field", build)
        result = timed("decimate", decimate, volume)
        count = len(result.triangles)
        timed("unbounded", unbounded, count)
        timed("openmesh", tolvol_baselines.decimate_openmesh, vertices, triangles, count)
    seconds = timed.seconds

    reference = vertices.astype(np.float64), triangles
    stored = result.vertices.astype(np.float64), result.triangles
    forward = tolvol.directed_hausdorff(*stored, *reference, bound=tolerance, threads=threads)
    backward = tolvol.directed_hausdorff(*reference, *stored, bound=tolerance if two_sided else None, threads=threads)
    return {
        "file": name,
        "triangles_in": len(triangles),
        "triangles_out": count,
        "tolerance": tolerance,
        "two_sided": two_sided,
        "forward": [forward.lower, forward.upper],
        "backward": [backward.lower, backward.upper],
        "proved": forward.upper <= tolerance and (backward.upper <= tolerance or not two_sided),
        "precision": volume.precision,
        "peak_memory": held,
        "seconds": seconds,
        "ratio": (seconds["field"] + seconds["decimate"]) / seconds["unbounded"],
    }


def line(entry):
    seconds, percent = entry["seconds"], 100 / entry["tolerance"]
    return (
        f"{entry['file']}: {entry['triangles_in']:,} -> {entry['triangles_out']:,} triangles, "
        f"result within {entry['forward'][1] * percent:.1f} % of the tolerance, "
        f"reference within {entry['backward'][1] * percent:.1f} %, "
        f"field {seconds['field']:.2f} s, decimation {seconds['decimate']:.2f} s, "
        f"unbounded {seconds['unbounded']:.2f} s (ratio {entry['ratio']:.2f}), OpenMesh {seconds['openmesh']:.2f} s, "
        f"peak memory {entry['peak_memory'] / 1e6:.0f} MB"
    )


def meshes(paths):
    """Yields (name, vertices float32, triangles) of the files, or of the models if no files are given."""
    for path in paths:
        yield path, *models.read(path)
    for name in () if paths else models.LEVELS:
        yield name, *models.arrays(models.build(name))


def print_table1(figures, options):
    """Measures every mesh, and the largest one with each triangle cut in four."""
    cases = list(meshes(options.mesh))
    cases.append(table1.million(*max(cases, key=lambda case: len(case[2]))))
    figures["table1"] = []
    for case in cases:
        for entry in table1.measure(*case, Stopwatch, PeakMemory, options.threads):
            print(f"{entry['how']}, {entry['model']}: {entry['triangles']:,} -> {entry['left']:,}", flush=True)
            figures["table1"].append(entry)
    text = table1.text(figures["table1"])
    print(text)
    if options.write:
        tables.write(options.write, "table 1", f"{figures['machine']}, version {figures['version']}.\n\n{text}")
    if options.json:
        Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")
    return 0


def arguments():
    parser = cli.Parser(
        "benchmark/decimation.py", description=__doc__.split("\n\n")[0], epilog=__doc__.split("\n\n")[2]
    )
    parser.add_argument("mesh", nargs="*", metavar="MESH", help=".obj, .ply or .stl")
    parser.add_argument(
        "--tolerance", type=cli.length, default="1%", metavar="T", help="N%% of size (1%%), or a length"
    )
    parser.add_argument("--json", metavar="FILE", help="write the figures to this file")
    parser.add_argument(
        "--one-sided", action="store_true", help="keep only the result within the tolerance of the reference"
    )
    parser.add_argument(
        "--hostile", action="store_true", help="also try a million misleading candidates on each of ten references"
    )
    parser.add_argument(
        "--method", choices=hostile.METHODS, default="certificate", help="the check that these candidates are tried on"
    )
    parser.add_argument("--table1", action="store_true", help="only make Table 1 of [Botsch04], printed and measured")
    parser.add_argument("--write", metavar="FILE.md", help="put Table 1 into this file")
    parser.add_argument("--threads", type=cli.whole_number(1), metavar="N", help="default: all cores")
    return parser.parse()


def main(options):
    if options.json:
        cli.require_folder(options.json, "--json")

    figures = {"version": tolvol.__version__, "machine": machine(), "arguments": sys.argv[sys.argv.index("--") + 1 :]}
    if options.table1:
        return print_table1(figures, options)
    figures["meshes"] = []
    references = []
    for name, vertices, triangles in meshes(options.mesh):
        entry = measure(name, vertices, triangles, options)
        figures["meshes"].append(entry)
        references.append((name, vertices, triangles, entry["tolerance"]))
        print(line(entry), flush=True)
    proved = all(entry["proved"] for entry in figures["meshes"])
    if options.hostile:
        figures["hostile"] = []
        for reference in (*references, *hostile.references(options.method)):
            entry = hostile.judge(*reference, options.threads, options.method)
            figures["hostile"].append(entry)
            print(hostile.line(entry), flush=True)
            proved = proved and (entry["wrong_accepts"] == 0 or options.method in hostile.NOT_PROVING)
    if options.json:
        Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")
    return 0 if proved else cli.NOT_PROVED


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
