# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes difficult meshes. Each kind is a function of a random generator and of the approximate number of faces.

No mesh has more than 100,000 faces or an area of more than a hundred times its size squared: for a mesh that covers itself
more often than that no time limit is promised."""

import numpy as np

import meshes

MAX_FACES = 100_000


def _grid(rng, n):
    """Returns the numbers of columns and rows, at least 3, of a grid of about n triangles."""
    columns = int(max(3, np.sqrt(n / 2) * rng.uniform(0.5, 2)))
    return columns, int(max(3, n / 2 / columns))


def _levels(n, first):
    """Returns how often each triangle of a mesh of `first` triangles can be cut in four with at most n triangles then."""
    return int(max(0, np.log(max(n, first) / first) / np.log(4)))


def welded(vertices, triangles):
    """Merges vertices at equal positions, and drops faces that then have a repeated corner."""
    places, label = np.unique(vertices, axis=0, return_inverse=True)
    faces = label[triangles]
    sound = (faces != np.roll(faces, 1, axis=1)).all(1)
    return places, faces[sound].astype(np.int32)


def smooth_closed(rng, n):
    if rng.random() < 0.5:
        return meshes.torus(*_grid(rng, n), tube=rng.uniform(0.05, 0.9))
    vertices, triangles = meshes.sphere(_levels(n, 8))
    return vertices * rng.uniform(0.1, 1, 3), triangles


def noisy(rng, n):
    return meshes.torus(*_grid(rng, n), noise=10 ** rng.uniform(-4, -1), seed=int(rng.integers(1 << 30)))


def terrain(rng, n):
    side = int(max(2, np.sqrt(n / 2) + 1))
    vertices, triangles = meshes.plate(side, bump=rng.uniform(0, 0.5))
    vertices[:, 2] += rng.standard_normal(len(vertices)) * 10 ** rng.uniform(-5, -1)
    return vertices, triangles


def _extruded(rng, outline, height):
    """Returns a prism over the outline (k, 2). Its caps are a fan around the middle, a fan from a corner, or a strip."""
    k = len(outline)
    low, high = np.c_[outline, np.zeros(k)], np.c_[outline, np.full(k, height)]
    vertices = np.concatenate([low, high])
    i = np.arange(k)
    j = (i + 1) % k
    sides = [np.stack([i, j, j + k], 1), np.stack([i, j + k, i + k], 1)]
    cap = rng.choice(["middle", "corner", "strip"])
    if cap == "middle":
        middle = outline.mean(0)
        vertices = np.concatenate([vertices, [[*middle, 0], [*middle, height]]])
        top = np.stack([np.full(k, 2 * k + 1), i + k, j + k], 1)
        bottom = np.stack([np.full(k, 2 * k), j, i], 1)
    else:
        order = i if cap == "corner" else np.stack([i[: k // 2], i[::-1][: k // 2]], 1).ravel()
        if cap == "corner":
            bottom = np.stack([np.zeros(k - 2, int), order[2:], order[1:-1]], 1)
        else:
            bottom = np.stack([order[:-2], order[1:-1], order[2:]], 1)
            bottom[::2] = bottom[::2, ::-1]
        top = bottom[:, ::-1] + k
    return vertices, np.concatenate([*sides, top, bottom]).astype(np.int32)


def gear(rng, n):
    k = int(max(3, n // 4))
    angle = np.arange(k) * 2 * np.pi / k
    teeth = 1 + rng.uniform(0.01, 0.3) * np.sign(np.sin(angle * rng.integers(1, max(2, k // 4) + 1)))
    outline = np.stack([teeth * np.cos(angle), teeth * np.sin(angle)], 1)
    return _extruded(rng, outline, 10 ** rng.uniform(-3, 0))


def drilled_plate(rng, n):
    """A plate of squares with a round hole each. Fans connect the points of a hole to the four corners; walls are below."""
    holes = int(rng.integers(1, 6))
    k = 4 * int(max(1, n / holes / holes / 16))
    angle = np.pi / 4 + np.arange(k + 1) * 2 * np.pi / k
    ring = 0.5 + rng.uniform(0.05, 0.45) * np.stack([np.cos(angle), np.sin(angle)], 1)
    corner = np.array([[1, 1], [0, 1], [0, 0], [1, 0]], float)
    sector = np.arange(k) * 4 // k
    fans = np.stack([corner[sector], ring[1:], ring[:-1]], 1)
    gaps = np.stack([corner[[0, 1, 2, 3]], corner[[1, 2, 3, 0]], ring[(np.arange(1, 5) * k // 4) % k]], 1)
    flat = np.concatenate([fans, gaps])
    thickness = 10 ** rng.uniform(-2.5, -0.5)
    top = np.concatenate([flat, np.full((*flat.shape[:2], 1), thickness)], 2)
    bottom = np.concatenate([flat[:, ::-1], np.zeros((*flat.shape[:2], 1))], 2)
    a, b = np.c_[ring[:-1], np.zeros(k)], np.c_[ring[1:], np.zeros(k)]
    up = np.array([0, 0, thickness])
    walls = np.concatenate([np.stack([a, b, b + up], 1), np.stack([a, b + up, a + up], 1)])
    cell = np.concatenate([top, bottom, walls])
    cells = [cell + [x, y, 0] for x in range(holes) for y in range(holes)]
    return welded(
        *meshes.soup(np.concatenate(cells).reshape(-1, 3), np.arange(3 * len(cell) * holes**2).reshape(-1, 3))
    )


def filleted_box(rng, n):
    """A rounded box: an eighth of a sphere at each corner, slivers along the edges, and two triangles on each side."""
    k = int(max(2, np.sqrt(n / 16)))
    quarter = np.linspace(0, np.pi / 2, k)
    long = np.concatenate([quarter + q * np.pi / 2 for q in range(4)])
    lat = np.concatenate([np.pi / 2 - quarter, -quarter])
    lo, la = np.meshgrid(long, lat)
    direction = np.stack([np.cos(la) * np.cos(lo), np.cos(la) * np.sin(lo), np.sin(la)], -1)
    q = np.repeat(np.arange(4), k)
    side_x, side_y = np.where((q == 0) | (q == 3), 1, -1), np.where(q < 2, 1, -1)
    offset = np.zeros_like(direction)
    offset[..., 0], offset[..., 1] = side_x, side_y
    offset[..., 2] = np.repeat([1, -1], k)[:, None]
    vertices = offset * rng.uniform(0.1, 1, 3) + rng.uniform(0.01, 0.2) * direction
    triangles = meshes.grid_triangles(4 * k, 2 * k, wrap_columns=True)
    last = (2 * k - 1) * 4 * k
    c = np.arange(4) * k
    caps = [[c[0], c[1], c[2]], [c[0], c[2], c[3]], last + c[[0, 2, 1]], last + c[[0, 3, 2]]]
    vertices = np.round(vertices, 12).reshape(-1, 3)
    return welded(vertices, np.concatenate([triangles[:, ::-1], np.array(caps)]))


def fan(rng, n):
    n = max(n, 3)
    angle = np.arange(n) * 2 * np.pi / n
    radius = np.where(np.arange(n) % 2, rng.choice([0.05, 0.5, 1.0]), 1.0)
    rim = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(n)], 1)
    centre = [[0, 0, rng.choice([0, 0, 0.1, 1])]]
    i = np.arange(n)
    return np.concatenate([rim, centre]), np.stack([np.full(n, n), i, (i + 1) % n], 1).astype(np.int32)


def collinear_strip(rng, n):
    """Two rows of points on two lines, a strip or two fans between them."""
    k = max(2, n // 2 + 1)
    x = np.sort(rng.random(k)) if rng.random() < 0.5 else np.linspace(0, 1, k)
    y = 10 ** rng.uniform(-4, 0)
    low, high = np.stack([x, 0 * x, 0 * x], 1), np.stack([x, 0 * x + y, 0 * x], 1)
    i = np.arange(k - 1)
    if rng.random() < 0.5:
        triangles = np.concatenate([np.stack([i, i + 1, i + k], 1), np.stack([i + 1, i + k + 1, i + k], 1)])
    else:
        triangles = np.concatenate(
            [np.stack([i, i + 1, np.full(k - 1, 2 * k - 1)], 1), np.stack([i + k, np.zeros(k - 1, int), i + k + 1], 1)]
        )
    return np.concatenate([low, high]), triangles.astype(np.int32)


def coplanar_box(rng, n):
    vertices, triangles = meshes.box(upper=rng.uniform(0.01, 1, 3))
    for _ in range(_levels(n, 12)):
        vertices, triangles = meshes.subdivide(vertices, triangles)
    return vertices, triangles


def holes(rng, n):
    vertices, triangles = rng.choice([smooth_closed, noisy, terrain, coplanar_box])(rng, n)
    return vertices, triangles[rng.random(len(triangles)) < rng.uniform(0.3, 0.95)]


def random_soup(rng, n):
    n = max(1, n)
    reach = min(1, np.sqrt(20 / n)) * 10 ** rng.uniform(-1, 0)
    corners = rng.random((n, 1, 3)) + reach * rng.uniform(-1, 1, (n, 3, 3))
    return meshes.soup(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def tangle(rng, n):
    """Random triangles on few vertices: edges with many faces, faces with a repeated corner, and repeated faces."""
    n = min(max(1, n), 150)
    k = int(rng.integers(3, 3 + n))
    return rng.standard_normal((k, 3)), rng.integers(0, k, (n, 3)).astype(np.int32)


def furniture(rng, n):
    """Walls between the boxes of a lattice, with some walls missing: the edges have one to four faces."""
    cells = int(rng.integers(1, 4))
    walls = [(axis, *p) for axis in range(3) for p in np.ndindex(*np.where(np.arange(3) == axis, cells + 1, cells))]
    walls = [wall for wall in walls if rng.random() < 0.8] or walls
    m = int(max(1, np.sqrt(n / 2 / len(walls))))
    flat, triangles = meshes.plate(m + 1)
    boards = []
    for axis, *place in walls:
        board = np.roll(flat, axis + 1, axis=1)
        boards.append((np.round(board, 12) + place, triangles))
    vertices, triangles = meshes.join(*boards)
    return welded(np.round(vertices, 9) * rng.uniform(0.2, 1, 3), triangles)


def t_junctions(rng, n):
    """Walls of a lattice as in furniture, but each of other squares, so that they meet along edges without common vertices."""
    cells = int(rng.integers(1, 3))
    walls = [(axis, *p) for axis in range(3) for p in np.ndindex(*np.where(np.arange(3) == axis, cells + 1, cells))]
    walls = [wall for wall in walls if rng.random() < 0.6] or walls
    boards = []
    for axis, *place in walls:
        m = int(max(1, np.sqrt(n / 2 / len(walls)) * rng.uniform(0.5, 2)))
        flat, triangles = meshes.plate(m + 1)
        board = np.roll(flat, axis + 1, axis=1)
        shift = rng.choice([0, 0, 0.5, 0.3]) * (np.arange(3) != axis)  # or on the inside of others
        boards.append((np.round(board, 12) + place + shift * (rng.random() < 0.3), triangles))
    vertices, triangles = meshes.join(*boards)
    return np.round(vertices, 9) * rng.uniform(0.2, 1, 3), triangles


def moebius(rng, n):
    columns, rows = _grid(rng, n)
    u, v = np.meshgrid(np.arange(columns) * 2 * np.pi / columns, np.linspace(-0.4, 0.4, rows))
    turned = u * (2 * rng.integers(0, 3) + 1) / 2
    r = 1 + v * np.cos(turned)
    vertices = np.stack([r * np.cos(u), r * np.sin(u), v * np.sin(turned)], -1).reshape(-1, 3)
    triangles = meshes.grid_triangles(columns, rows, wrap_columns=True)
    column, row = triangles % columns, triangles // columns
    # Across the seam a face's corners in column 0 belong to the row on the other side.
    seam = (column.max(1) == columns - 1) & (column.min(1) == 0)
    flipped = np.where(seam[:, None] & (column == 0), rows - 1 - row, row)
    return vertices, (flipped * columns + column).astype(np.int32)


def misoriented(rng, n):
    vertices, triangles = rng.choice([smooth_closed, noisy, terrain])(rng, n)
    wrong = rng.random(len(triangles)) < rng.uniform(0.05, 0.6)
    triangles[wrong] = triangles[wrong][:, ::-1]
    return vertices, triangles


def duplicated(rng, n):
    """A mesh with repeated faces. Some of these are reversed, and some have separate vertices."""
    vertices, triangles = rng.choice([smooth_closed, noisy, terrain, furniture])(rng, n * 2 // 3)
    again = triangles[rng.random(len(triangles)) < 0.4]
    turned = rng.random(len(again)) < 0.5
    again[turned] = again[turned][:, ::-1]
    if rng.random() < 0.5:
        return meshes.join((vertices, triangles), (vertices, again))
    return vertices, np.concatenate([triangles, again])


def double_sheet(rng, n):
    """A sheet and its copy: at the same place, very near to it, or connected to a thin closed body."""
    vertices, triangles = terrain(rng, n // 2)
    gap = rng.choice([0, 1e-12, 1e-6, 1e-3, 0.02])
    back = triangles[:, ::-1] if rng.random() < 0.5 else triangles
    return meshes.join((vertices, triangles), (vertices + [0, 0, gap], back))


def degenerate(rng, n):
    """Faces that are points or segments among others."""
    vertices, triangles = rng.choice([smooth_closed, terrain, fan])(rng, n * 3 // 4)
    a = rng.integers(0, len(vertices), max(1, len(triangles) // 4))
    b = np.where(rng.random(len(a)) < 0.5, a, rng.integers(0, len(vertices), len(a)))
    if len(a) > 100:  # Long segments have no area, but they cross many faces.
        b[100:] = np.minimum(a[100:] + 1, len(vertices) - 1)
    return vertices, np.concatenate([triangles, np.stack([a, a, b], 1)]).astype(np.int32)


def only_degenerate(rng, n):
    vertices = rng.standard_normal((max(3, n), 3)) * (rng.random() < 0.8)
    a, b = rng.integers(0, len(vertices), (2, min(max(1, n), 100)))
    return vertices, np.stack([a, a, b], 1).astype(np.int32)


def needles(rng, n):
    count = min(max(1, n // 2), 300)
    tips = rng.random((count, 3, 3))
    tips[:, 2] = (tips[:, 0] + tips[:, 1]) / 2 + 10 ** rng.uniform(-16, -3) * rng.standard_normal((count, 3))
    return meshes.join(coplanar_box(rng, n // 2), meshes.soup(tips.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)))


def spikes(rng, n):
    vertices, triangles = meshes.sphere(_levels(n, 8))
    pulled = rng.random(len(vertices)) < 10 ** rng.uniform(-3, -0.5)
    vertices[pulled] *= rng.uniform(0, 3, (pulled.sum(), 1))
    if len(triangles) > 2000:  # Many long spikes would have too large an area.
        vertices = meshes.spike(_levels(n, 8), length=rng.uniform(0.5, 4))[0]
    return vertices, triangles


def single_triangle(rng, n):
    return rng.standard_normal((3, 3)) * rng.choice([1, 1, 1e-3], 3), np.array([[0, 1, 2]], np.int32)


def touching(rng, n):
    """Bodies that meet in a vertex or along an edge, and plates that share one."""
    if n > 3000:
        return meshes.non_manifold()
    bodies = [meshes.box(np.array(p), np.array(p) + 1) for p in ((0, 0, 0), (1, 1, 0), (1, 1, 1), (0, 1, 1))]
    vertices, triangles = welded(*meshes.join(*bodies[: rng.integers(2, 5)]))
    for _ in range(_levels(n, len(triangles))):
        vertices, triangles = meshes.subdivide(vertices, triangles)
    return vertices, triangles


def no_mesh(rng, n):
    count = int(rng.integers(0, 4))
    return rng.standard_normal((count, 3)), np.empty((0, 3), np.int32)


KINDS = {
    kind.__name__: kind
    for kind in (
        smooth_closed,
        noisy,
        terrain,
        gear,
        drilled_plate,
        filleted_box,
        fan,
        collinear_strip,
        coplanar_box,
        holes,
        random_soup,
        tangle,
        furniture,
        moebius,
        misoriented,
        duplicated,
        double_sheet,
        degenerate,
        only_degenerate,
        needles,
        spikes,
        single_triangle,
        touching,
        no_mesh,
        t_junctions,
    )
}
# Kinds that joined later are drawn aside, so that the numbers of most cases go on to name the same meshes.
LATER = ("t_junctions",)


def _soup(rng, vertices, triangles):
    return meshes.soup(vertices, triangles)


def _shuffled(rng, vertices, triangles):
    order, place = rng.permutation(len(vertices)), np.empty(len(vertices), np.int32)
    place[order] = np.arange(len(vertices))
    return vertices[order], rng.permutation(place[triangles])


def _isolated(rng, vertices, triangles):
    return np.concatenate([vertices, rng.normal(0, 10, (5, 3))]), triangles


def _turned(rng, vertices, triangles):
    return vertices @ meshes.random_rotation(int(rng.integers(1 << 30))).T, triangles


def _flattened(rng, vertices, triangles):
    return vertices * [1, 1, rng.choice([0, 1e-9, 1e-3])], triangles


def _outlier(rng, vertices, triangles):
    vertices = vertices.copy()
    vertices[rng.integers(len(vertices))] += 10 ** rng.uniform(1, 6)
    return vertices, triangles


def _scaled(rng, vertices, triangles):
    return vertices * 10 ** rng.uniform(*(-18, 18) if rng.random() < 0.8 else (-100, 100)), triangles


def _far(rng, vertices, triangles):
    return vertices + rng.standard_normal(3) * np.abs(vertices).max() * 10 ** rng.uniform(0, 5), triangles


CHANGES = (
    (_soup, 0.05),
    (_shuffled, 0.3),
    (_isolated, 0.1),
    (_flattened, 0.05),
    (_turned, 0.3),
    (_outlier, 0.03),
    (_scaled, 0.15),
    (_far, 0.15),
)


def draw(rng, aside, n):
    """Returns (name, vertices float32 or float64, triangles) of one random mesh of about n faces.

    rng, aside: random generators; aside draws the kinds of LATER.
    """
    name = str(rng.choice([kind for kind in KINDS if kind not in LATER]))
    if aside.random() < len(LATER) / len(KINDS):
        name = str(aside.choice(LATER))
    vertices, triangles = KINDS[name](rng, n)
    for change, likely in CHANGES:
        if rng.random() < likely and len(triangles):
            vertices, triangles = change(rng, vertices, triangles)
            name += change.__name__
    largest = np.abs(vertices).max(initial=0)
    dtype = np.float32 if rng.random() < 0.5 and 1e-25 < largest < 1e25 else np.float64
    return name, np.ascontiguousarray(vertices, dtype), np.ascontiguousarray(triangles, np.int32)
