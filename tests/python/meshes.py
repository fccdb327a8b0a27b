# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes meshes for the tests: (vertices float64 (n, 3), triangles int32 (m, 3)). Random meshes have a fixed seed."""

import numpy as np


def grid_triangles(columns, rows, wrap_columns=False, wrap_rows=False):
    """Returns two triangles for each cell of a grid of columns x rows vertices, which are numbered row by row."""
    i, j = np.meshgrid(
        np.arange(columns if wrap_columns else columns - 1), np.arange(rows if wrap_rows else rows - 1), indexing="ij"
    )
    i, j = i.ravel(), j.ravel()
    right, up = (i + 1) % columns, (j + 1) % rows
    a, b, c, d = j * columns + i, j * columns + right, up * columns + right, up * columns + i
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)


def plate(n=33, side=1.0, bump=0.0):
    """An open square in the plane z = 0, or with one smooth hill of height `bump`."""
    s = np.linspace(0, side, n)
    x, y = np.meshgrid(s, s)
    z = bump * np.sin(np.pi * x / side) * np.sin(np.pi * y / side)
    return np.stack([x.ravel(), y.ravel(), z.ravel()], 1), grid_triangles(n, n)


def torus(columns=96, rows=48, radius=1.0, tube=0.4, noise=0.0, seed=1):
    """A closed torus; `noise` moves each vertex along its normal by a normally distributed length."""
    u, v = np.meshgrid(np.arange(columns) * 2 * np.pi / columns, np.arange(rows) * 2 * np.pi / rows)
    u, v = u.ravel(), v.ravel()
    normal = np.stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)], 1)
    centre = radius * np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], 1)
    offset = tube + noise * np.random.default_rng(seed).standard_normal((len(u), 1))
    return centre + offset * normal, grid_triangles(columns, rows, True, True)


def box(lower=(0, 0, 0), upper=(1, 1, 1)):
    """A closed box of twelve triangles facing outwards."""
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return lower + corners * (upper - lower), triangles.astype(np.int32)


def subdivide(vertices, triangles):
    """Cuts each triangle into four. Shared edges stay shared."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middles = vertices[unique].mean(1)
    ab, bc, ca = (inverse.reshape(-1, 3) + len(vertices)).T
    a, b, c = triangles.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([vertices, middles]), np.concatenate([np.stack(p, 1) for p in parts]).astype(np.int32)


def sphere(levels=4, radius=1.0, centre=(0, 0, 0)):
    """A closed sphere: an octahedron subdivided `levels` times, 8 * 4 ** levels triangles inscribed in the sphere."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    triangles = np.array(
        [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]], np.int32
    )
    for _ in range(levels):
        vertices, triangles = subdivide(vertices, triangles)
        vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return np.asarray(centre, float) + radius * vertices, triangles


def rod(width=0.01, length=1.0, levels=5):
    """A closed box much longer than wide."""
    vertices, triangles = box((0, 0, 0), (length, width, width))
    for _ in range(levels):
        vertices, triangles = subdivide(vertices, triangles)
    return vertices, triangles


def spike(levels=5, width=0.15, length=2.0):
    """A sphere of radius 1 from which a cone of this opening angle and length stands up."""
    vertices, triangles = sphere(levels)
    angle = np.arccos(np.clip(vertices[:, 2], -1, 1))
    return vertices * (1 + length * np.clip(1 - angle / width, 0, None))[:, None], triangles


def open_star(spikes):
    """A flat fan of triangles around a centre, four fifths of a turn, with corners at the radii 0.05 and 1 in turn."""
    corners = 2 * spikes
    angles = 0.8 * 2 * np.pi * np.arange(corners) / corners
    radii = np.where(np.arange(corners) % 2, 0.05, 1.0)
    vertices = np.zeros((corners + 1, 3))
    vertices[1:, 0], vertices[1:, 1] = radii * np.cos(angles), radii * np.sin(angles)
    i = np.arange(1, corners, dtype=np.int32)
    return vertices.astype(np.float32), np.stack([np.zeros_like(i), i, i + 1], 1)


