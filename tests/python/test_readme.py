# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python code in README.md runs as it is printed there and does what the README says."""

import re
from pathlib import Path

import numpy as np
import pytest
import tolvol

import meshes

BLOCKS = re.findall(
    r"^```python\n(.*?)^```", (Path(__file__).resolve().parents[2] / "README.md").read_text(), re.M | re.S
)


def run(*blocks, columns=24, rows=12):
    vertices, triangles = meshes.torus(columns, rows)
    vertices += np.random.default_rng(1).normal(0, 0.003, vertices.shape).astype(np.float32)
    names = {"vertices": vertices, "triangles": triangles}
    for block in blocks:
        exec(block, names)
    return names


def block_with(word):
    found = [block for block in BLOCKS if word in block]
    assert len(found) == 1
    return found[0]


def distance(names, bound):
    triangles = names["triangles"]
    return tolvol.directed_hausdorff(names["positions"], triangles, names["vertices"], triangles, bound=bound)


@pytest.fixture(scope="module")
def ran():
    """What the blocks leave that draw nothing, run one after the other."""
    return run(*(block for block in BLOCKS if "render_" not in block))


def test_they_run_one_after_the_other(ran, gl):
    assert ["render_" in block for block in BLOCKS] == [False, False, False, True]
    exec(BLOCKS[-1], dict(ran))


def test_decimation_is_within_one_percent():
    names = run(block_with("tolvol.hausdorff"), columns=32, rows=16)
    assert len(names["result"].triangles) < len(names["triangles"]) / 4
    assert names["distance"].upper <= 0.01 * tolvol.diagonal(names["vertices"], names["triangles"])


def test_closing_holes_goes_on_from_the_decimation():
    vertices, triangles = meshes.torus(64, 32)
    names = {"vertices": vertices.astype(np.float32), "triangles": np.delete(triangles, slice(None, None, 30), axis=0)}
    exec(block_with("tolvol.hausdorff"), names)
    before = names["result"]
    exec(block_with("close_holes"), names)
    assert names["closed"].report["closed"] > 100
    assert len(names["result"].triangles) < len(before.triangles) / 2


def test_five_lines_keep_a_smoothing_loop_within_the_tolerance(ran):
    block = block_with("# added")
    without = "".join(line for line in block.splitlines(keepends=True) if "# added" not in line)
    assert block.count("# added") == 5 and "tolvol" not in without
    kept, free = ran, run(without)
    tolerance = kept["tolerance"]
    assert distance(kept, tolerance).upper <= tolerance < distance(free, tolerance).lower
    assert np.linalg.norm(kept["positions"] - kept["vertices"], axis=1).max() > 0.9 * tolerance
