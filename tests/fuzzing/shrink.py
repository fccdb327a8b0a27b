# SPDX-License-Identifier: GPL-3.0-or-later
"""Reduces a case that shows a finding: drops options, then faces, then unused vertices."""

import time
from dataclasses import replace

import numpy as np

# Options that an operation needs: they are not dropped.
NEEDED = {
    "threads",
    "placement",
    "two_sided",
    "corners",
    "mode",
    "steps",
    "points",
    "amplitude",
    "seed",
    "reach",
    "edits",
}
NEEDED |= {"every", "swapped", "outside", "crossings"}


class Shrink:
    """Reduces a case. still(case) tells whether a case shows the same finding. No try begins after so many seconds."""

    def __init__(self, case, still, seconds):
        self.case, self._still, self._end = case, still, time.monotonic() + seconds
        self._drop_options()
        self._drop_vertices()
        self._drop_faces()
        self._drop_vertices()

    def _try(self, **changes):
        smaller = replace(self.case, **changes)
        if not self._still(smaller):
            return False
        self.case = smaller
        return True

    def _drop_options(self):
        for name in [name for name in self.case.options if name not in NEEDED]:
            if time.monotonic() > self._end:
                return
            self._try(options={k: v for k, v in self.case.options.items() if k != name})
        for name in list(self.case.arrays):
            self._try(arrays={k: v for k, v in self.case.arrays.items() if k != name})
        for k in reversed(range(len(self.case.options.get("steps", ())))):
            steps = list(self.case.options["steps"])
            del steps[k]
            self._try(options={**self.case.options, "steps": steps})
        if self.case.to_world is not None:
            self._try(to_world=None)

    def _drop_faces(self):
        chunk = (len(self.case.triangles) + 1) // 2
        while chunk and time.monotonic() < self._end:
            first = 0
            while first < len(self.case.triangles):
                rest = np.delete(self.case.triangles, np.s_[first : first + chunk], axis=0)
                if not len(rest) or not self._try(triangles=rest):
                    first += chunk
                if time.monotonic() > self._end:
                    break
            chunk = 0 if chunk == 1 else (chunk + 1) // 2

    def _drop_vertices(self):
        used, label = np.unique(self.case.triangles, return_inverse=True)
        self._try(
            vertices=self.case.vertices[used],
            triangles=label.reshape(-1, 3).astype(np.int32),
            arrays={name: values[used] for name, values in self.case.arrays.items()},
        )
