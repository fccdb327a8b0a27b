# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of benchmark/other_tools.py that need no package of PyPI: search, judge, rows, curves, bad usage, failing
processes."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import meshes

BENCHMARK = Path(__file__).resolve().parents[2] / "benchmark"
sys.path[:0] = [str(BENCHMARK), str(BENCHMARK.parent / "blender_scripts")]
import generated  # noqa: E402
import other_tools  # noqa: E402
import solid  # noqa: E402
import tool_calls  # noqa: E402
import tool_curves  # noqa: E402
import tool_page  # noqa: E402
import tool_server  # noqa: E402
import tool_worker  # noqa: E402


def torus():
    vertices, triangles = meshes.torus(noise=0.004)
    vertices = vertices.astype(np.float32)
    return other_tools.Mesh("torus", vertices, triangles, other_tools.tolvol.diagonal(vertices, triangles))


def falling(edge):
    """A tool that keeps both directions up to the parameter `edge`, and leaves fewer triangles for larger parameters."""
    return lambda x: 1000 / x if x <= edge else None


@pytest.mark.parametrize("edge", [1e-9, 0.03, 1.0, 77.0, 1e8])
def test_search_finds_the_edge_of_what_is_kept_from_far_away(edge):
    parameter, _ = other_tools.search(1.0, falling(edge), calls=30)
    assert edge / 1.02 <= parameter <= edge


def test_search_asks_no_more_often_than_it_may():
    asked = []
    other_tools.search(1.0, lambda x: asked.append(x) or (5 if x < 0.3 else None), calls=9)
    assert len(asked) == len(set(asked)) == 9


def test_search_finds_fewer_beyond_a_parameter_that_is_not_kept():
    def count(x):
        return round(1000 / x) if x <= 1 or 1.15 < x < 1.3 else None

    parameter, triangles = other_tools.search(1.0, count)
    assert 1.15 < parameter < 1.3 and triangles == round(1000 / parameter)


def test_search_prefers_the_fewest_to_the_largest_parameter():
    parameter, triangles = other_tools.search(1.0, lambda x: round(100 * (1 + abs(x - 2))) if x < 5 else None)
    assert parameter == 2 and triangles == 100


@pytest.mark.parametrize("verdict", [None, 4])
def test_search_ends_where_nothing_or_everything_is_kept(verdict):
    found = other_tools.search(1.0, lambda x: verdict)
    assert found is None if verdict is None else found[1] == 4


@pytest.mark.parametrize(
    "forward, backward, expected",
    [(1.0, 0.5, "both"), (0.9, 1.001, "forward"), (1.2, 0.7, "backward"), (3, 4, "no"), (None, None, "no")],
)
def test_row_says_what_was_kept(forward, backward, expected):
    intervals = {"forward": forward, "backward": backward}
    entry = {"triangles": 1234, "seconds": 0.5}
    entry |= {way: [0.99 * upper, upper] for way, upper in intervals.items() if upper is not None}
    cells = tool_page.row("meshlib", entry)
    assert len(cells) == len(tool_page.HEADS)
    assert cells[1] == "1,234" and cells[5] == expected
    assert cells[3].startswith("**") == (forward is not None and forward <= 1)


def test_row_of_a_search_and_of_a_failure():
    entry = {"triangles": 0, "seconds": 30.0, "search": {"triangles": 5006, "solid": {"closed": True, "crossings": 0}}}
    assert tool_page.row("openmesh", entry)[-2:] == ["5,006", "yes"]
    assert tool_page.row("openmesh", {**entry, "search": {}})[-2:] == ["none", ""]
    cells = tool_page.row("cgal", {"failure": "did not end in 300 s"})
    assert len(cells) == len(tool_page.HEADS) and cells[1] == "did not end in 300 s"


def test_row_of_a_tool_without_a_parameter_for_an_error():
    cells = tool_page.row("libigl", {"search": {"triangles": 710, "solid": {"closed": False, "crossings": 0}}})
    assert cells[1:] == [""] * 6 + ["710", "open"]


@pytest.mark.parametrize(
    "closed, crossings, expected",
    [
        (True, 0, "yes"),
        (False, 0, "open"),
        (True, 1, "1 crossing"),
        (False, 1216, "open, 1,216 crossings"),
        (False, None, "no manifold"),
    ],
)
def test_row_says_whether_the_result_is_closed_and_uncrossed(closed, crossings, expected):
    entry = {"triangles": 12, "seconds": 1.0, "solid": {"closed": closed, "crossings": crossings}}
    assert tool_page.row("meshlib", entry)[tool_page.HEADS.index(tool_page.SOLID)] == expected


