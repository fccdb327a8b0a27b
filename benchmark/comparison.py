# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares methods of checking the tolerance in the same decimation: triangles, time, memory and distances.

blender --background --python benchmark/comparison.py -- [MESH...] [--tolerance 1%,0.3%,0.1%] [--write FILE.md]
    [--methods NAME,...] [--json FILE] [--threads N]

MESH is an .obj, .ply or .stl file or a model of blender_scripts/models.py, suzanne by default. Every method runs in the loop
of tolvol.decimate, so that only the method differs. `time / QEM` is the time of building the method's grid and decimating,
over the time of the loop without any check down to the same count. It is the best of three turns, or of one turn if that
takes over 20 s. Distances are certified upper ends, in tolerances. --write puts the table between its two comment lines in a
Markdown file.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parent / "blender_scripts")]
import command_line as cli  # noqa: E402
import models  # noqa: E402
import tables  # noqa: E402
from addon.native import module as tolvol  # noqa: E402
from decimation import Stopwatch  # noqa: E402
from machine import machine  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "build" / "release" / "python"))

REPEATS, LONG = 3, 20  # number of turns; only one turn if that takes more than so many seconds
COARSE = 0.5  # nodes per tolerance
FINER = (8, 16)  # cells per tolerance of the finer permission grids that are tried
EQUAL = 1.1  # a finer grid counts as equal to the certificate up to so many times its triangles


class Method:
    """A method of checking the tolerance.

    run(vertices, triangles, tolerance, threads) returns vertices, triangles, the bytes of the method's grid, and the number
    of nodes or cells per tolerance.
    """

    def __init__(self, name, promise, run):
        self.name, self.promise, self.run = name, promise, run


def certified(two_sided, precision=None):
    def run(vertices, triangles, tolerance, threads):
        volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, precision=precision, threads=threads)
        result = tolvol.decimate(vertices, triangles, volume, two_sided=two_sided, threads=threads)
        distances = volume.grid()[0]
        # The grid stores a triangle with each distance, in as many bytes.
        memory = 2 * distances.strides[0] * distances.shape[0]
        return result.vertices, result.triangles, memory, volume.precision

    return run


def baseline(method, precision=None, placement="optimal"):
    def run(vertices, triangles, tolerance, threads):
        import tolvol_baselines  # This module is built with the tests and never packed.

        result = tolvol_baselines.decimate(vertices, triangles, tolerance, method, precision, placement, threads)
        return result[0], result[1], result[2]["memory"], precision

    return run


METHODS = {
    "both": Method("certificate, both ways", "both", certified(True)),
    "one": Method("certificate, one way", "forward", certified(False)),
    "coarse": Method("certificate, one way, coarse grid", "forward", certified(False, COARSE)),
    "grid": Method("permission grid [19]", "forward", baseline("permission_grid", 4)),
    "paper": Method("check as published", "none", baseline("paper_half_h", 1.1)),
    "query": Method("occlusion query, proved", "forward", baseline("occlusion_query", 4)),
    "samples": Method("vertex samples [11]", "none", baseline("vertex_samples", placement="subset")),
}


def equal_grid(enough, *case):
    """Returns the entry of the coarsest of the FINER permission grids that leaves at most `enough` triangles.

    Returns None if no such grid fits into memory.
    """
    for precision in FINER:
        try:
            entry = measure(
                Method(f"{METHODS['grid'].name}, finer", "forward", baseline("permission_grid", precision)), *case
            )
        except RuntimeError:  # The grid needs more memory than its limit.
            return None
        if entry["triangles"] <= enough:
            return entry
    return None


def measure(method, vertices, triangles, tolerance, threads):
    def unbounded(count):
        return tolvol.decimate(vertices, triangles, None, target_triangles=count)

    timed = Stopwatch()
    for turn in range(REPEATS):
        if turn and timed.seconds["bounded"] > LONG:
            break
        points, faces, memory, precision = timed("bounded", method.run, vertices, triangles, tolerance, threads)
        timed("unbounded", unbounded, len(faces))
    reference, stored = (vertices.astype(np.float64), triangles), (points.astype(np.float64), faces)

    def farthest(a, b, promised):
        return (
            tolvol.directed_hausdorff(*a, *b, bound=tolerance if promised else None, threads=threads).upper / tolerance
        )

    return {
        "method": method.name,
        "promise": method.promise,
        "precision": precision,
        "triangles": len(faces),
        "seconds": timed.seconds["bounded"],
        "ratio": timed.seconds["bounded"] / timed.seconds["unbounded"],
        "memory": memory,
        "forward": farthest(stored, reference, method.promise != "none"),
        "backward": farthest(reference, stored, method.promise == "both"),
    }


