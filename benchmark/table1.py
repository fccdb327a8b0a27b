# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes Table 1 of [Botsch04], as printed and as measured here, for `decimation.py --table1 MESH... [--write FILE.md]`."""

from pathlib import Path

import numpy as np

import tables
from addon.native import module as tolvol

TOLERANCE = 0.01  # share of the size
PRECISION = 1.1
# model, triangles, left, grid, error in per cent, seconds: fast marching, decimation, total, without error test
PRINTED = (
    ("Bunny", "70K", "530", "74x73x58", "0.92 %", "1.7", "2.3", "4.0", "2.0"),
    ("Horse", "96k", "414", "85x71x42", "0.99 %", "1.9", "3.2", "5.1", "2.6"),
    ("Venus", "269k", "410", "53x74x74", "0.96 %", "5.0", "10.3", "15.3", "8.8"),
    ("Buddha", "1M", "1955", "45x101x45", "1.00 %", "18.0", "39.6", "57.6", "34.5"),
)
HEADS = (
    *("how", "model", "triangles", "left", "grid", "forward", "backward"),
    *("field s", "decimation s", "total s", "QEM s", "total / QEM", "memory MB"),
)
NOISE = 1e-4  # standard deviation of the noise as a share of the size, too small to change the shape visibly
SEED = 2004


def million(name, vertices, triangles):
    """Cuts each triangle of a mesh in four and moves every vertex a little: the result is as large as the paper's Buddha."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=-1).reshape(-1, 2)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middle = len(vertices) + inverse.reshape(-1, 3)
    a, b, c = triangles.T
    ab, bc, ca = middle.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    points = np.concatenate([vertices, vertices[unique].mean(1)]).astype(np.float64)
    points += np.random.default_rng(SEED).normal(0, NOISE * tolvol.diagonal(vertices, triangles), points.shape)
    faces = np.concatenate([np.stack(part, 1) for part in parts]).astype(np.int32)
    return f"{name}, cut in four", points.astype(np.float32), faces


def measure(name, vertices, triangles, stopwatch, memory, threads):
    """Returns two entries: the check as published, one way, and the default of tolvol.decimate."""
    import tolvol_baselines  # This module is built with the tests and never packed.

    name, tolerance = Path(name).name, TOLERANCE * tolvol.diagonal(vertices, triangles)

    def published():
        marched = tolvol.ToleranceVolume(
            vertices, triangles, tolerance, precision=PRECISION, field="fast_marching", threads=threads
        )
        points, faces, report = tolvol_baselines.decimate(
            vertices, triangles, tolerance, "paper_half_h", PRECISION, threads=threads
        )
        return points, faces, marched, marched.seconds, report["seconds"]

    def default():
        volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, threads=threads)
        result = tolvol.decimate(vertices, triangles, volume, threads=threads)
        return result.vertices, result.triangles, volume, volume.seconds, result.report["seconds"]

    for how, run in (("as published", published), ("default, both ways", default)):
        watch, peak = stopwatch(), memory()
        points, faces, volume, field, decimation = run()
        held = peak.peak() - peak.before
        watch("qem", tolvol.decimate, vertices, triangles, None, None, "optimal", True, len(faces))
        reference, stored = (vertices.astype(np.float64), triangles), (points.astype(np.float64), faces)
        yield {
            "how": how,
            "model": name,
            "triangles": len(triangles),
            "left": len(faces),
            "grid": list(reversed(volume.grid()[0].shape)),
            "forward": tolvol.directed_hausdorff(*stored, *reference, threads=threads).upper / tolerance,
            "backward": tolvol.directed_hausdorff(*reference, *stored, threads=threads).upper / tolerance,
            "field": field,
            "decimation": decimation,
            "qem": watch.seconds["qem"],
            "memory": held,
        }


def text(entries):
    rows = [("as printed, 2004", *row[:5], "", *row[5:], f"{float(row[7]) / float(row[8]):.2f}", "") for row in PRINTED]
    for e in entries:
        total = e["field"] + e["decimation"]
        row = [e["how"], e["model"], f"{e['triangles']:,}", f"{e['left']:,}", "x".join(map(str, e["grid"]))]
        row += [f"{e['forward']:.2f} %", f"{e['backward']:.2f} %", f"{e['field']:.2f}", f"{e['decimation']:.2f}"]
        rows.append([*row, f"{total:.2f}", f"{e['qem']:.2f}", f"{total / e['qem']:.2f}", f"{e['memory'] / 1e6:.0f}"])
    return tables.table(HEADS, rows, "ll" + "r" * (len(HEADS) - 2))