def test_solid_judges_closed_open_crossing_and_other_meshes():
    vertices, triangles = meshes.torus(24, 12)
    assert solid.judge(vertices, triangles) == {"closed": True, "crossings": 0}
    assert solid.judge(vertices, triangles[1:]) == {"closed": False, "crossings": 0}
    both = meshes.join((vertices, triangles), (vertices[:, [0, 2, 1]] + [0.3, 0, 0], triangles[:, ::-1]))
    pairs = other_tools.tolvol.crossing_pairs(*both)
    assert solid.judge(*both) == {"closed": True, "crossings": len(pairs)} and len(pairs) > 10
    flipped = np.concatenate([triangles[:1, ::-1], triangles[1:]])
    assert solid.judge(vertices, flipped) == {"closed": False, "crossings": None}
    repeated = np.concatenate([triangles, triangles[:1, [0, 0, 1]]])
    assert solid.judge(vertices, repeated) == {"closed": False, "crossings": None}


class Halves:
    """A worker whose answer to a parameter above 1 is a part of the mesh, and below 1 all of it, a triangle less for each."""

    def __init__(self, mesh):
        self.mesh, self.left = mesh, len(mesh.triangles)

    def ask(self, what, parameter, limit):
        self.left -= 1
        count = self.left if parameter <= 1 else self.left // 4
        return {"vertices": self.mesh.vertices, "triangles": self.mesh.triangles[:count], "seconds": parameter}


def test_the_fewest_of_a_search_come_with_their_own_judgement(monkeypatch):
    judged = []
    monkeypatch.setattr(solid, "judge", lambda vertices, triangles: judged.append(len(triangles)) or {})
    mesh = torus()
    found = other_tools.fewest(tool_calls.TOOLS["meshlib"], Halves(mesh), mesh, 0.1, {"triangles": 9}, 60)
    assert len(mesh.triangles) - other_tools.SEARCH_CALLS <= found["triangles"] < len(mesh.triangles)
    assert judged == [found["triangles"]] and found["call"] == found["parameter"] <= 1


@pytest.mark.parametrize(
    "name, entry, start",
    [
        ("meshlib", {"triangles": 100}, 0.1),
        ("pymeshlab", {"triangles": 100}, 9216 / 100),
        ("libigl", {}, other_tools.FIRST_RATIO),
        ("blender-planar", {}, math.radians(5)),
    ],
)
def test_a_search_starts_from_what_is_known_of_the_parameter(name, entry, start):
    asked, mesh = [], torus()

    class Refusing:
        def ask(self, what, parameter, limit):
            asked.append(parameter)
            return {"failure": "no"}

    assert other_tools.fewest(tool_calls.TOOLS[name], Refusing(), mesh, 0.1, entry, 60) == {}
    assert asked[0] == pytest.approx(start) and min(asked) < 0.01 * start


def case(percent, mesh="torus", **tools):
    entries = {name.replace("_", "-"): entry for name, entry in tools.items()}
    return {"mesh": mesh, "triangles": 9216, "tolerance": percent / 50, "percent": percent, "tools": entries}


def result(triangles, upper=0.9, fewest=None):
    entry = {"triangles": triangles, "seconds": 1.0, "forward": [0, upper], "backward": [0, 0.9]}
    return entry if fewest is None else {**entry, "search": {"triangles": fewest, "call": 1.0}}


@pytest.mark.parametrize(
    "tools, best",
    [
        ({"meshlib": result(900, fewest=700), "cgal": result(500), "ours": result(100)}, (500, "cgal")),
        ({"meshlib": result(900, fewest=400), "cgal": result(500), "subset": result(10)}, (400, "meshlib")),
        ({"meshlib": result(300, upper=1.01, fewest=700), "pyfqmr": {"failure": "crashed"}}, (700, "meshlib")),
        ({"blender_collapse": {"search": {"triangles": 650}}, "vtk_quadric": result(0, 9)}, (650, "blender-collapse")),
        ({"ours": result(100), "meshlib": {**result(300, upper=1.01), "search": {}}}, None),
    ],
)
def test_the_best_other_tool_is_the_one_with_the_fewest_that_keep_both_directions(tools, best):
    assert tool_curves.best_of_others(case(1, **tools)) == best


