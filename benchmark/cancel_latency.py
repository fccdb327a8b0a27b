#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how long calls go on after they are cancelled at random moments.

For each call the longest time of all rounds is printed, by the clock and by the processor.

/usr/bin/python3 benchmark/cancel_latency.py [MESH...] [--only CALL...] [--tolerance PERCENT...] [--rounds N] [--threads N]

MESH is a file FILE.npz that holds a mesh, as arrays `vertices` (n, 3) and `triangles` (m, 3), or the name of a mesh that is
made: torus (240,000 triangles, also if none is named), million, fan, spikes, soup, sizes (huge triangles beside tiny ones) or
outlier (a corner far away).
The promise is 0.2 s by the clock on a machine without other work. If other programs use the processor too, the smaller of the
two times is the fairer one.
"""

import argparse
import os
import random
import sys
import threading
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build/release/python")))
sys.path.insert(0, str(ROOT / "tests/python"))
import tolvol  # noqa: E402

import meshes  # noqa: E402

LONGEST = 20  # seconds; a call is not cancelled at a later moment


def fan():
    """A vertex of 50,000 faces, with rims that are near and far in turn."""
    n = 50_000
    angle, radius = np.arange(n) * 2 * np.pi / n, np.where(np.arange(n) % 2, 0.05, 1.0)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.01 * np.sin(50 * angle)], 1)
    i = np.arange(n, dtype=np.int32)
    return np.concatenate([rim, [[0, 0, 0.1]]]), np.stack([np.full_like(i, n), i, (i + 1) % n], 1)


def spikes():
    """A torus with every 50th vertex pulled out."""
    vertices, triangles = meshes.torus(400, 125)
    vertices[::50] *= 1.5
    return vertices, triangles


def soup():
    """100,000 slivers anywhere, which cross one another."""
    rng = np.random.default_rng(1)
    corners = rng.random((100_000, 1, 3)) + 0.03 * rng.standard_normal((100_000, 3, 3))
    corners[:, 2] = corners[:, 1] + 1e-4 * (corners[:, 2] - corners[:, 1])
    return corners.reshape(-1, 3), np.arange(300_000, dtype=np.int32).reshape(-1, 3)


def sizes():
    """A torus of 100,000 triangles beside a box of 12 around it."""
    return meshes.join(meshes.box((-1.5, -1.5, -0.5), (1.5, 1.5, 0.5)), meshes.torus(400, 125, tube=0.3))


def outlier():
    vertices, triangles = meshes.torus(400, 125)
    vertices[12345] *= 1000
    return vertices, triangles


MADE = {
    "torus": lambda: meshes.torus(600, 200, noise=0.0005),
    "million": lambda: meshes.torus(1000, 500, noise=0.0002),
    "fan": fan,
    "spikes": spikes,
    "soup": soup,
    "sizes": sizes,
    "outlier": outlier,
}


class Scene:
    """A mesh, and the other arguments of the calls."""

    def __init__(self, vertices, triangles, percent, threads):
        self.mesh = vertices, triangles
        self.threads = threads
        self.size = tolvol.diagonal(vertices, triangles)
        self.tolerance = percent / 100 * self.size
        self.volume = tolvol.ToleranceVolume(*self.mesh, self.tolerance)
        self.moved = vertices + vertices.dtype.type(0.4 * self.tolerance) * np.array([1, 0, 0], vertices.dtype)
        self.pushed = vertices + vertices.dtype.type(3 * self.tolerance) * np.array([1, 0, 0], vertices.dtype)
        few = tolvol.ToleranceVolume(*self.mesh, 0.01 * self.size)
        result = tolvol.decimate(*self.mesh, few, target_triangles=1000)
        self.coarse = result.vertices, result.triangles
        box = np.eye(4)
        box[:3, :3] *= np.ptp(vertices, axis=0) * 1.1 + self.tolerance
        box[:3, 3] = vertices.min(0) - 0.05 * np.ptp(vertices, axis=0)
        points = tolvol.lattice_points(4, box)
        points[1:3, 1:3, 3] += 0.1 * self.size
        self.lattice = tolvol.Lattice(points, box)
        gone = np.random.default_rng(1).random(len(triangles)) < 0.05
        self.holed = vertices, triangles[~gone]

    def fresh_volume(self):
        return tolvol.ToleranceVolume(*self.mesh, self.tolerance)


def options(scene, progress):
    return {"threads": scene.threads, "progress": progress}


def volume(s, p):
    return lambda: tolvol.ToleranceVolume(*s.mesh, s.tolerance, **options(s, p))


def field_of_gl(s, p):
    return lambda: tolvol.ToleranceVolume(*s.mesh, s.tolerance, field="gl", **options(s, p))


def fast_marching(s, p):
    return lambda: tolvol.ToleranceVolume(*s.mesh, s.tolerance, field="fast_marching", **options(s, p))


def check(s, p):
    return lambda: s.volume.check(s.moved, s.mesh[1], **options(s, p))


def check_outside(s, p):
    return lambda: s.volume.check(s.pushed, s.mesh[1], **options(s, p))


def check_coarse(s, p):
    return lambda: s.volume.check(*s.coarse, **options(s, p))


def distance(s, p):
    points = np.random.default_rng(1).uniform(s.mesh[0].min(0), s.mesh[0].max(0), (300_000, 3))
    return lambda: s.volume.distance(points, **options(s, p))


def grid(s, p):
    return lambda: s.volume.grid(signed=True, progress=p)


def display(s, p):
    return lambda: tolvol.DisplayTree(s.volume, progress=p)


def display_shares(s, p):
    tree, bounds = tolvol.DisplayTree(s.volume), (-s.tolerance, s.tolerance)
    return lambda: tree.shares(s.moved, s.mesh[1], bounds, **options(s, p))


def display_distance(s, p):
    tree = tolvol.DisplayTree(s.volume)
    return lambda: tree.signed_distance(s.moved, **options(s, p))


def crossing_pairs(s, p):
    return lambda: tolvol.crossing_pairs(*s.mesh, **options(s, p))


def solidity(s, p):
    return lambda: tolvol.solidity(*s.mesh, **options(s, p))


def close_holes(s, p):
    return lambda: tolvol.close_holes(*s.holed, s.volume, **options(s, p))


def decimate_with_holes(s, p):
    return lambda: tolvol.decimate(*s.holed, s.volume, outside="keep", **options(s, p))


def decimate(s, p):
    return lambda: tolvol.decimate(*s.mesh, s.volume, **options(s, p))


def decimate_one_way(s, p):
    return lambda: tolvol.decimate(*s.mesh, s.volume, two_sided=False, **options(s, p))


def decimate_thorough(s, p):
    return lambda: tolvol.decimate(*s.mesh, s.volume, effort="thorough", **options(s, p))


def decimate_moved(s, p):
    return lambda: tolvol.decimate(s.moved, s.mesh[1], s.volume, **options(s, p))


def decimate_moved_one_way(s, p):
    return lambda: tolvol.decimate(s.moved, s.mesh[1], s.volume, two_sided=False, **options(s, p))


def decimate_with_wedges(s, p):
    wedges = tolvol.wedges(s.mesh[1], s.mesh[0][s.mesh[1]][:, :, :2].astype(np.float32))
    return lambda: tolvol.decimate(*s.mesh, s.volume, wedges=wedges, **options(s, p))


def smooth(s, p):
    return lambda: tolvol.smooth(*s.mesh, s.volume, **options(s, p))


def constrain(s, p):
    return lambda: tolvol.constrain(s.mesh[0], s.pushed, s.mesh[1], s.volume, **options(s, p))


def guard(s, p):
    return lambda: tolvol.Guard(s.mesh[0].astype(np.float32), s.mesh[1], s.volume, **options(s, p))


def guard_constrain(s, p):
    guard = tolvol.Guard(s.mesh[0].astype(np.float32), s.mesh[1], s.volume, threads=s.threads)
    wish = s.pushed.astype(np.float32)
    return lambda: guard.constrain(wish, progress=p)


def guard_reset(s, p):
    guard = tolvol.Guard(s.mesh[0].astype(np.float32), s.mesh[1], s.volume, threads=s.threads)
    return lambda: guard.reset(s.moved.astype(np.float32), progress=p)


def guard_replace_faces(s, p):
    guard = tolvol.Guard(s.mesh[0].astype(np.float32), s.mesh[1], s.volume, threads=s.threads)
    return lambda: guard.replace_faces(np.roll(s.mesh[1], 1, axis=1), progress=p)


def deform(mode):
    return lambda s, p: lambda: tolvol.deform(s.mesh[0], s.lattice, s.mesh[1], s.volume, mode=mode, **options(s, p))


def hausdorff(s, p):
    return lambda: tolvol.directed_hausdorff(s.moved, s.mesh[1], *s.mesh, **options(s, p))


def hausdorff_to_coarse(s, p):
    return lambda: tolvol.directed_hausdorff(*s.mesh, *s.coarse, **options(s, p))


def hausdorff_from_coarse(s, p):
    return lambda: tolvol.directed_hausdorff(*s.coarse, *s.mesh, **options(s, p))


def deviation(s, p):
    return lambda: tolvol.deviation(s.moved, s.mesh[1], *s.mesh, **options(s, p))


def deviation_to_coarse(s, p):
    return lambda: tolvol.deviation(*s.mesh, *s.coarse, **options(s, p))


def render_distance(s, p):
    fresh = s.fresh_volume()
    return lambda: tolvol.render_distance(*s.mesh, fresh, edges=True, **options(s, p))


def render_distance_again(s, p):
    tolvol.render_distance(*s.mesh, s.volume, size=(8, 8))
    return lambda: tolvol.render_distance(*s.mesh, s.volume, size=(2048, 2048), samples=4, edges=True, **options(s, p))


def render_volume(s, p):
    fresh = s.fresh_volume()
    return lambda: tolvol.render_volume(fresh, **options(s, p))


def render_volume_again(s, p):
    tolvol.render_volume(s.volume, size=(8, 8))
    return lambda: tolvol.render_volume(s.volume, **options(s, p))


CALLS = {
    "ToleranceVolume": volume,
    "ToleranceVolume, field of GL": field_of_gl,
    "ToleranceVolume, fast marching": fast_marching,
    "check": check,
    "check, outside": check_outside,
    "check, coarse": check_coarse,
    "distance": distance,
    "grid, signed": grid,
    "DisplayTree": display,
    "DisplayTree.shares": display_shares,
    "DisplayTree.signed_distance": display_distance,
    "crossing_pairs": crossing_pairs,
    "solidity": solidity,
    "close_holes": close_holes,
    "decimate": decimate,
    "decimate, holes": decimate_with_holes,
    "decimate, one way": decimate_one_way,
    "decimate, thorough": decimate_thorough,
    "decimate, moved": decimate_moved,
    "decimate, moved, one way": decimate_moved_one_way,
    "decimate, wedges": decimate_with_wedges,
    "smooth": smooth,
    "constrain": constrain,
    "Guard": guard,
    "Guard.constrain": guard_constrain,
    "Guard.reset": guard_reset,
    "Guard.replace_faces": guard_replace_faces,
    "deform, blocked": deform("blocked"),
    "deform, farthest": deform("farthest"),
    "deform, pull_back": deform("pull_back"),
    "hausdorff": hausdorff,
    "hausdorff, to coarse": hausdorff_to_coarse,
    "hausdorff, from coarse": hausdorff_from_coarse,
    "deviation": deviation,
    "deviation, to coarse": deviation_to_coarse,
    "render_distance": render_distance,
    "render_distance, again": render_distance_again,
    "render_volume": render_volume,
    "render_volume, again": render_volume_again,
}


def run(make, scene, moment):
    """Starts a call and cancels it after so many seconds.

    Returns (whether it was stopped, seconds of the call, seconds after the cancel by the clock, the same by the processor).
    """
    progress, outcome = tolvol.Progress(), []
    call = make(scene, progress)

    def work():
        try:
            call()
        except Exception as error:
            outcome.append(error)

    thread = threading.Thread(target=work)
    started = time.perf_counter()
    thread.start()
    thread.join(moment)
    clock, processor = time.perf_counter(), time.process_time()
    progress.cancel()
    thread.join()
    ended = time.perf_counter()
    if outcome and not isinstance(outcome[0], tolvol.Cancelled):
        raise outcome[0]
    return bool(outcome), ended - started, ended - clock, time.process_time() - processor


def measure(make, scene, rounds):
    _, seconds, *latency = run(make, scene, LONGEST)
    worst, moment_of_worst, stopped = latency, LONGEST, 0
    for _ in range(rounds):
        moment = random.uniform(0, min(seconds, LONGEST))
        was_stopped, _, *latency = run(make, scene, moment)
        stopped += was_stopped
        if min(latency) > min(worst):
            worst, moment_of_worst = latency, moment
    return seconds, stopped, worst, moment_of_worst


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("meshes", nargs="*", metavar="MESH", default=["torus"])
    parser.add_argument("--only", nargs="+", choices=CALLS, default=CALLS, metavar="CALL")
    parser.add_argument("--tolerance", type=float, nargs="+", default=[1, 0.1], metavar="PERCENT")
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    random.seed(1)
    for name in options.meshes:
        if name in MADE:
            mesh = MADE[name]()
        else:
            loaded = np.load(name)
            mesh = loaded["vertices"], loaded["triangles"]
        for percent in options.tolerance:
            print(f"{Path(name).stem}, {len(mesh[1])} triangles, {percent} %", flush=True)
            scene = Scene(*mesh, percent, options.threads)
            for call in options.only:
                try:
                    seconds, stopped, (clock, processor), moment = measure(CALLS[call], scene, options.rounds)
                except tolvol.TolvolError as error:
                    print(f"  {call}: {error}")
                    continue
                print(
                    f"  {call}: {clock:.3f} s by the clock, {processor:.3f} s of the processor, cancelled at {moment:.2f} of "
                    f"{seconds:.2f} s ({stopped} of {options.rounds} stopped)",
                    flush=True,
                )


if __name__ == "__main__":
    main()
