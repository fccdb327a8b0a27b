# SPDX-License-Identifier: GPL-3.0-or-later
"""Tries candidates that are made to mislead a check, and compares its verdicts with certified distances.

A third of the candidates lie within 2 % of the tolerance. Wrong accepts are counted by tolvol.directed_hausdorff, over
all accepted candidates and not over a sample. This function has bounds of its own. It shares geometry and threads with
the check, and is tested against brute force and CGAL. For a method that proves nothing only accepted candidates with a
corner outside are counted: the true number of its wrong accepts is at least as large.
"""

import numpy as np

from addon.native import module as tolvol

BAND = 0.02  # share of the tolerance; a candidate that is nearer to the tolerance may stay unproved
CANDIDATES = 1_000_000  # number of candidates for each reference
BATCH = 100_000
OUTSIDE, UNPROVED, INSIDE = tolvol.Verdict
FINEST = 4  # grid nodes per tolerance for methods that interpolate
INTERPOLATING = ("occlusion_query", "paper", "paper_half_h")
METHODS = ("certificate", "gl_certificate", *INTERPOLATING)
NOT_PROVING = ("paper", "paper_half_h")


def references(method="certificate", seed=1):
    """Yields (name, vertices, triangles, tolerance) of references that are difficult themselves."""
    rng = np.random.default_rng(seed)
    # For a smaller tolerance a grid that is fine enough to interpolate does not fit into memory.
    tolerance = 5e-2 if method in INTERPOLATING else 1e-3
    for exponent in range(2, 8):
        vertices, triangles = _needles(rng, 300, 10.0**-exponent)
        yield f"needles of height 1e-{exponent}", vertices, triangles, tolerance
    vertices, triangles = _needles(rng, 300, 1e-1)
    triangles[100:200, 2] = triangles[100:200, 1]
    triangles[200:, 1:] = triangles[200:, :1]
    yield "triangles, segments and points", vertices, triangles, tolerance
    vertices, triangles = _needles(rng, 300, 1e-3)
    yield "needles at 1e6 from the origin", vertices + [1e6, -1e6, 1e6], triangles, tolerance


def _needles(rng, count, height):
    """Returns triangles with two edges of length about 1 and the given height, anywhere in the unit cube."""
    a = rng.random((count, 3))
    along = _unit(rng.standard_normal((count, 3)))
    across = _unit(np.cross(along, rng.standard_normal((count, 3))))
    b = a + along * rng.uniform(0.7, 1.3, (count, 1))
    c = a + (b - a) * rng.random((count, 1)) + height * across
    return np.stack([a, b, c], 1).reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _on_surface(rng, vertices, triangles, count):
    """Returns random points of the reference, and the corners of the triangles that they are on."""
    corners = vertices[triangles[rng.integers(0, len(triangles), count)]]
    return np.einsum("nk,nkd->nd", rng.dirichlet([0.5, 0.5, 0.5], count), corners), corners


def _about_the_tolerance(rng, volume, vertices, triangles, count):
    """Returns candidates whose farthest corner is within BAND of the tolerance, on either side of it."""
    found = np.empty((0, 3, 3))
    while len(found) < count:
        tried = _towards_the_tolerance(rng, volume, vertices, triangles, count)
        near = np.abs(_farthest_corner(volume, tried) / volume.tolerance - 1) <= BAND
        found = np.concatenate([found, tried[near]])
    return found[:count]


def _farthest_corner(volume, points):
    return volume.distance(points.reshape(-1, 3)).reshape(-1, 3).max(1)


def _towards_the_tolerance(rng, volume, vertices, triangles, count):
    """Returns candidates that were moved along a line until their farthest corner is about the tolerance away.

    Not every candidate gets there: the caller has to test them.
    """
    epsilon = volume.tolerance
    base, _ = _on_surface(rng, vertices, triangles, count)
    direction = _unit(rng.standard_normal((count, 3)))
    shape = epsilon * 10 ** rng.uniform(-3, 0.5, (count, 1, 1)) * rng.standard_normal((count, 3, 3))
    # Half of them lie across the direction of the move, like a face that an operation wants to create.
    flat = rng.random(count) < 0.5
    shape[flat] -= np.einsum("nkd,nd->nk", shape[flat], direction[flat])[..., None] * direction[flat][:, None]
    wanted = epsilon * (1 + rng.uniform(-BAND, BAND, count))
    reach = wanted.copy()
    for _ in range(6):
        reach += wanted - _farthest_corner(volume, base[:, None] + shape + (reach[:, None] * direction)[:, None])
    return base[:, None] + shape + (reach[:, None] * direction)[:, None]


def _anyhow(rng, volume, vertices, triangles, count):
    """Returns candidates of any size and place near the reference."""
    epsilon = volume.tolerance
    base, _ = _on_surface(rng, vertices, triangles, count)
    place = epsilon * 10 ** rng.uniform(-2, 0.5, (count, 1)) * rng.standard_normal((count, 3))
    shape = epsilon * 10 ** rng.uniform(-1, 2, (count, 1, 1)) * rng.standard_normal((count, 3, 3))
    return (base + place)[:, None] + shape


