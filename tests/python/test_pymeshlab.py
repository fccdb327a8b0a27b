# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol.deviation and tolvol.directed_hausdorff agree with the Hausdorff filter of MeshLab, which samples at random.

Only this test needs PyMeshLab, and is skipped without it: install pytest and tests/python/extras.txt in a virtual environment.
"""

import importlib.util

import numpy as np
import pytest
import tolvol

import meshes

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("pymeshlab") is None,
    reason="PyMeshLab is not installed: pip install -r tests/python/extras.txt",
)

SAMPLES = 400_000


def decimated():
    vertices, triangles = meshes.torus(noise=0.004)
    result = tolvol.decimate(vertices, triangles, tolvol.ToleranceVolume(vertices, triangles, 0.03))
    return (result.vertices, result.triangles), (vertices, triangles)


PAIRS = {
    "a decimation and its reference": decimated,
    "a sphere and the torus around it": lambda: (meshes.sphere(5, 0.7), meshes.torus()),
    "a hill and a plate": lambda: (meshes.plate(49, bump=0.2), meshes.plate(17, side=0.8)),
}


def sampled(a, b):
    """Returns MeshLab's distances {"max", "mean", "RMS", ...} of random points of a from b."""
    import pymeshlab

    both = pymeshlab.MeshSet()
    for vertices, triangles in (a, b):
        both.add_mesh(pymeshlab.Mesh(np.asarray(vertices, np.float64), triangles))
    return both.get_hausdorff_distance(
        sampledmesh=0,
        targetmesh=1,
        samplevert=False,
        sampleedge=False,
        sampleface=True,
        samplenum=SAMPLES,
        maxdist=pymeshlab.PercentageValue(100),
    )


@pytest.mark.parametrize("backward", [False, True], ids=["there", "back"])
@pytest.mark.parametrize("pair", PAIRS)
def test_agrees_within_the_sampling_error(pair, backward):
    a, b = PAIRS[pair]()[:: -1 if backward else 1]
    ours, theirs = tolvol.deviation(*a, *b), sampled(a, b)
    # The difference may be four standard errors of the random samples and of tolvol's. MeshLab computes in float32.
    count = theirs["n_samples"]
    error = 4 * np.hypot(np.sqrt((ours.rms**2 - ours.mean**2) / count), ours.mean_error) + 1e-6
    fourth = (ours.weights * ours.distances**4).sum()
    square_error = 4 * np.sqrt((fourth - ours.rms**4) / count) + 1e-6
    largest = tolvol.directed_hausdorff(*a, *b)
    print(
        f"\n{pair}, {'back' if backward else 'there'}: mean {ours.mean:.6f} and {theirs['mean']:.6f} (+- {error:.6f}), "
        f"RMS {ours.rms:.6f} and {theirs['RMS']:.6f} (square +- {square_error:.2g}), "
        f"largest {largest.lower:.6f} to {largest.upper:.6f} and {theirs['max']:.6f}"
    )
    assert ours.mean == pytest.approx(theirs["mean"], abs=error)
    assert ours.rms**2 == pytest.approx(theirs["RMS"] ** 2, abs=square_error)
    assert ours.mean_range[0] - error <= theirs["mean"] <= ours.mean_range[1] + error
    # The farthest of the random points is a little nearer than the farthest point of the surface, and never farther.
    assert 0.97 * largest.lower <= theirs["max"] <= largest.upper + 1e-6