def flap_along_a_hairpin():
    """A plate, flat but for one vertex, and a narrow flap on it along a line that goes forth and, 0.05 beside that, back: three
    faces meet at each edge of the line. Returns (vertices, triangles, is_of_plate), the last a bool for each vertex."""
    x, y = (-1.0, 0.0, 1.0, 2.0), (-1.0, 0.0, 0.025, 0.05, 1.05)
    grid = np.array([(a, b, 0.0) for a in x for b in y])
    at = np.arange(len(grid)).reshape(len(x), len(y))
    grid[at[1, 2], 2] = -0.02
    triangles = []
    for i in range(len(x) - 1):
        for j in range(len(y) - 1):
            a, b, c, d = at[i, j], at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]
            triangles += [(a, b, d), (b, c, d)] if j == 1 else [(a, b, c), (a, c, d)]
    line = at[[1, 2, 2, 2, 1], [1, 1, 2, 3, 3]]
    top = grid[line] + [(0, 0.02, 0.01), (-0.02, 0.02, 0.01), (-0.02, 0, 0.01), (-0.02, -0.02, 0.01), (0, -0.02, 0.01)]
    for k in range(len(line) - 1):
        above = len(grid) + k
        triangles += [(line[k], line[k + 1], above + 1), (line[k], above + 1, above)]
    vertices = np.concatenate([grid, top]).astype(np.float32)
    return vertices, np.array(triangles, np.int32), np.arange(len(vertices)) < len(grid)


def join(*meshes):
    vertices, triangles, offset = [], [], 0
    for v, t in meshes:
        vertices.append(v)
        triangles.append(t + offset)
        offset += len(v)
    return np.concatenate(vertices), np.concatenate(triangles).astype(np.int32)


