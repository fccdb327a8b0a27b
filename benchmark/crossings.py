# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the pairs of faces that cross before and after a decimation, with crossings kept out and allowed.

blender --background --python benchmark/crossings.py -- [MESH...] [--tolerance 1%] [--write FILE.md] [--hostile]

The meshes are hollow spheres of radius 1 with thin walls, made here, and each MESH. Each is decimated at five tolerances
within 2 % of the one asked for, because a small change of the tolerance changes the count by chance. Runs with crossings
kept out and allowed take turns, on one thread. The table has the means of the triangles left and of the processor times,
and the most crossing pairs of the five. Every result is judged both ways by tolvol.directed_hausdorff. The script fails if
a result has more crossing pairs with crossings kept out than its mesh.
"""

import statistics
import sys
import time
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parent
sys.path[:0] = [str(FOLDER), str(ROOT / "blender_scripts"), str(ROOT / "tests" / "python")]
import command_line as cli  # noqa: E402
import meshes as shapes  # noqa: E402
import models  # noqa: E402
import tables  # noqa: E402
import thin_walls  # noqa: E402
from addon.native import module as tolvol  # noqa: E402
from generated import sphere  # noqa: E402
from machine import machine  # noqa: E402

WALLS = (0.05, 0.02, 0.01)
CUTS = 5  # of the spheres, each of which has 20,480 triangles then
EFFORTS = ("fast", "thorough")
AROUND = (0.98, 0.99, 1, 1.01, 1.02)  # the tolerances, over the one asked for


def hollow_sphere(wall):
    vertices, triangles = sphere(CUTS)
    vertices, triangles = shapes.join((vertices, triangles), (vertices * (1 - wall), triangles[:, ::-1]))
    return vertices.astype(np.float32), triangles


def meshes(paths):
    """Yields the name and the arrays of each mesh."""
    for wall in WALLS:
        yield (f"hollow sphere, wall {wall}", *hollow_sphere(wall))
    for path in paths:
        yield (Path(path).name, *models.read(path))


def pairs(vertices, triangles):
    return len(tolvol.crossing_pairs(vertices, triangles))


def run(vertices, triangles, tolerance, effort):
    """Returns two tuples (mean of triangles left, most crossing pairs, mean of processor seconds): kept out and allowed."""
    runs = {"keep_out": [], "allow": []}
    for share in AROUND:
        volume = tolvol.ToleranceVolume(vertices, triangles, share * tolerance, threads=1)
        for crossings, of_kind in runs.items():  # in turns, so that a busy machine slows both
            start = time.process_time()
            found = tolvol.decimate(vertices, triangles, volume, effort=effort, crossings=crossings, threads=1)
            spent = time.process_time() - start
            result, reference = (found.vertices, found.triangles), (vertices, triangles)
            for a, b in ((result, reference), (reference, result)):
                if tolvol.directed_hausdorff(*a, *b, bound=volume.tolerance).upper > volume.tolerance:
                    raise SystemExit("a result is not within the tolerance both ways")
            of_kind.append((len(found.triangles), pairs(*result), spent))
    columns = [list(zip(*of_kind)) for of_kind in runs.values()]
    return [(statistics.mean(left), max(crossing), statistics.mean(spent)) for left, crossing, spent in columns]


def arguments():
    parser = cli.Parser("benchmark/crossings.py", description=__doc__.split("\n\n")[0], epilog=__doc__.split("\n\n")[2])
    parser.add_argument("meshes", metavar="MESH", nargs="*", help="a file that is decimated as well")
    parser.add_argument(
        "--tolerance", type=cli.length, default=cli.length("1%"), metavar="T", help="N%% of size, or a length (1%%)"
    )
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    parser.add_argument(
        "--hostile", action="store_true", help="only make a million collapses on thin-walled models, judged by CGAL"
    )
    return parser.parse()


def main(options):
    if options.hostile:
        return 0 if thin_walls.run() else 1
    rows, worse = [], []
    for name, vertices, triangles in meshes(options.meshes):
        before = pairs(vertices, triangles)
        tolerance = cli.in_units(options.tolerance, tolvol.diagonal(vertices, triangles))
        for effort in EFFORTS:
            (left, after, seconds), (left_allowed, allowed, seconds_allowed) = run(
                vertices, triangles, tolerance, effort
            )
            if after > before:
                worse.append(f"{name}, {effort}")
            counts = (len(triangles), before, after, allowed, round(left), round(left_allowed))
            rows.append([name, effort, *(f"{count:,}" for count in counts), f"{seconds:.2f}", f"{seconds_allowed:.2f}"])
            print(*rows[-1], sep="\t", flush=True)
    heads = [
        "Mesh",
        "Effort",
        "Triangles",
        "Crossing pairs before",
        "after, kept out",
        "after, allowed",
        "Triangles left, kept out",
        "allowed",
        "Processor seconds, kept out",
        "allowed",
    ]
    if options.write:
        text = f"{machine()}\n\n{tables.table(heads, rows, 'll' + 'r' * (len(heads) - 2))}"
        tables.write(options.write, "crossings", text)
    if worse:
        print("more crossing pairs than before:", ", ".join(worse))
    return 1 if worse else 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
