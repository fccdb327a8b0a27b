# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates thin-walled models with a million collapses together, and lets CGAL look for faces that cross.

The models are closed and free of crossings, and their walls and gaps are from 0.1 to 2 tolerances wide: hollow spheres and
tori, plates, stacks of plates, and interlocked rings. Each result is also judged both ways by tolvol.hausdorff.
"""

import itertools

import numpy as np

import meshes as shapes
from addon.native import module as tolvol
from solid import crossings_by_cgal

COLLAPSES = 1_000_000


def models(seed=1):
    """Yields (name, vertices, triangles, tolerance, effort) without end."""
    rng = np.random.default_rng(seed)
    makers = (_hollow_sphere, _hollow_torus, _stack, _rings)
    for number, make in zip(itertools.count(), itertools.cycle(makers)):
        share = float(np.exp(rng.uniform(np.log(0.1), np.log(2))))  # of the tolerance: how wide walls and gaps are
        percent = float(rng.uniform(0.3, 2))
        name, vertices, triangles, width = make(rng, share * percent / 100)
        vertices = vertices.astype(np.float32)
        effort = "thorough" if number % 8 == 7 else "fast"
        yield f"{name}, width {share:.2f} tolerances", vertices, triangles, width / share, effort


def _walls(surface, inner):
    vertices, triangles = surface
    return shapes.join(surface, (inner, triangles[:, ::-1]))


def _hollow_sphere(rng, relative_width):
    vertices, triangles = shapes.sphere(6)
    width = relative_width * 2 * np.sqrt(3)
    return "hollow sphere", *_walls((vertices, triangles), vertices * (1 - width)), width


def _hollow_torus(rng, relative_width):
    tube = float(rng.uniform(0.2, 0.6))
    width = relative_width * 2 * np.hypot(np.sqrt(2) * (1 + tube), tube)
    outer, inner = (shapes.torus(160, 96, tube=r) for r in (tube, tube - width))
    return "hollow torus", *_walls(outer, inner[0]), width


def _stack(rng, relative_width):
    """Bent plates with a thickness, one above the other."""
    n, layers = 72, 4
    vertices, triangles = shapes.plate(n, bump=float(rng.uniform(0, 0.3)))
    width = relative_width * np.sqrt(2)
    border = np.concatenate(
        [np.arange(n), n * np.arange(1, n) + n - 1, n * n - 2 - np.arange(n - 1), n * np.arange(n - 2, 0, -1)]
    )
    after = np.roll(border, -1)
    under = border + n * n
    rim = np.concatenate([np.stack([border, under, after], 1), np.stack([after, under, np.roll(under, -1)], 1)])
    plate = np.concatenate([vertices, vertices - [0, 0, width]])
    faces = np.concatenate([triangles, triangles[:, ::-1] + n * n, rim]).astype(np.int32)
    return "stack of plates", *shapes.join(*((plate - [0, 0, 2 * width * i], faces) for i in range(layers))), width


def _rings(rng, relative_width):
    """Two rings through each other, as near as the width."""
    vertices, triangles = shapes.torus(160, 128, tube=0.4)
    width = relative_width * 4.3
    turned = vertices[:, [0, 2, 1]] * [1, -1, 1] + [1.2 - width, 0, 0]
    return "interlocked rings", *shapes.join((vertices, triangles), (turned, triangles)), width


def run(collapses=COLLAPSES):
    """Prints a line for each model. Returns whether all results are as promised."""
    done, found = 0, True
    for name, vertices, triangles, tolerance, effort in models():
        if crossings_by_cgal(vertices, triangles):
            print(f"{name}: crosses from the start", flush=True)
            continue
        volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
        result = tolvol.decimate(vertices, triangles, volume, effort=effort)
        pairs = crossings_by_cgal(result.vertices, result.triangles)
        ways = tolvol.hausdorff(result.vertices, result.triangles, vertices, triangles, bound=tolerance)
        done += (len(triangles) - len(result.triangles)) // 2
        found = found and pairs == 0 and ways.upper <= tolerance
        print(
            f"{name}, {effort}: {len(triangles):,} -> {len(result.triangles):,} triangles, {pairs} crossing pairs by CGAL, "
            f"{'within the tolerance both ways' if ways.upper <= tolerance else 'BEYOND THE TOLERANCE'}, "
            f"{done:,} collapses so far",
            flush=True,
        )
        if done >= collapses:
            return found