def test_curves_go_from_wide_to_narrow_tolerances():
    tools = {"ours": result(200), "thorough": result(150), "meshlib": result(900, fewest=700)}
    cases = [case(0.1, "sphere", **tools), case(1, **tools), case(2, "sphere", **tools, cgal=result(600))]
    lines = tool_curves.curves([*cases, case(0.5, "sphere", ours=result(200, upper=1.2))])
    assert list(lines) == ["sphere", "torus"]
    assert lines["sphere"]["ours"] == [(2, 200, "ours"), (0.1, 200, "ours")], "what is not kept is no part of a curve"
    assert lines["sphere"]["others"] == [(2, 600, "cgal"), (0.1, 700, "meshlib")]
    assert lines["torus"]["theory"] == [] and lines["torus"]["thorough"] == [(1, 150, "thorough")]
    percents, counts, _ = zip(*lines["sphere"]["theory"])
    assert percents == (2, 0.5, 0.1)
    assert counts[2] == pytest.approx(20 * counts[0]), "the slope is one over the tolerance"


def test_texts_at_the_ends_of_the_curves_do_not_overlap():
    heights = {"others": 4.0, "ours": 3.7, "thorough": 3.62, "theory": 3.55}
    moved = tool_curves.spread(heights, gap=0.15)
    assert moved == pytest.approx({"others": 4.0, "ours": 3.7, "thorough": 3.55, "theory": 3.4})


def test_the_slope_of_the_theory_is_drawn_below_a_curve_whose_height_it_does_not_know():
    points = tool_curves.slope([(2, 76, "thorough"), (1, 164, "thorough"), (0.1, 2590, "thorough")], [2, 1, 0.1])
    assert [count * percent for percent, count, _ in points] == pytest.approx([76] * 3)
    assert tool_curves.slope([], [2, 1]) == []


def test_the_smooth_optimum_is_a_sphere_of_triangles_that_are_as_far_outside_as_inside():
    tolerance = 1e-6
    # A triangle with its corners a tolerance outside the unit sphere, and its centre a tolerance inside.
    corner, centre = 1 + tolerance, 1 - tolerance
    radius = math.sqrt(corner**2 - centre**2)
    area = 3 * math.sqrt(3) / 4 * radius**2
    assert tool_curves.smooth_optimum(tolerance, tool_curves.CONVEX["sphere"]) == pytest.approx(
        4 * math.pi / area, rel=1e-5
    )


def test_decimation_of_the_sphere_is_above_the_theory_and_not_far():
    vertices, triangles = generated.sphere(4)
    assert len(triangles) == 5120 and solid.judge(vertices, triangles) == {"closed": True, "crossings": 0}
    assert np.linalg.norm(vertices.astype(float), axis=1) == pytest.approx(1, abs=1e-6)
    volume = other_tools.tolvol.ToleranceVolume(vertices, triangles, 0.05)
    left = len(other_tools.tolvol.decimate(vertices, triangles, volume).triangles)
    assert 1 < left / tool_curves.smooth_optimum(0.05, tool_curves.CONVEX["sphere"]) < 2.2


def test_each_tool_has_a_marker_of_its_own_in_the_picture():
    assert len({str(marker) for _, marker in tool_page.LOOKS.values()}) == len(tool_page.LOOKS)
    assert set(tool_page.LOOKS) == set(tool_calls.TOOLS) - {"subset"}


def test_the_pictures_are_drawn(tmp_path):
    pytest.importorskip("matplotlib")
    tools = {"ours": result(200), "thorough": result(150), "meshlib": result(900, fewest=700)}
    tools |= {"libigl": {"search": {"triangles": 650, "call": 2.0}}, "cgal": {"failure": "crashed"}}
    cases = [case(percent, mesh, **tools) for mesh in ("torus", "sphere") for percent in (1, 0.1)]
    for number, draw in enumerate((tool_page.draw, tool_curves.draw_curves)):
        draw(cases, tmp_path / f"{number}.png")
        assert (tmp_path / f"{number}.png").read_bytes()[:4] == b"\x89PNG"


