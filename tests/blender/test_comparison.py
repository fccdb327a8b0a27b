# SPDX-License-Identifier: GPL-3.0-or-later
"""comparison.py: the table has every method with judged distances, and the page around the table stays."""

import json

import pytest

from commands import BENCHMARK, command, save
from scenes import torus_arrays


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("comparison")
    save(folder / "ring.ply", ("ring", *torus_arrays()))
    page, figures = folder / "page.md", folder / "figures.json"
    page.write_text("# A page\n")
    done = command(
        BENCHMARK / "comparison.py", folder / "ring.ply", "--tolerance", "8%,5%", "--write", page, "--json", figures
    )
    assert done[0] == 0, done
    return done[1], page, json.loads(figures.read_text())


def test_methods_and_what_they_keep(written, gl):
    out, _, figures = written
    assert [round(mesh["tolerance"] / mesh["size"], 6) for mesh in figures["meshes"]] == [0.08, 0.05]
    for mesh in figures["meshes"]:
        by_name = {entry["method"]: entry for entry in mesh["methods"]}
        both, grid = by_name["certificate, both ways"], by_name["permission grid [19]"]
        assert both["forward"] <= 1 and both["backward"] <= 1
        assert grid["forward"] <= 1 and grid["precision"] == 4
        assert grid["triangles"] > by_name["certificate, one way"]["triangles"], "what its cells lose costs triangles"
        assert by_name["certificate, one way, coarse grid"]["memory"] < by_name["certificate, one way"]["memory"]
        assert by_name["vertex samples [11]"]["memory"] == 0
        assert by_name["occlusion query, proved"]["forward"] <= 1
        assert by_name["check as published"]["memory"] < grid["memory"]
        assert all(entry["ratio"] > 0 and entry["method"] in out for entry in mesh["methods"])


def test_table_is_replaced_and_the_page_kept(written):
    _, page, figures = written
    first = page.read_text()
    assert first.startswith("# A page\n") and first.count("| permission grid [19] | 4 |") == 2
    folder = page.parent
    page.write_text(first + "After.\n")
    done = command(
        BENCHMARK / "comparison.py",
        folder / "ring.ply",
        "--tolerance",
        "8%",
        "--methods",
        "grid",
        "--write",
        page,
        alone=True,
    )
    assert done[0] == 0, done
    second = page.read_text()
    assert second.startswith("# A page\n") and second.endswith("After.\n")
    assert second.count("| permission grid [19] | 4 |") == 1 and second.count("begin -->") == 1
    assert "certificate" in first and "certificate" not in second


@pytest.mark.parametrize(
    "arguments, word",
    [
        (["nowhere.ply"], "nowhere.ply"),
        (["suzanne", "--methods", "grid,rid"], "'rid'"),
        (["suzanne", "--tolerance", "1%,x"], "x"),
        (["suzanne", "--write", "no/where.md"], "no"),
    ],
)
def test_bad_arguments(arguments, word):
    code, _, err = command(BENCHMARK / "comparison.py", *arguments)
    assert code == 2 and word in err and len(err.splitlines()) == 1
