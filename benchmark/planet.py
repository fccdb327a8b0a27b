# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a large mesh piece by piece: a noisy fractal terrain around a sphere."""

import numpy as np

_WAVES = 6  # for each octave
_OCTAVES = range(2, 9)
_HEIGHT = 0.1  # of an octave of waves of length 1, times the radius
_NOISE = 0.1  # standard deviation of the height of a vertex, times the distance of two rows


def rows_of(triangles):
    """Returns how many rows of triangles a planet of about so many triangles has between a pole and the equator."""
    return max(1, round((triangles / 8) ** 0.5))


def write(path, rows, seed=1):
    """Writes a binary PLY file of float32, and returns its number of triangles, 8 * rows * rows.

    The planet is an octahedron, each of whose faces is divided into rows * rows triangles: row i from a pole has 4 * i vertices
    at one latitude. About 1 us for each triangle.
    """
    random = np.random.default_rng(seed)
    waves = [
        (random.normal(size=(_WAVES, 3)) * 2**octave / 2, random.uniform(0, 2 * np.pi, _WAVES), _HEIGHT / 2**octave)
        for octave in _OCTAVES
    ]
    sizes = 4 * np.concatenate([np.arange(1, rows + 1), np.arange(rows - 1, 0, -1)])
    triangles = 8 * rows * rows
    with open(path, "wb") as file:
        file.write(
            f"ply\nformat binary_little_endian 1.0\nelement vertex {sizes.sum() + 2}\nproperty float x\n"
            f"property float y\nproperty float z\nelement face {triangles}\n"
            "property list uchar int vertex_indices\nend_header\n".encode()
        )
        for latitude, size in zip(np.linspace(0, np.pi, 2 * rows + 1)[1:-1], sizes):
            along = np.linspace(0, 2 * np.pi, size, endpoint=False)
            ring = np.sin(latitude) * np.stack([np.cos(along), np.sin(along)], 1)
            place = np.concatenate([ring, np.full((size, 1), np.cos(latitude))], 1)
            radius = 1 + sum(height * np.sin(place @ vectors.T + phases).sum(1) for vectors, phases, height in waves)
            radius += _NOISE * np.pi / (2 * rows) * random.standard_normal(size)
            file.write((place * radius[:, None]).astype("<f4").tobytes())
        file.write(np.array([(0, 0, 1), (0, 0, -1)], "<f4").tobytes())
        north, south = int(sizes.sum()), int(sizes.sum()) + 1
        firsts = np.cumsum([0, *sizes])
        _faces(file, _between(north, 1, firsts[0], 4))
        for i in range(2 * rows - 2):
            _faces(file, _between(firsts[i], sizes[i], firsts[i + 1], sizes[i + 1]))
        _faces(file, _between(firsts[2 * rows - 2], 4, south, 1))
    return triangles


def _between(upper, above, lower, below):
    """Returns the triangles between two rows of vertices, (k, 3), from their first vertices and their sizes.

    In each of four sectors the longer row has an edge more than the other.
    """
    inner, outer = min(above, below) // 4, max(above, below) // 4
    short, of_short, long, of_long = (upper, above, lower, below) if above < below else (lower, below, upper, above)
    sector, inward, outward = np.arange(4)[:, None], np.arange(inner), np.arange(outer)

    def near(step):
        return short + (sector * inner + step) % of_short

    def far(step):
        return long + (sector * outer + step) % of_long

    found = (
        np.stack([near(outward), far(outward), far(outward + 1)], 2),
        np.stack([near(inward), far(inward + 1), near(inward + 1)], 2),
    )
    corners = np.concatenate([part.reshape(-1, 3) for part in found])
    return corners if above < below else corners[:, ::-1]


def _faces(file, corners):
    found = np.empty(len(corners), [("size", "u1"), ("corners", "<i4", 3)])
    found["size"], found["corners"] = 3, corners
    file.write(found.tobytes())
