# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a scan: a relief as a range camera sees it from one place, with noise, steps and pixels without depth."""

import numpy as np

PIXELS = 280  # number of pixels along each side
NOISE = 3e-4  # standard deviation of a depth; the relief is 2 wide
STEP = 1e-4  # the smallest difference of depths that the camera measures
MISSING = 0.002  # share of the pixels that have no depth
STEEPEST = 0.05  # neighbouring pixels whose depths differ by more are not connected


def scan(seed=1):
    """Returns an open mesh with holes and a ragged rim, of about 100,000 triangles: (n, 3) float32, (m, 3) int32."""
    random = np.random.default_rng(seed)
    s = np.linspace(-1, 1, PIXELS)
    x, y = np.meshgrid(s, s)
    radius2 = x**2 + y**2
    depth = np.sqrt(np.maximum(1.2 - radius2, 0))
    depth += 0.06 * np.exp(-((x - 0.1) ** 2 + y**2) / 0.02) - 0.05 * np.exp(-((x + 0.4) ** 2 + (y - 0.3) ** 2) / 0.01)
    depth += 0.015 * np.sin(9 * x + 4 * y) * np.cos(7 * y - 2 * x)
    seen = (radius2 < 0.98) & (random.random(x.shape) > MISSING)
    depth = np.round((depth + NOISE * random.standard_normal(x.shape)) / STEP) * STEP
    a, b, c, d = (np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, 1:], np.s_[1:, :-1])
    number = np.arange(x.size).reshape(x.shape)
    triangles = []
    for corners in ((a, b, c), (a, c, d)):
        depths = np.stack([depth[k] for k in corners])
        there = np.logical_and.reduce([seen[k] for k in corners]) & (np.ptp(depths, axis=0) < STEEPEST)
        triangles.append(np.stack([number[k][there] for k in corners], 1))
    used, triangles = np.unique(np.concatenate(triangles), return_inverse=True)
    vertices = np.stack([x, y, depth], -1).reshape(-1, 3)[used]
    return vertices.astype(np.float32), triangles.reshape(-1, 3).astype(np.int32)