def _misleading(rng, volume, vertices, triangles, count):
    """Returns candidates with corners on the reference: spikes with one corner pulled off it, needles, segments, points,
    and bridges over gaps."""
    epsilon = volume.tolerance
    base, own = _on_surface(rng, vertices, triangles, count)
    points = own + rng.choice([0, 1e-9, 0.999999], (count, 1, 1)) * epsilon * _unit(rng.standard_normal((count, 1, 3)))
    kind = rng.integers(0, 5, count)
    spike = kind == 0
    points[spike, 0] += epsilon * rng.uniform(0.5, 1.7, (spike.sum(), 1)) * _unit(rng.standard_normal((spike.sum(), 3)))
    needle = kind == 1
    points[needle, 2] = points[needle, 1] + 1e-7 * (points[needle, 2] - points[needle, 1])
    points[kind == 2, 2] = points[kind == 2, 1]
    points[kind == 3, 1:] = points[kind == 3, :1]
    bridge = kind == 4
    points[bridge, 0] = base[bridge]
    points[bridge, 1] = base[np.roll(np.flatnonzero(bridge), 1)]
    return points


def _surface(points):
    return points.reshape(-1, 3), np.arange(3 * len(points), dtype=np.int32).reshape(-1, 3)


def _farther(points, vertices, triangles, bound, threads):
    """Returns the number of candidates that are certified to be farther than the bound from the reference."""
    if len(points) == 0:
        return 0
    distance = tolvol.directed_hausdorff(*_surface(points), vertices, triangles, bound=bound, threads=threads)
    if distance.upper <= bound:
        return 0
    if len(points) == 1:
        return int(distance.lower > bound)
    half = len(points) // 2
    return sum(_farther(part, vertices, triangles, bound, threads) for part in (points[:half], points[half:]))


def judge(name, vertices, triangles, tolerance, threads=None, method="certificate", count=CANDIDATES, seed=2):
    """Returns one entry of `hostile`: the verdicts on `count` candidates for one reference."""
    vertices = np.asarray(vertices, np.float64)
    precision = FINEST if method in INTERPOLATING else None
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, precision=precision, threads=threads)
    rng = np.random.default_rng(seed)
    verdicts = np.zeros(3, np.int64)
    near, wrong, proved, unproved, largest = 0, 0, 0, [], 0.0
    for start in range(0, count, BATCH):
        size = min(BATCH, count - start)
        shares = np.diff([0, size // 3, 2 * size // 3, size])
        makers = (_about_the_tolerance, _anyhow, _misleading)
        points = np.concatenate([make(rng, volume, vertices, triangles, n) for make, n in zip(makers, shares)])
        certified = volume.check(*_surface(points), threads=threads)
        result = (
            certified if method == "certificate" else volume.check(*_surface(points), threads=threads, method=method)
        )
        verdict = result.verdicts
        verdicts += np.bincount(verdict, minlength=3)
        proved += int((certified.verdicts == INSIDE).sum())
        near += int((np.abs(_farthest_corner(volume, points) / tolerance - 1) <= BAND).sum())
        accepted = points[verdict == INSIDE]
        if method in NOT_PROVING:
            farthest = _farthest_corner(volume, accepted) / tolerance
            wrong += int((farthest > 1 + 1e-9).sum())
            largest = max(largest, farthest.max(initial=0))
            continue
        distance = tolvol.directed_hausdorff(*_surface(accepted), vertices, triangles, bound=tolerance, threads=threads)
        largest = max(largest, distance.upper / tolerance)
        if distance.upper > tolerance:
            wrong += _farther(accepted, vertices, triangles, tolerance, threads)
        if method == "certificate":
            unproved.append(points[verdict == UNPROVED])

    entry = {
        "reference": name,
        "method": result.method,
        "renderer": result.renderer,
        "precision": volume.precision,
        "candidates": count,
        "within_band": near,
        "inside": int(verdicts[INSIDE]),
        "outside": int(verdicts[OUTSIDE]),
        "unproved": int(verdicts[UNPROVED]),
        "inside_by_certificate": proved,
        "largest_inside": largest,
        "wrong_accepts": wrong,
    }
    if method == "certificate":
        beyond = _beyond_band(np.concatenate(unproved), vertices, triangles, tolerance, threads)
        entry["unproved_beyond_band"] = beyond
        entry["unproved_beyond_band_share"] = beyond / max(1, count - near)
    return entry


def line(entry):
    if "unproved_beyond_band" in entry:
        comparison = f"{entry['unproved_beyond_band']:,} beyond the 2 %"
    else:
        comparison = f"the certificate: {entry['inside_by_certificate']:,} inside"
    return (
        f"{entry['reference']}: {entry['candidates']:,} candidates, {entry['within_band']:,} within 2 % of the tolerance, "
        f"by {entry['method']} {entry['inside']:,} inside, {entry['outside']:,} outside, {entry['unproved']:,} unproved "
        f"({comparison}), wrong accepts {entry['wrong_accepts']:,}"
    )


def _beyond_band(points, vertices, triangles, tolerance, threads):
    """Returns the number of candidates that are certified to be inside or outside by more than BAND."""
    far = _farther(points, vertices, triangles, (1 + BAND) * tolerance, threads)
    not_near = _farther(points, vertices, triangles, (1 - BAND) * tolerance, threads)
    return far + len(points) - not_near
