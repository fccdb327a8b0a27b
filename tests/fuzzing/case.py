# SPDX-License-Identifier: GPL-3.0-or-later
"""One case: a mesh, an operation and its options. It is complete, so that it can be stored, reduced and repeated."""

import json
from dataclasses import dataclass, field

import numpy as np

import meshes


class Finding(Exception):
    """A failure. `what` stays the same while the case is reduced; the message may change."""

    def __init__(self, what, message):
        super().__init__(message)
        self.what = what


@dataclass
class Case:
    kind: str
    operation: str
    vertices: np.ndarray
    triangles: np.ndarray
    tolerance: float
    to_world: np.ndarray | None = None
    options: dict = field(default_factory=dict)  # only values that JSON can hold
    arrays: dict = field(default_factory=dict)  # a row for each vertex

    def world(self, vertices):
        return vertices.astype(np.float64) if self.to_world is None else meshes.transform(self.to_world, vertices)

    def size(self):
        """Returns the diagonal of the used vertices in the world. It is at least half of tolvol.diagonal."""
        if not len(self.triangles):
            return 0.0
        return float(np.linalg.norm(np.ptp(self.world(self.vertices[self.triangles.ravel()]), axis=0)))

    def longest_diagonal(self):
        """Returns the longest diagonal, in the world, of the local bounding box of the used vertices.

        A larger tolerance is refused. This is tolvol.diagonal, computed by other code.
        """
        if not len(self.triangles):
            return 0.0
        used = self.vertices[self.triangles.ravel()]
        ends = np.array([used.min(0), used.max(0)], np.float64)
        return max(
            float(np.linalg.norm(np.diff(self.world(np.choose([which, 1 - which], ends[:, None])), axis=0)))
            for which in np.array([(0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0)])
        )

    def is_limited(self):
        """Whether every call has to end within the time limit.

        A very large area or a tiny tolerance makes calls long, and so does a field of GL that is computed in software.
        """
        compared = [self.vertices]
        if self.operation in ("hausdorff", "deviation"):  # which compare the mesh with a copy that was moved
            compared.append(self.vertices + self.arrays.get("motion", 0))
        small = all(self._area(vertices) <= 100 for vertices in compared)
        return small and self.tolerance >= 0.001 * self.size() and self.options.get("field") != "gl"

    def _area(self, vertices):
        """Returns the area of the triangles, in units of the squared size of the case."""
        a, b, c = self.world(vertices)[self.triangles].transpose(1, 0, 2) / (self.size() or 1.0)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2

    def line(self):
        percent = 100 * self.tolerance / self.size() if self.size() else float("inf")
        options = ", ".join(
            f"{name}={value}" for name, value in {**self.options, **dict.fromkeys(self.arrays, "...")}.items()
        )
        placed = "" if self.to_world is None else ", to_world"
        return (
            f"{self.operation}({options}{placed}) of {self.kind}, {len(self.vertices)} {self.vertices.dtype} vertices, "
            f"{len(self.triangles)} triangles, tolerance {self.tolerance:.9g} ({percent:.3g} %)"
        )

    def save(self, path):
        scalars = {"kind": self.kind, "operation": self.operation, "tolerance": self.tolerance, "options": self.options}
        arrays = {f"array {name}": values for name, values in self.arrays.items()}
        if self.to_world is not None:
            arrays["to_world"] = self.to_world
        np.savez_compressed(
            path, scalars=json.dumps(scalars), vertices=self.vertices, triangles=self.triangles, **arrays
        )

    @classmethod
    def load(cls, path):
        with np.load(path) as file:
            arrays = {name[len("array ") :]: file[name] for name in file.files if name.startswith("array ")}
            return cls(
                vertices=file["vertices"],
                triangles=file["triangles"],
                to_world=file["to_world"] if "to_world" in file.files else None,
                arrays=arrays,
                **json.loads(str(file["scalars"])),
            )
