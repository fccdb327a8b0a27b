# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a large mesh piece by piece: a noisy fractal terrain around a sphere."""

import numpy as np

_WAVES = 6  # for each octave
_OCTAVES = range(2, 9)
_HEIGHT = 0.1  # of an octave of waves of length 1, times the radius
_NOISE = 0.1  # standard deviation of the height of a vertex, times the length of an edge along a circle of latitude


def rows_of(triangles):
    """Returns the number of circles of latitude of a planet of about so many triangles."""
    return max(3, round((triangles / 4) ** 0.5))


def write(path, rows, seed=1):
    """Writes a binary PLY file of float32, and returns its number of triangles, 4 * rows * rows - 4 * rows.

    rows: the circles of latitude between the poles are one fewer; each has 2 * rows vertices. About 1 us for each triangle.
    """
    random = np.random.default_rng(seed)
    waves = [
        (random.normal(size=(_WAVES, 3)) * 2**octave / 2, random.uniform(0, 2 * np.pi, _WAVES), _HEIGHT / 2**octave)
        for octave in _OCTAVES
    ]
    columns = 2 * rows
    along = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    triangles = 2 * columns * (rows - 1)
    with open(path, "wb") as file:
        file.write(
            f"ply\nformat binary_little_endian 1.0\nelement vertex {columns * (rows - 1) + 2}\nproperty float x\n"
            f"property float y\nproperty float z\nelement face {triangles}\n"
            "property list uchar int vertex_indices\nend_header\n".encode()
        )
        for latitude in np.linspace(0, np.pi, rows + 1)[1:-1]:
            ring = np.sin(latitude) * np.stack([np.cos(along), np.sin(along)], 1)
            place = np.concatenate([ring, np.full((columns, 1), np.cos(latitude))], 1)
            radius = 1 + sum(height * np.sin(place @ vectors.T + phases).sum(1) for vectors, phases, height in waves)
            radius += _NOISE * np.pi / rows * random.standard_normal(columns)
            file.write((place * radius[:, None]).astype("<f4").tobytes())
        file.write(np.array([(0, 0, 1), (0, 0, -1)], "<f4").tobytes())
        here = np.arange(columns)
        after = np.roll(here, -1)
        north, south = columns * (rows - 1), columns * (rows - 1) + 1
        _faces(file, [np.stack([np.full(columns, north), here, after], 1)])
        for row in range(rows - 2):
            a, b = row * columns, (row + 1) * columns
            _faces(file, [np.stack([a + here, b + here, b + after], 1), np.stack([a + here, b + after, a + after], 1)])
        last = (rows - 2) * columns
        _faces(file, [np.stack([np.full(columns, south), last + after, last + here], 1)])
    return triangles


def _faces(file, parts):
    corners = np.concatenate(parts)
    found = np.empty(len(corners), [("size", "u1"), ("corners", "<i4", 3)])
    found["size"], found["corners"] = 3, corners
    file.write(found.tobytes())
