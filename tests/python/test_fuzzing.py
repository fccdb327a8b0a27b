# SPDX-License-Identifier: GPL-3.0-or-later
"""The fuzzer tests/fuzz.py itself: cases can be repeated, failures of all kinds are found, and findings are reduced."""

import ast
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


# Options that all calls share or that are judged in other ways, and the operations whose cases have the others.
NOT_DRAWN = {"threads", "progress", "to_world", "bound", "edges", "bounds", "percentiles"}
OWNERS = {
    "decimate": "decimate",
    "smooth": "smooth",
    "deform": "deform",
    "constrain": "constrain",
    "close_holes": "close_holes",
    "Guard": "guard",
    "Lattice": "deform",
    "check": "check",
    "crossing_pairs": "distance",
}


def options_of(name):
    """Returns the keyword-only arguments of a function, a class or a method of ToleranceVolume by the stub."""
    for node in ast.walk(ast.parse(Path(tolvol.__file__).with_suffix(".pyi").read_text())):
        if isinstance(node, ast.ClassDef) and node.name == name:
            node = next(item for item in node.body if getattr(item, "name", "") == "__init__")
        elif not (isinstance(node, ast.FunctionDef) and node.name == name):
            continue
        return {argument.arg for argument in node.args.kwonlyargs} - NOT_DRAWN
    raise AssertionError(f"the stub has no {name}")


@pytest.mark.parametrize("name", OWNERS)
def test_every_option_is_drawn_and_handed_on(monkeypatch, name):
    """Cases of the operation hand on every option, its less frequent values, and no volume where that is permitted."""
    wanted = {(option,) for option in options_of(name)}
    if ("crossings",) in wanted:
        wanted |= {("crossings", "allow"), ("crossings", "keep_out")}
    if ("outside",) in wanted:
        wanted |= {("outside", "keep"), ("outside", "error")}
    if name in ("decimate", "smooth", "deform"):
        wanted.add(("no volume",))
    if name == "Guard":
        wanted |= {("reset",), ("replace_faces",)}

    def recorded(function):
        def call(*args, **more):
            for option, value in more.items():
                if value is not None:
                    wanted.difference_update({(option,), (option, value if isinstance(value, str) else "")})
            if any(arg is None for arg in args):
                wanted.discard(("no volume",))
            return function(*args, **more)

        return call

    class Volume(tolvol.ToleranceVolume):
        check = recorded(tolvol.ToleranceVolume.check)

    class Guard(tolvol.Guard):
        __init__ = recorded(tolvol.Guard.__init__)

        def reset(self, *args, **more):
            wanted.discard(("reset",))
            super().reset(*args, **more)

        def replace_faces(self, *args, **more):
            wanted.discard(("replace_faces",))
            return super().replace_faces(*args, **more)

    if name == "check":
        monkeypatch.setattr(tolvol, "ToleranceVolume", Volume)
    else:
        monkeypatch.setattr(tolvol, name, Guard if name == "Guard" else recorded(getattr(tolvol, name)))
    vertices, triangles = meshes.torus(8, 6, noise=0.01)
    for seed in range(100):
        case = Case("torus", OWNERS[name], vertices, triangles, tolerance=0.05)
        operations.DRAW[case.operation](np.random.default_rng(seed), case)
        found = outcome(case)
        assert found[0] in ("passed", "refused"), found
        if not wanted:
            return
    raise AssertionError(f"no case has {wanted}")


def test_a_larger_angle_and_new_crossings_are_found(monkeypatch):
    decimate = tolvol.decimate
    wrong = Case("torus", "decimate", *meshes.torus(32, 16, noise=0.003), tolerance=0.05)
    wrong.options.update(placement="optimal", two_sided=True, max_normal_angle=12.0)
    # Two walls that are thinner than the tolerance, and two triangles that cross from the start.
    walls = [meshes.sphere(3, radius) for radius in (1.0, 1.01)]
    crossed = np.array([[3, 0, 0], [4, 0, 0], [3, 1, 0], [3.2, 0.2, -1], [3.2, 0.2, 1], [3.9, 0.9, 1]])
    parts = [*walls, (crossed, np.arange(6).reshape(2, 3))]
    shifts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    triangles = np.concatenate([faces + shift for (_, faces), shift in zip(parts, shifts)]).astype(np.int32)
    thin = Case("walls", "decimate", np.concatenate([v for v, _ in parts]), triangles, tolerance=0.05)
    thin.options.update(placement="optimal", two_sided=True)
    assert outcome(wrong)[0] == outcome(thin)[0] == "passed"

    def careless(*mesh, **options):
        options.pop("max_normal_angle", None)
        return decimate(*mesh, **options, crossings="allow")

    monkeypatch.setattr(tolvol, "decimate", careless)
    assert outcome(wrong)[:2] == ("found", "angle")
    assert outcome(thin)[:2] == ("found", "crossings")


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
    a, b = meshes.sphere(2), meshes.sphere(2, 1.1)
    distance = tolvol.directed_hausdorff(*a, *b)
    assert distance.lower - 1e-4 <= judges.cgal_distance(a, b, 1e-4, seconds=None) <= distance.upper + 1e-4
    shifted = b[0] + [0.3, 0, 0]
    both = np.concatenate([a[0], shifted]), np.concatenate([a[1], b[1] + len(a[0])])
    pairs = tolvol.crossing_pairs(*both)
    assert judges.crossings_by_cgal(*both, seconds=None) == len(pairs) > 10
    assert judges.crossings_by_cgal(*a, seconds=None) == 0
    several = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    assert judges.crossings_by_cgal(np.eye(5)[:, :3] * 3, several) is None, "no manifold"


def test_double_sheets_are_told_from_others():
    plate, torus = meshes.plate(4), meshes.torus(12, 8)
    vertices, triangles = meshes.join(plate, torus, (plate[0], plate[1][:, ::-1]), (plate[0] + [0, 0, 1], plate[1]))
    sheet = judges.double_sheets(vertices, triangles)
    count = len(plate[1])
    lies_on_another = np.zeros(len(triangles), bool)
    lies_on_another[:count] = lies_on_another[count + len(torus[1]) :][:count] = True
    assert np.array_equal(sheet >= 0, lies_on_another)
    assert len(np.unique(sheet[lies_on_another])) == 1


@pytest.mark.parametrize(
    ("seed", "number", "operation", "kind"),
    [
        (5012, 367, "chain", "needles_far"),  # hausdorff() between needles whose planes differ by rounding
        (5003, 124, "chain", "needles_shuffled_far"),  # the same, with float64
        (5006, 281, "decimate", "collinear_strip_shuffled"),  # hausdorff() from some needles of a strip to all
        (5013, 152, "decimate", "collinear_strip"),  # vertices with tens of thousands of faces around them
        (5002, 339, "deform", "furniture_shuffled"),  # deform() from two tolerances away, to the reference
        (5010, 100, "guard", "needles_scaled"),  # Guard from two tolerances away, needles
    ],
)
def test_cases_that_took_very_long_once(seed, number, operation, kind):
    case = draw.case_of(seed, number)
    assert (case.operation, case.kind) == (operation, kind), "another mesh is drawn for this number"
    watchdog = Watchdog()
    try:
        assert watchdog.run(case)[0] == "passed"
    finally:
        watchdog.close()