def sheets_with_t_junctions(n=8):
    """Returns a plate of n x n squares, one of 2 n x 2 n beside it, and a wall of other squares that stands on the edge where
    they meet: the sheets share hardly a vertex."""
    coarse, fine, wall = plate(n + 1), plate(2 * n + 1), plate(3 * n // 2 + 1)
    (a, _), (b, _), (c, _) = coarse, fine, wall
    c = np.stack([0 * c[:, 0], c[:, 1], c[:, 0]], 1)
    vertices, triangles = join((a - [1, 0, 0], coarse[1]), (b, fine[1]), (c, wall[1]))
    vertices[:, 2] += 0.05 * np.sin(4 * vertices[:, 0])
    return vertices, triangles, np.repeat([0, 1, 2], [len(coarse[1]), len(fine[1]), len(wall[1])])


def soup(vertices, triangles):
    """Returns the same surface with three separate vertices for every triangle, like an STL file."""
    return vertices[triangles.ravel()], np.arange(triangles.size, dtype=np.int32).reshape(-1, 3)


def needles(levels=4, height=1e-5):
    """A subdivided box. Across its top lie needles, which are triangles of length 1 and of a very small height."""
    vertices, triangles = box()
    for _ in range(levels):
        vertices, triangles = subdivide(vertices, triangles)
    count = 60
    y = np.linspace(0.1, 0.9, count)
    a = np.stack([np.zeros(count), y, np.ones(count)], 1)
    b = np.stack([np.ones(count), y, np.ones(count)], 1)
    c = np.stack([np.full(count, 0.5), y + height, np.ones(count)], 1)
    tips = np.stack([a, b, c], 1).reshape(-1, 3)
    return join((vertices, triangles), (tips, np.arange(len(tips), dtype=np.int32).reshape(-1, 3)))


def non_manifold():
    """Three plates that share an edge, a torus with every tenth face twice, two spheres that touch in a vertex."""
    v, t = plate(25)
    fins = [v, np.stack([v[:, 0], v[:, 2], v[:, 1]], 1), np.stack([v[:, 0], -v[:, 1], v[:, 2]], 1)]
    vertices, triangles = join(*((fin, t) for fin in fins))
    first = {}
    share = np.arange(len(vertices))
    for i, p in enumerate(map(tuple, vertices)):
        share[i] = first.setdefault(p, i)
    tv, tt = torus(48, 24, radius=0.5, tube=0.2)
    doubled = np.concatenate([tt, tt[::10]])
    left, right = sphere(3, 0.25, (2, 0, 0)), sphere(3, 0.25, (2.5, 0, 0))
    touching_v, touching_t = join(left, right)
    # Vertex 0 of the left sphere and vertex 1 of the right one are both at (2.25, 0, 0).
    touching_t = np.where(touching_t == len(left[0]) + 1, 0, touching_t)
    return join((vertices, share[triangles].astype(np.int32)), (tv + [0.5, 0.5, 2], doubled), (touching_v, touching_t))


def misoriented(seed=3):
    """A torus. A third of its faces have the wrong orientation."""
    vertices, triangles = torus(64, 32)
    wrong = np.random.default_rng(seed).random(len(triangles)) < 1 / 3
    triangles[wrong] = triangles[wrong][:, ::-1]
    return vertices, triangles


def degenerate(seed=4):
    """A torus with faces that are points and segments, vertices that nothing uses, and repeated faces."""
    vertices, triangles = torus(48, 24)
    rng = np.random.default_rng(seed)
    i = rng.integers(0, len(vertices), 40)
    extra = np.concatenate([np.stack([i, i, i], 1), np.stack([i, i, (i // 48) * 48 + (i + 1) % 48], 1), triangles[:5]])
    unused = rng.normal(0, 100, (30, 3))
    return np.concatenate([vertices, unused]), np.concatenate([triangles, extra]).astype(np.int32)


def degenerate_on_faces(levels=3, count=20):
    """A sphere. On the inside of its first faces lie degenerate faces with vertices of their own: segments, then points."""
    vertices, triangles = sphere(levels)
    a, b, c = vertices[triangles[:count]].transpose(1, 0, 2)
    ends = np.concatenate([(a + b + c) / 3, (a + 2 * b + c) / 4])
    i = np.arange(count, dtype=np.int32)
    segments = np.stack([i, i, np.where(i < count // 2, i + count, i)], 1)
    return join((vertices, triangles), (ends, segments))


def double_sheets():
    """A torus. Half of its faces have a twin with the other orientation, a part of the twins with vertices of their own."""
    vertices, triangles = torus(24, 12, noise=0.002)
    middle = vertices[triangles].mean(1)
    twins = triangles[:, ::-1]
    own = twins[(middle[:, 0] > 0) & (middle[:, 1] > 0)]
    shared = twins[(middle[:, 0] > 0) & (middle[:, 1] <= 0)]
    return join((vertices, np.concatenate([triangles, shared])), (vertices, own))


def touching_boxes():
    """Three boxes: the second one touches the first along an edge, and the third touches it in a corner."""
    boxes = []
    for lower in ((0, 0, 0), (1, 1, 0), (-1, -1, 1)):
        vertices, triangles = box(lower, np.add(lower, 1))
        for _ in range(2):
            vertices, triangles = subdivide(vertices, triangles)
        boxes.append((vertices, triangles))
    return join(*boxes)


def boundary_segments(vertices, triangles):
    """Returns the edges that belong to exactly one triangle, as triangles that are segments, or (0, 3) without any."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    a, b = unique[count == 1].T
    return np.stack([a, b, b], 1).astype(np.int32)


def component_count(vertices, triangles):
    """Returns the number of connected components of the triangles. Vertices at equal positions count as one."""
    _, label = np.unique(vertices[triangles.ravel()], axis=0, return_inverse=True)
    corners = label.reshape(-1, 3)
    root = np.arange(label.max() + 1)
    while True:
        lowest = root[corners].min(1)
        before = root.copy()
        for k in range(3):
            np.minimum.at(root, before[corners[:, k]], lowest)
        while not np.array_equal(root, root[root]):  # Halving the paths keeps the rounds few, even on a long strip.
            root = root[root]
        if np.array_equal(root, before):
            return len(np.unique(root))


def random_rotation(seed=5):
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return q * np.sign(np.linalg.det(q))


def matrix(linear, translation=(0, 0, 0)):
    m = np.eye(4)
    m[:3, :3] = linear
    m[:3, 3] = translation
    return m


def transform(m, vertices):
    """Returns world coordinates in double precision, which all judges need."""
    return np.asarray(vertices, np.float64) @ m[:3, :3].T + m[:3, 3]
