# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a case from a seed and a number. The case does not depend on the cases before."""

import numpy as np

import meshes

from . import kinds, operations
from .case import Case

# The relative frequency of each operation.
LIKELY = {"decimate": 4, "chain": 2}


def case_of(seed, number):
    rng = np.random.default_rng([seed, number])
    # Small meshes find as many failures as large ones in less time. A twentieth of the meshes are large enough to be slow.
    most = np.log10(kinds.MAX_FACES) if rng.random() < 0.05 else 3.5
    kind, vertices, triangles = kinds.draw(
        rng, np.random.default_rng([seed, number, 1]), int(10 ** rng.uniform(0, most))
    )
    names = list(operations.OPERATIONS)
    weights = np.array([LIKELY.get(name, 1) for name in names], float)
    case = Case(kind, str(rng.choice(names, p=weights / weights.sum())), vertices, triangles, tolerance=1.0)
    if case.operation not in ("hausdorff", "deviation") and rng.random() < 0.2:
        linear = meshes.random_rotation(int(rng.integers(1 << 30))) @ np.diag(
            rng.choice([-1, 1], 3) * rng.uniform(0.2, 3, 3)
        )
        shift = rng.standard_normal(3) * (np.abs(vertices).max() if len(vertices) else 1) * rng.integers(0, 3)
        case.to_world = meshes.matrix(linear, shift)
    share = rng.uniform(-3.7, -0.7) if rng.random() < 0.95 else rng.uniform(-12, 0.3)
    case.tolerance = 10**share * (case.size() or 1.0)
    common = case.options
    common["threads"] = [int(k) for k in rng.permutation([1, int(rng.integers(2, 4))])]
    common["cgal"] = bool(rng.random() < 0.2)
    if rng.random() < 0.15:
        common["cancel"] = float(rng.random())
    if rng.random() < 0.1:
        common["precision"] = float(rng.choice([0.25, 1, 2]))
    if rng.random() < 0.05:
        common["field"] = str(rng.choice(["gl", "fast_marching"]))
    operations.DRAW[case.operation](rng, case)
    return case
