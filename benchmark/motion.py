# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the time of a dab of 1,000 vertices under tolvol.Guard, and the speed of tolvol.smooth.

blender --background --python benchmark/motion.py -- --tolerance 1% [--threads N]

The meshes are noisy tori of 40,000 and of a million vertices. Times are the best of several turns. Each dab is made once
where no vertex is held back, and once where vertices have reached the tolerance.
"""

import sys
import time
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parent / "blender_scripts")]
import command_line as cli  # noqa: E402
from addon import native  # noqa: E402

TURNS = 8
MOVED = 1000  # number of vertices that a dab moves
NOISE = 0.0005  # standard deviation of the noise along the normal; the torus has radii 1 and 0.4
ITERATIONS = 10
SIDES = (200, 1000)


def torus(side):
    """Returns a closed torus (vertices float32 (side * side, 3), triangles) with noise like that of a scanner."""
    u, v = (a.ravel() for a in np.meshgrid(*2 * [np.arange(side) * 2 * np.pi / side], indexing="ij"))
    tube = 0.4 + np.random.default_rng(1).normal(0, NOISE, len(u))
    ring = 1 + tube * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)], 1).astype(np.float32)
    a = np.arange(side * side).reshape(side, side)
    b, c, d = np.roll(a, -1, 0), np.roll(np.roll(a, -1, 0), -1, 1), np.roll(a, -1, 1)
    triangles = [np.stack([p.ravel() for p in corners], 1) for corners in ((a, b, c), (a, c, d))]
    return vertices, np.concatenate(triangles).astype(np.int32)


def seconds(call, *arguments, **options):
    start = time.perf_counter()
    result = call(*arguments, **options)
    return time.perf_counter() - start, result


def dabs(vertices, triangles, volume, threads, **options):
    """Returns the best seconds of a dab that stays inside and of one that is held back, and how many vertices that held."""
    guard = native.module.Guard(vertices, triangles, volume, threads=threads, **options)
    inside, beyond = np.inf, np.inf
    for turn in range(TURNS):
        positions = vertices.copy()
        guard.reset(positions)
        centre = positions[turn * len(positions) // TURNS]
        distance = np.linalg.norm(positions - centre, axis=1)
        touched = np.argpartition(distance, MOVED)[:MOVED]
        share = (1 - (distance[touched] / distance[touched].max()) ** 2)[:, None]
        outwards = centre - [*(centre[:2] / np.linalg.norm(centre[:2])), 0]
        step = (share * outwards / np.linalg.norm(outwards) * volume.tolerance / 2).astype(np.float32)
        positions[touched] += step
        inside = min(inside, seconds(guard.constrain, positions)[0])
        for _ in range(4):
            positions[touched] += step
            elapsed, (indices, back) = seconds(guard.constrain, positions)
            positions[indices] = back
        beyond = min(beyond, elapsed)
    assert (volume.check(positions, triangles).verdicts == native.module.Verdict.INSIDE).all()
    return inside, beyond, len(indices)


def arguments():
    parser = cli.Parser("benchmark/motion.py", description=__doc__.splitlines()[0])
    parser.add_argument("--tolerance", type=cli.length, default="1%", help="a length, or N%% of size (default: 1%%)")
    parser.add_argument("--threads", type=cli.whole_number(1), metavar="N", help="default: all cores")
    return parser.parse()


def measure(side, tolerance, threads):
    tolvol = native.module
    vertices, triangles = torus(side)
    tolerance = cli.in_units(tolerance, tolvol.diagonal(vertices, triangles))
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, threads=threads)
    whole = min(seconds(volume.check, vertices, triangles, threads=threads)[0] for _ in range(3))
    print(f"{len(vertices):9,} vertices: the whole mesh checked {1e3 * whole:.0f} ms")
    for name, options in (
        ("both ways", {}),
        ("both ways, no crossings", {"crossings": "keep_out"}),
        ("one way", {"two_sided": False}),
    ):
        inside, beyond, held = dabs(vertices, triangles, volume, threads, **options)
        print(
            f"{'':19} a dab of {MOVED:,}, {name}: {1e3 * inside:.2f} ms, {1e3 * beyond:.2f} ms with {held} held back; "
            f"a check is as {whole / inside:.0f} and {whole / beyond:.0f} dabs"
        )
    allow = {"crossings": "allow"}
    for name, bound, options in (
        ("pulled back, both ways, no crossings", volume, {}),
        ("pulled back, both ways", volume, allow),
        ("pulled back, one way", volume, {"two_sided": False, **allow}),
        ("reset, both ways", volume, {"mode": "reset", **allow}),
        ("free", None, {}),
    ):
        best = np.inf
        for _ in range(3):
            before, after = (
                tolvol.smooth(vertices, triangles, bound, iterations=n, threads=threads, **options).report
                for n in (0, ITERATIONS)
            )
            best = min(best, after["seconds"] - before["seconds"])
        print(
            f"{'':19} smoothing, {name}: {len(vertices) * ITERATIONS / best / 1e6:.1f} M vertices x iterations a second, "
            f"{after['held_back'][-1]} held back in the last"
        )


def main(options):
    for side in SIDES:
        measure(side, options.tolerance, options.threads)
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
