#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the time and the memory of a decimation by the size of the mesh, with the construction of its volume.

/usr/bin/python3 benchmark/memory.py [--triangles 1 4 10] [--tolerance 1 0.1] [--write FILE.md]

The meshes are noisy tori. Each is decimated in a process of its own, twice, because the system takes longer to provide memory
for the first time: the times are of the second run, and the memory is the peak of both beside the arrays of the input.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build/release/python")))
sys.path.insert(0, str(ROOT / "tests/python"))
import tolvol  # noqa: E402

import meshes  # noqa: E402
import tables  # noqa: E402
from machine import machine  # noqa: E402
from peak_memory import PeakMemory  # noqa: E402

MILLION = 1_000_000
# The share of a torus's radius by which noise moves its vertices.
NOISE = 1e-5
HEADS = ["Triangles", "Tolerance, %", "Volume, s", "Decimation, s", "Peak, bytes a triangle", "Left"]


def measure(count, percent):
    """Returns what is known of the decimation of a torus of about `count` triangles."""
    columns = round((1.25 * count) ** 0.5)
    vertices, triangles = meshes.torus(columns, round(count / 2 / columns), noise=NOISE)
    vertices = vertices.astype(np.float32)
    tolerance = percent / 100 * tolvol.diagonal(vertices, triangles)
    memory = PeakMemory()
    for _ in range(2):
        began = time.perf_counter()
        volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
        built = time.perf_counter()
        result = tolvol.decimate(vertices, triangles, volume)
        ended = time.perf_counter()
        left = len(result.triangles)
        del volume, result
    return {
        "triangles": len(triangles),
        "volume": built - began,
        "decimation": ended - built,
        "bytes": (memory.peak() - memory.before) / len(triangles),
        "left": left,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=float, nargs="+", default=[1, 4, 10], help="millions")
    parser.add_argument("--tolerance", type=float, nargs="+", default=[1, 0.1], help="percent")
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)  # in a process of its own
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.triangles[0] * MILLION, options.tolerance[0])))
        return
    rows = []
    for millions in options.triangles:
        for percent in options.tolerance:
            words = [sys.executable, __file__, "--one", "--triangles", str(millions), "--tolerance", str(percent)]
            found = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
            times = [f"{found[name]:.1f}" for name in ("volume", "decimation")]
            rows.append(
                [f"{found['triangles']:,}", f"{percent:g}", *times, f"{found['bytes']:.0f}", f"{found['left']:,}"]
            )
            print(*rows[-1], sep=" | ", flush=True)
    tables.publish(options.write, "memory", f"{machine()}.\n\n{tables.table(HEADS, rows, 'rrrrrr')}")


if __name__ == "__main__":
    main()
