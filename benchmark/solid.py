# SPDX-License-Identifier: GPL-3.0-or-later
"""Says whether a mesh is closed, and in how many pairs its faces cross by CGAL's self_intersections."""

import subprocess
from pathlib import Path

import numpy as np

JUDGE = Path(__file__).resolve().parents[1] / "build/release/tests/native/tolvol_cgal_judge"
REFUSED = 2  # the exit code of the judge for what is no oriented manifold


def crossings_by_cgal(vertices, triangles):
    """Returns the number of pairs of faces that cross, or None if the mesh is no oriented manifold."""
    head = np.array([len(vertices), len(triangles)], np.float64)
    data = b"".join(np.ascontiguousarray(array, np.float64).tobytes() for array in (head, vertices, triangles))
    done = subprocess.run([JUDGE, "crossings"], input=data, capture_output=True)
    if done.returncode == REFUSED and b"not an oriented manifold" in done.stderr:
        return None
    done.check_returncode()
    return int(done.stdout)


def is_closed(triangles):
    """Returns whether each edge of the triangles (m, 3) has a triangle on either side, both oriented alike."""
    edges = np.asarray(triangles)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ways, count = np.unique(edges, axis=0, return_counts=True)
    return bool((count == 1).all()) and np.array_equal(ways, np.unique(edges[:, ::-1], axis=0))


def judge(vertices, triangles):
    """Returns {"closed": bool, "crossings": the number of pairs, or None if the mesh is no oriented manifold}."""
    corners = np.asarray(triangles)
    if (corners == np.roll(corners, 1, axis=1)).any():  # CGAL does not say what it makes of a repeated corner.
        return {"closed": False, "crossings": None}
    return {"closed": is_closed(corners), "crossings": crossings_by_cgal(vertices, corners)}