def compare(names, *case):
    """Returns an entry for each of the methods whose grid fits into memory."""
    entries = {}
    for name in names:
        if name == "coarse" and "one" in entries and entries["one"]["precision"] <= COARSE:
            continue  # The grid of the certificate was as coarse already.
        try:
            entries[name] = measure(METHODS[name], *case)
        except RuntimeError as error:
            print(f"{METHODS[name].name}: {error}", flush=True)
        if name == "grid" and "one" in entries:
            finer = equal_grid(EQUAL * entries["one"]["triangles"], *case)
            if finer:
                entries["finer"] = finer
    return list(entries.values())


def kept(entry):
    """Whether the result keeps the promise of the method."""
    return (entry["promise"] == "none" or entry["forward"] <= 1) and (
        entry["promise"] != "both" or entry["backward"] <= 1
    )


def distance(value, promised):
    return f"**{value:.3f}**" if promised else f"{value:.3f}"


def row(entry):
    precision = f"{entry['precision']:g}" if entry["precision"] else ""
    memory = f"{entry['memory'] / 1e6:,.2f} MB" if entry["memory"] else ""
    return [
        entry["method"],
        precision,
        f"{entry['triangles']:,}",
        f"{entry['ratio']:.2f}",
        memory,
        distance(entry["forward"], entry["promise"] != "none"),
        distance(entry["backward"], entry["promise"] == "both"),
    ]


HEADS = ["Method", "per ε", "Triangles", "Time / QEM", "Grid", "Result → reference", "Reference → result"]


def mesh_of(word):
    if word in models.LEVELS:
        return models.arrays(models.build(word))
    return models.read(word)


def percentages(text):
    return [cli.length(part) for part in text.split(",")]


def method_names(text):
    for name in text.split(","):
        if name not in METHODS:
            raise argparse.ArgumentTypeError(f"{name!r} is no method; there are: {', '.join(METHODS)}")
    return text.split(",")


def arguments():
    parser = cli.Parser(
        "benchmark/comparison.py", description=__doc__.split("\n\n")[0], epilog=__doc__.split("\n\n")[2]
    )
    parser.add_argument("mesh", nargs="*", metavar="MESH", default=["suzanne"], help="a file, or a model's name")
    parser.add_argument(
        "--tolerance", type=percentages, default="1%,0.3%,0.1%", metavar="T,...", help="default: %(default)s"
    )
    parser.add_argument(
        "--methods", type=method_names, default=",".join(METHODS), metavar="NAME,...", help="default: all, %(default)s"
    )
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    parser.add_argument("--json", metavar="FILE", help="write the figures to this file")
    parser.add_argument("--threads", type=cli.whole_number(1), metavar="N", help="default: all cores")
    return parser.parse()


def main(options):
    for option in ("write", "json"):
        if getattr(options, option):
            cli.require_folder(getattr(options, option), f"--{option}")
    figures, rows = {"machine": machine(), "meshes": []}, []
    for word in options.mesh:
        vertices, triangles = mesh_of(word)
        for wanted in options.tolerance:
            size = tolvol.diagonal(vertices, triangles)
            tolerance = cli.in_units(wanted, size)
            entries = compare(options.methods, vertices, triangles, tolerance, options.threads)
            title = f"{Path(word).stem}, {len(triangles):,} triangles, ε = {100 * tolerance / size:g} %"
            figures["meshes"].append({"mesh": word, "tolerance": tolerance, "size": size, "methods": entries})
            rows.append([f"***{title}***"] + [""] * (len(HEADS) - 1))
            rows += [row(entry) for entry in entries]
            print(title, *(" | ".join(row(entry)) for entry in entries), sep="\n", flush=True)
    if options.json:
        Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")
    if options.write:
        tables.write(options.write, "comparison", tables.table(HEADS, rows, "l" + "r" * (len(HEADS) - 1)))
    return 0 if all(kept(entry) for mesh in figures["meshes"] for entry in mesh["methods"]) else cli.NOT_PROVED


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
