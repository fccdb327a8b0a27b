# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what closing holes is worth: triangles left with and without, of a scan and of spheres with missing faces.

/usr/bin/python3 benchmark/holes.py [--write docs/benchmark.md]

Every result is judged both ways by tolvol.hausdorff against the mesh with its holes.
"""

import argparse
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "build/release/python"), str(ROOT / "tests/python")]

import tolvol  # noqa: E402

import meshes as shapes  # noqa: E402
import tables  # noqa: E402
from generated import icosahedron  # noqa: E402
from least_open import least_open  # noqa: E402
from scan import scan  # noqa: E402

HEADS = (
    "Mesh, ε = 1 %",
    "Triangles",
    "Holes closed",
    "Left open",
    "Least without closing",
    "Left without closing",
    "Left with closing",
    "Result → reference",
    "Reference → result",
    "Seconds without",
    "Seconds with",
)
SUBDIVIDED = 4  # times; an icosahedron then has 5,120 faces


def icosphere(levels):
    """Returns a sphere of 20 * 4**levels triangles: (n, 3) float64, (m, 3)."""
    vertices, triangles = icosahedron()
    for _ in range(levels):
        vertices, triangles = shapes.subdivide(vertices, triangles)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    inwards = (np.cross(b - a, c - a) * a).sum(1) < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return vertices, triangles


def bumpy_sphere(missing, seed=1):
    """Returns a bumpy sphere of which a share of the faces is missing at random, and the bound of least_open()."""
    vertices, triangles = icosphere(SUBDIVIDED)
    x, y, z = vertices.T
    vertices = vertices * (1 + 0.05 * np.sin(5 * x) * np.cos(4 * y + z))[:, None]
    kept = np.random.default_rng(seed).permutation(len(triangles))[: round((1 - missing) * len(triangles))]
    is_there = np.isin(np.arange(len(triangles)), kept)
    return vertices.astype(np.float32), triangles[is_there].astype(np.int32), least_open(triangles, is_there)


def measured(name, vertices, triangles, least=None):
    """Returns a row of the table, on one thread."""
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.01 * tolvol.diagonal(vertices, triangles))
    clock = [time.process_time()]
    without = tolvol.decimate(vertices, triangles, volume, threads=1)
    clock.append(time.process_time())
    closed = tolvol.close_holes(vertices, triangles, volume, threads=1)
    result = tolvol.decimate(vertices, closed.triangles, volume, threads=1)
    clock.append(time.process_time())
    ways = tolvol.hausdorff(result.vertices, result.triangles, vertices, triangles, bound=volume.tolerance)
    if least and len(without.triangles) < least:
        sys.exit(f"{name}: {len(without.triangles)} triangles are left, fewer than {least}")
    if ways.upper > volume.tolerance or len(tolvol.crossing_pairs(result.vertices, result.triangles)):
        sys.exit(f"{name}: the result is not as promised")
    return [
        name,
        f"{len(triangles):,}",
        f"{closed.report['closed']:,}",
        f"{sum(closed.report['refused'].values()):,}",
        f"{least:,}" if least else "",
        f"{len(without.triangles):,}",
        f"**{len(result.triangles):,}**",
        f"{ways.forward.upper / volume.tolerance:.3f}",
        f"{ways.backward.upper / volume.tolerance:.3f}",
        *(f"{seconds:.2f}" for seconds in np.diff(clock)),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    options = parser.parse_args()
    rows = [
        measured("scan", *scan()),
        measured("bumpy sphere, a fifth of the faces missing", *bumpy_sphere(0.2)),
        measured("bumpy sphere, half of the faces missing", *bumpy_sphere(0.5)),
    ]
    tables.publish(options.write, "closing holes", tables.table(HEADS, rows, "l" + "r" * (len(HEADS) - 1)))


main()
