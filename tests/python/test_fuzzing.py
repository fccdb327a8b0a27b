# SPDX-License-Identifier: GPL-3.0-or-later
"""The fuzzer tests/fuzz.py itself: cases can be repeated, failures of all kinds are found, and findings are reduced."""

import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import tolvol

import meshes

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fuzzing import draw, judges, kinds, operations  # noqa: E402
from fuzzing.case import Case  # noqa: E402
from fuzzing.shrink import Shrink  # noqa: E402
from fuzzing.watchdog import Watchdog, outcome  # noqa: E402


def torus_case(operation, seed=1):
    vertices, triangles = meshes.torus(24, 12, noise=0.01)
    case = Case("torus", operation, vertices, triangles, tolerance=0.05)
    operations.DRAW[operation](np.random.default_rng(seed), case)
    return case


def same(a, b):
    return (
        a.line() == b.line()
        and np.array_equal(a.vertices, b.vertices)
        and np.array_equal(a.triangles, b.triangles)
        and all(np.array_equal(a.arrays[name], b.arrays[name]) for name in {*a.arrays, *b.arrays})
    )


def test_a_case_is_the_same_each_time_and_in_its_file(tmp_path):
    for number in range(30):
        case = draw.case_of(5, number)
        assert same(case, draw.case_of(5, number))
        case.save(tmp_path / "case.npz")
        assert same(case, Case.load(tmp_path / "case.npz"))


@pytest.mark.parametrize("kind", kinds.KINDS)
def test_kinds_have_indices_and_faces_in_range(kind):
    for n in (1, 50, 2000):
        vertices, triangles = kinds.KINDS[kind](np.random.default_rng(n), n)
        assert triangles.dtype == np.int32 and len(triangles) <= max(1000, 2 * n)
        assert len(triangles) == 0 or 0 <= triangles.min() <= triangles.max() < len(vertices)


def test_a_tolerance_that_is_not_kept_is_found_and_made_small(monkeypatch):
    case = Case("torus", "decimate", *meshes.torus(24, 12, noise=0.01), tolerance=0.05)
    case.options.update(placement="optimal", two_sided=False)
    assert outcome(case)[0] == "passed"
    volume = tolvol.ToleranceVolume
    monkeypatch.setattr(tolvol, "ToleranceVolume", lambda v, t, tolerance, **more: volume(v, t, 3 * tolerance, **more))
    found = outcome(case)
    assert found[:2] == ("found", "beyond: result to reference")
    small = Shrink(case, lambda smaller: outcome(smaller)[1] == found[1], 20).case
    assert len(small.triangles) < len(case.triangles) / 4 and len(small.vertices) < len(case.vertices) / 2


def test_a_crash_a_hang_and_an_exception_are_findings(monkeypatch):
    def fails(how):
        monkeypatch.setitem(operations.OPERATIONS, "decimate", lambda run: run.call("decimate", how))
        watchdog = Watchdog()
        try:
            return watchdog.run(torus_case("decimate"), seconds=0.5)[:2]
        finally:
            watchdog.close()

    def hang():
        while True:
            time.process_time()

    assert fails(lambda: os._exit(3)) == ("found", "crash: decimate")
    assert fails(hang) == ("found", "hang: decimate")
    assert fails(lambda: [][0]) == ("found", "exception: decimate")


def test_the_second_judge_agrees():
    if not judges.CGAL.exists():
        pytest.skip("CGAL is not installed")
    a, b = meshes.sphere(2), meshes.sphere(2, 1.1)
    distance = tolvol.directed_hausdorff(*a, *b)
    assert distance.lower - 1e-4 <= judges.cgal_distance(a, b, 1e-4, seconds=None) <= distance.upper + 1e-4
