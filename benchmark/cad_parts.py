# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the triangles that decimation leaves of CAD parts made of slivers: fans, strips and walls.

blender --background --python benchmark/cad_parts.py -- [MESH...] [--write FILE.md]

The parts are three of each kind in tests/fuzzing/kinds.py, of about 4,000 triangles, and each MESH. The placement *optimal*
may leave at most 2 % more triangles than *subset*, which keeps vertices where they are: the script fails if it leaves more.
Every result is judged both ways by tolvol.directed_hausdorff.
"""

import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parent
sys.path[:0] = [str(FOLDER), str(ROOT / "blender_scripts"), str(ROOT / "tests")]
from fuzzing import kinds  # noqa: E402

import command_line as cli  # noqa: E402
import models  # noqa: E402
import tables  # noqa: E402
from addon.native import module as tolvol  # noqa: E402
from machine import machine  # noqa: E402

TRIANGLES = 4000
SEEDS = (1, 2, 3)
PARTS = ("gear", "drilled_plate", "filleted_box", "fan", "coplanar_box")
TOLERANCES = (0.05, 0.1, 1)  # per cent
SETTINGS = {"optimal": {}, "subset": {"placement": "subset"}, "thorough": {"effort": "thorough"}}
ALLOWED = 1.02


def parts(paths):
    for kind in PARTS:
        for seed in SEEDS:
            vertices, triangles = kinds.KINDS[kind](np.random.default_rng(seed), TRIANGLES)
            name = f"{kind.replace('_', ' ')} {seed}"
            yield name, np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(triangles, np.int32)
    for path in paths:
        yield (Path(path).name, *models.read(path))


def counts(vertices, triangles, percent):
    """Returns the number of triangles left for each of SETTINGS."""
    tolerance = percent / 100 * tolvol.diagonal(vertices, triangles)
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    found = []
    for options in SETTINGS.values():
        result = tolvol.decimate(vertices, triangles, volume, **options)
        pair = (result.vertices, result.triangles), (vertices, triangles)
        for a, b in (pair, pair[::-1]):
            if tolvol.directed_hausdorff(*a, *b, bound=tolerance).upper > tolerance:
                raise SystemExit(f"{options} is not within {percent} % both ways")
        found.append(len(result.triangles))
    return found


def arguments():
    parser = cli.Parser("benchmark/cad_parts.py", description=__doc__.split("\n\n")[0], epilog=__doc__.split("\n\n")[2])
    parser.add_argument("meshes", metavar="MESH", nargs="*", help="a file that is decimated as well")
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    return parser.parse()


def main(options):
    rows, worse = [], []
    for name, vertices, triangles in parts(options.meshes):
        row = [name, f"{len(triangles):,}"]
        for percent in TOLERANCES:
            found = counts(vertices, triangles, percent)
            if found[0] > ALLOWED * found[1]:
                worse.append(f"{name} at {percent} %")
            row += [f"{count:,}" for count in found]
        rows.append(row)
        print(*row, sep="\t", flush=True)
    heads = ["Part", "Triangles", *(f"{percent} % {setting}" for percent in TOLERANCES for setting in SETTINGS)]
    if options.write:
        text = f"{machine()}\n\n{tables.table(heads, rows, 'l' + 'r' * (len(heads) - 1))}"
        tables.write(options.write, "CAD parts", text)
    if worse:
        print("more with optimal than with subset:", ", ".join(worse))
    return 1 if worse else 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