def test_judge_sees_both_directions():
    mesh, tolerance = torus(), 0.05
    half = {"vertices": mesh.vertices.astype(np.float64), "triangles": mesh.triangles[: len(mesh.triangles) // 4]}
    entry = other_tools.judge(mesh, tolerance, half)
    assert tool_page.kept(entry) == "forward" and entry["backward"][0] > 1
    assert entry["backward"][1] <= 1.02 * entry["backward"][0]
    assert not other_tools.keeps_both(mesh, tolerance, half)
    whole = {**half, "triangles": mesh.triangles}
    assert tool_page.kept(other_tools.judge(mesh, tolerance, whole)) == "both" and other_tools.keeps_both(
        mesh, tolerance, whole
    )


def test_merged_makes_a_surface_of_a_soup():
    vertices, triangles = meshes.torus()
    soup = vertices[triangles].reshape(-1, 3)
    corners = np.arange(len(soup)).reshape(-1, 3)
    points, faces = tool_server.merged(np.concatenate([soup, [[9, 9, 9]]]), np.concatenate([corners, [[0, 0, 1]]]))
    assert len(points) == len(vertices) and len(faces) == len(triangles)
    assert points.dtype == np.float32 and faces.dtype == np.int32


def test_scan_is_open_noisy_and_the_same_every_time(tmp_path):
    mesh = other_tools.read_mesh("scan", tmp_path)
    vertices, triangles = mesh.vertices, mesh.triangles
    assert (vertices.dtype, triangles.dtype) == (np.float32, np.int32) and len(triangles) > 100_000
    assert np.array_equal(np.unique(triangles), np.arange(len(vertices)))
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1)
    uses = np.unique(edges, axis=0, return_counts=True)[1]
    assert uses.max() == 2 and (uses == 1).sum() > 1000
    again = other_tools.read_mesh("scan", tmp_path)
    assert mesh.digest() == again.digest()
    result = other_tools.tolvol.decimate(
        vertices, triangles, other_tools.tolvol.ToleranceVolume(vertices, triangles, 0.04)
    )
    assert len(result.triangles) < 0.01 * len(triangles)


def worker(tmp_path, name="ours"):
    """Runs the script by this Python, which has the module under test and no other tool."""
    return tool_worker.Worker(sys.executable, name, torus(), 1, tmp_path)


def test_worker_answers_again_and_again(tmp_path):
    one, tolerance = worker(tmp_path), 0.04
    for _ in range(2):
        answer = one.ask("run", tolerance, 60)
        assert answer["seconds"] > 0 and other_tools.keeps_both(torus(), tolerance, answer)
    assert one.end() == 0


def test_worker_says_why_there_is_no_result(tmp_path):
    one = worker(tmp_path)
    assert "tolerance" in one.ask("run", -1, 60)["failure"]
    assert "triangles" in one.ask("run", 0.04, 60), "it goes on after that"
    assert one.ask("run", 1e-5, 0.01) == {"failure": "did not end in 0.01 s"}
    assert "triangles" in one.ask("run", 0.04, 60), "it starts again after that"
    one.process.kill()
    one.process.wait()
    assert one.ask("run", 0.04, 60) == {"failure": "crashed (SIGKILL)"}


def test_results_are_remembered_until_they_are_wanted_anew(tmp_path):
    path, numbers = tmp_path / "results" / "one.json", iter((1, 2))
    assert [other_tools.remembered(path, again, lambda: next(numbers)) for again in (False, False, True)] == [1, 1, 2]


@pytest.mark.parametrize(
    "words, message",
    [
        ([], "MESH"),
        (["missing.ply"], "missing.ply: no such file"),
        (["notes.txt"], "not one of .obj, .ply, .stl"),
        (["mesh.ply", "--tolerance", "0%"], "not a finite number above 0"),
        (["mesh.ply", "--tolerance", "101%"], "'101%' is more than the size of the mesh"),
        (["mesh.ply", "--tolerance", "small"], "neither a length nor a percentage"),
        (["mesh.ply", "--only", "nobody"], "nobody"),
        (["mesh.ply", "--limit", "0"], "0 is less than 1"),
        (["mesh.ply", "--write", "nowhere/page.md"], "nowhere does not exist"),
        (["mesh.ply", "--curves", "nowhere/curves.png"], "nowhere does not exist"),
    ],
)
def test_bad_usage_is_one_line(words, message, tmp_path):
    for name in ("mesh.ply", "notes.txt"):
        (tmp_path / name).touch()
    done = subprocess.run(
        [sys.executable, BENCHMARK / "other_tools.py", *words], capture_output=True, text=True, cwd=tmp_path
    )
    assert done.returncode == 2 and done.stdout == ""
    assert message in done.stderr and len(done.stderr.splitlines()) == 1
