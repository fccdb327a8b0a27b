# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how often per second a mesh can be deformed by a lattice, checked as a whole, and its distances computed.

blender --background --python benchmark/deformation.py -- MESH [--tolerance 1%] [--threads N]

MESH may be suzanne-4, Blender's monkey with 251,904 triangles. Times are the best of five turns.
"""

import sys
import time
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parent / "blender_scripts")]
import command_line as cli  # noqa: E402
import models  # noqa: E402
from addon import native  # noqa: E402

TURNS = 5
POINTS = 5  # control points of the lattice along each axis
MARGIN = 0.05  # space between the mesh and the lattice, as a share of the mesh's box


def lattice(vertices, length):
    """Returns a lattice that moves every part of the mesh by less than `length`, and not all parts alike."""
    lower, size = vertices.min(0), np.ptp(vertices, axis=0)
    domain = np.diag([*((1 + 2 * MARGIN) * size), 1.0])
    domain[:3, 3] = lower - MARGIN * size
    rest = native.module.lattice_points(POINTS, domain)
    moved = rest + np.random.default_rng(1).uniform(-length, length, rest.shape) / np.sqrt(3)
    return native.module.Lattice(moved, domain)


def seconds(call):
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def arguments():
    parser = cli.Parser("benchmark/deformation.py", description=__doc__.splitlines()[0])
    parser.add_argument("mesh", metavar="MESH", help="a file, or suzanne-4")
    parser.add_argument("--tolerance", type=cli.length, default="1%", help="a length, or N%% of size (default: 1%%)")
    parser.add_argument("--threads", type=cli.whole_number(1), metavar="N", help="default: all cores")
    return parser.parse()


def main(options):
    if options.mesh in models.LEVELS:
        vertices, triangles = models.arrays(models.build(options.mesh))
    else:
        vertices, triangles = models.read(options.mesh)
    tolerance = cli.in_units(options.tolerance, native.module.diagonal(vertices, triangles))
    volume = native.module.ToleranceVolume(vertices, triangles, tolerance)
    inside, beyond = (lattice(vertices, share * tolerance) for share in (0.9, 9))
    threads = {"threads": options.threads}
    deform = native.module.deform
    moved = deform(vertices, inside, triangles, volume, **threads)
    assert moved.report["permitted_fraction"] == 1
    calls = {
        "deform": lambda: deform(vertices, inside, **threads),
        "deform + check": lambda: deform(vertices, inside, triangles, volume, **threads),
        "distances": lambda: volume.distance(moved.vertices, **threads),
        "blocked, with its fraction": lambda: deform(vertices, beyond, triangles, volume, **threads),
        "pulled back": lambda: deform(vertices, beyond, triangles, volume, mode="pull_back", **threads),
    }
    best = dict.fromkeys(calls, np.inf)
    for _ in range(TURNS):
        for name, call in calls.items():
            best[name] = min(best[name], seconds(call))
    for name, value in best.items():
        print(f"{name:27} {1e3 * value:8.1f} ms  {len(triangles) / value / 1e6:6.2f} M triangles/s")
    feedback = best["deform + check"] + best["distances"]
    print(f"{len(triangles):,} triangles deformed, checked and measured {1 / feedback:.1f} times per second")
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
