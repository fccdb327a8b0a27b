# SPDX-License-Identifier: GPL-3.0-or-later
"""The deviation as a dictionary, a table and a page; report.py's options; Save Report."""

import csv
import io
import json
import os
import re
from dataclasses import replace
from html.parser import HTMLParser

import bpy
import numpy as np
import pytest

from addon.mesh import mesh_io
from addon.reference import snapshots
from addon.shared.proof import deviation, deviation_table
from addon.shared.proof.deviation_pictures import Picture
from addon.shared.surface import Surface
from commands import command, save
from scenes import activate, add_object, sheet, sheet_arrays, torus, torus_arrays

pytestmark = pytest.mark.usefixtures("measured_once")
PNG = b"\x89PNG\r\n\x1a\n not looked at"


def surface(vertices, faces, name="part"):
    return snapshots.surface_of(add_object(name, vertices, faces))


def step(height=0.1, start=0.15):
    """Makes a flat square, and one whose part beyond x = start is lifted, with a slope 0.2 wide."""
    vertices, quads = sheet_arrays(count=10, bumps=0.0)
    lifted = vertices.copy()
    lifted[vertices[:, 0] > start, 2] += np.float32(height)
    return surface(lifted, quads), surface(vertices, quads)


def measured(a, b, tolerance=None, bounds=(), **options):
    run = deviation.deviation(a, b, b.size(), tolerance, bounds, **options)
    about = [{"name": name, "vertices": 1, "triangles": 2} for name in ("A <1>", "B & co")]
    return run | {"a": about[0], "b": about[1]}


# Measurements -------------------------------------------------------------------------------------------------------


def test_place_percentiles_bands_and_both_directions():
    a, b = step()
    run = measured(a, b, tolerance=0.05, bounds=(0.02,))
    slope = np.hypot(0.2, 0.1)
    area = 1.0 + 0.8 + slope
    forward = run["forward"]
    assert forward["largest"][0] <= 0.1 + 1e-7 and 0.1 - 1e-7 <= forward["largest"][1] <= 0.101
    assert forward["position"][0] >= 0.1 and forward["position"][2] == pytest.approx(0.1, rel=0.01)
    corners = a.arrays.vertices[a.arrays.triangles[forward["triangle"]]]
    assert corners[:, 0].min() <= forward["position"][0] <= corners[:, 0].max()
    assert forward["face"] == a.arrays.polygons[forward["triangle"]] != forward["triangle"]
    distances = {entry["percent"]: entry["distance"] for entry in forward["percentiles"]}
    assert set(distances) == {50, 90, 95, 99, 99.9}
    # Half of the area is flat at 0 (up to 1 / area), then the slope, then 0.1.
    assert distances[50] == pytest.approx(0.1 * (0.5 * area - 1.0) / slope, abs=0.002)
    assert distances[90] == pytest.approx(0.1)
    assert [entry["bound"] for entry in forward["beyond"]] == [0.02, 0.05]
    for entry, share in zip(forward["beyond"], ((0.8 + slope * 0.8) / area, (0.8 + slope / 2) / area)):
        assert entry["share"] == pytest.approx(share, abs=0.003)
        assert entry["range"][0] <= share <= entry["range"][1]
    mean = (0.8 * 0.1 + slope * 0.05) / area
    assert forward["mean_range"][0] - 1e-7 <= mean <= forward["mean_range"][1] + 1e-7  # float32 coordinates
    assert run["backward"]["largest"][1] > 0.05 and run["backward"]["mean"] != forward["mean"]
    assert forward["sides"] is None and run["backward"]["sides"] is None


def test_tolerance_is_an_edge_of_the_histogram():
    a, b = step()
    tolerances = (0.03, 0.05, 0.1, 1.0, 1e-4)
    for tolerance in (*tolerances, None):
        run = measured(a, b, tolerance, () if tolerance == 0.05 else tolerances)
        for way in ("forward", "backward"):
            edges, shares = np.array(run[way]["histogram"]["edges"]), run[way]["histogram"]["shares"]
            assert sum(shares) == pytest.approx(1) and len(shares) == len(edges) - 1 <= 61
            assert edges[0] == 0 and edges[-1] >= max(run[way]["largest"][1], tolerance or 0) * (1 - 1e-6)
            if tolerance and tolerance > 0.01:
                assert np.abs(edges - tolerance).min() < 1e-12
        assert run["forward"]["histogram"]["edges"] == run["backward"]["histogram"]["edges"]


def test_signed_where_the_other_surface_is_closed():
    vertices, quads = torus_arrays(noise=0)
    blown_up = vertices.copy()
    ring = np.stack([vertices[:, 0], vertices[:, 1], 0 * vertices[:, 0]], 1)
    ring *= 0.9 / np.linalg.norm(ring, axis=1, keepdims=True)
    blown_up += (0.1 * (vertices - ring)).astype(np.float32)
    run = measured(surface(blown_up, quads), surface(vertices, quads))
    forward, backward = run["forward"], run["backward"]
    assert forward["sides"]["share_inside"] == 0 and backward["sides"]["share_inside"] == 1
    assert forward["sides"]["mean"] == pytest.approx(forward["mean"]) and forward["mean"] == pytest.approx(
        0.035, rel=0.02
    )
    assert backward["sides"]["mean"] == pytest.approx(-backward["mean"])
    assert forward["sides"]["outside"][1] <= forward["largest"][1] and forward["sides"]["outside"][0] > 0.034
    edges, shares = (np.array(backward["histogram"][key]) for key in ("edges", "shares"))
    assert edges[0] == -edges[-1] and shares[edges[:-1] >= 0].sum() == 0


def test_page_has_no_digits_of_rounding_where_only_a_small_part_deviates():
    a, _ = step()
    vertices = a.arrays.vertices.copy()
    vertices[0, 2] += 0.05
    moved = Surface(replace(a.arrays, vertices=vertices), a.matrix)
    page = Page(deviation.deviation_page.page(measured(moved, a, tolerance=0.1)))
    assert "50 % of area withinalmost 0" in page.text and "Nothing deviates" not in page.text


def test_surfaces_that_are_the_same():
    a, _ = step()
    run = measured(a, a, tolerance=0.01)
    assert run["forward"]["largest"][1] < 1e-12 and run["forward"]["beyond"][0]["share"] == 0
    for each in (run, run | {"tolerance": None}):
        page = Page(deviation.deviation_page.page(each))
        assert page.text.count("Nothing deviates but by rounding") == 2 and "of area within" not in page.text
    assert "both are within the tolerance, proved" in deviation.deviation_page.page(run)
    assert "NaN" not in json.dumps(measured(a, a))


# The files ----------------------------------------------------------------------------------------------------------


class Page(HTMLParser):
    """Checks that tags are closed in order and that the page loads no other file. Collects the text."""

    VOID = {"meta", "img", "br", "path", "rect"}
    HIDDEN = {"style", "title"}

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.images, self.links, self.text = [], [], [], [], ""
        self.feed(text)
        assert not self.open
        assert "http" not in text and "url(" not in text.replace("url(#", "") and "@import" not in text

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        assert tag not in {"script", "link", "iframe", "object"}
        for name, value in attributes:
            if name == "href":
                self.links.append(value)
                assert value.startswith("#")
            if name == "src":
                assert value.startswith("data:image/png;base64,")
                self.images.append(value)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in self.HIDDEN:
            return
        self.text += data.replace("\xa0", " ")


def test_page_stands_alone_and_says_what_was_measured():
    a, b = step()
    run = measured(a, b, tolerance=0.05, bounds=(0.02,), unit="mm")
    page = Page(deviation.deviation_page.page(run))
    assert page.tags.count("svg") == page.tags.count("article") == 2 and not page.images
    assert "A <1> from B & co" in page.text and "B & co from A <1>" in page.text
    assert (
        "Tolerance 1.768 % of size = 0.05 mm" in page.text
        and "beyond the tolerance, proved: A <1> and B & co" in page.text
    )
    largest = run["forward"]["largest"][1]
    assert 0.1 <= float(re.search(r"at most\s+([\d.]+) mm", page.text)[1]) <= largest * 1.001
    # Rounded up: a proved bound must not look smaller than it is.
    of_size, of_tolerance = map(
        float, re.search(r"([\d.]+) % of size, ([\d.]+) % of the tolerance", page.text).groups()
    )
    for share, whole in ((of_size, run["size"]), (of_tolerance, 0.05)):
        assert 100 * largest / whole * (1 - 1e-6) <= share <= 100 * largest / whole * 1.001
    for entry in run["forward"]["percentiles"]:
        assert f"{entry['percent']:g} % of area within" in page.text and f"{entry['distance']:.4g}" in page.text
    assert "0.02 to 0.05" in page.text and "beyond 0.05" in page.text and "is not closed" in page.text
    loose = Page(deviation.deviation_page.page(run | {"tolerance": None}))
    assert (
        "beyond the tolerance, proved" not in loose.text
        and "of size" in loose.text
        and "of the tolerance" not in loose.text
    )


def test_page_bars_beyond_the_tolerance_are_striped():
    a, b = step()
    for tolerance, striped in ((0.05, True), (0.2, False)):
        text = deviation.deviation_page.page(measured(a, b, tolerance, bounds=(0.05, 0.2)))
        assert ('fill="url(#stripes-forward)"' in text) == striped


def test_page_holds_the_pictures():
    a, b = step()
    run = measured(a, b)
    page = Page(
        deviation.deviation_page.page(run, [Picture("of A <left>", PNG, 0.05, True), Picture("of B", PNG, 0.05)])
    )
    assert len(page.images) == 2 and "of A <left>" in page.text
    # The first picture has a legend with both signs, the second one without signs.
    assert page.text.count("−0.05") == 1 and page.text.count("0.025") == 1 and page.text.count("farther away") == 2


def test_proved_bounds_are_rounded_outwards():
    rounded = deviation.deviation_page._rounded
    assert rounded(0.1234011, True) == "0.123402" and rounded(0.1234019, False) == "0.123401"
    assert rounded(-0.1234011, False) == "-0.123402" and rounded(-0.1234019, True) == "-0.123401"
    # The rounding of 0.1 to float32 does not count as an excess.
    assert float(rounded(float(np.float32(0.1)), True)) == 0.1
    assert float(rounded(0.0, True)) == 0 and float(rounded(1.23e-15, True)) == 1.23e-15


def test_table_holds_the_same_numbers(tmp_path):
    a, b = step()
    run = measured(a, b, tolerance=0.05, bounds=(0.02,))
    for extension in deviation.EXTENSIONS:
        path = tmp_path / f"r{extension}"
        path.write_bytes(deviation.content(run, path, [Picture("picture", PNG)]))
    assert json.loads((tmp_path / "r.json").read_text()) == run
    assert "data:image/png" in (tmp_path / "r.html").read_text()
    rows = list(csv.DictReader(io.StringIO((tmp_path / "r.csv").read_text())))
    for way in ("forward", "backward"):
        found = {(row["quantity"], row["at"]): row for row in rows if row["direction"] == way}
        assert float(found["largest", ""]["upper"]) == run[way]["largest"][1]
        assert float(found["rms", ""]["value"]) == run[way]["rms"]
        assert float(found["percentile", "99.9"]["value"]) == run[way]["percentiles"][-1]["distance"]
        assert float(found["share beyond", "0.05"]["lower"]) == run[way]["beyond"][1]["range"][0]
        assert [float(found["position", axis]["value"]) for axis in "xyz"] == run[way]["position"]
        shares = [float(row["value"]) for (quantity, _), row in found.items() if quantity == "histogram from"]
        assert shares == run[way]["histogram"]["shares"]


@pytest.mark.parametrize(
    "name", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", " =1", "\uff1d1", '=HYPERLINK("http://x","y")']
)
def test_no_name_is_a_formula_in_the_table(name):
    a, b = step()
    run = measured(a, b) | {"unit": name}
    run["a"] |= {"name": name}
    run["b"] |= {"name": "plain-name\r= x"}
    run["forward"]["position"] = [-0.5, 0.0, 0.0]
    rows = {tuple(row[:3]): row[3] for row in csv.reader(io.StringIO(deviation_table.table(run), newline=""))}
    assert rows["", "a name", ""] == rows["", "unit", ""] == "'" + name.replace("\t", " ").replace("\r", " ")
    assert rows["", "b name", ""] == "plain-name = x" and rows["forward", "position", "x"] == "-0.5"


def test_names_of_files_need_not_be_text():
    a, b = step()
    run = measured(a, b)
    run["a"] |= {"name": os.fsdecode(b"scan \xff")}
    for extension in deviation.EXTENSIONS:
        assert b"scan \\udcff" in deviation.content(run, f"r{extension}")


# report.py ----------------------------------------------------------------------------------------------------------


def test_command_writes_every_format(tmp_path):
    first = save(tmp_path / "a.ply", ("a", *torus_arrays(around=24, across=12)))
    second = save(tmp_path / "b.ply", ("b", *torus_arrays(around=24, across=12, seed=2)))
    reports = [tmp_path / name for name in ("r.json", "r.csv", "R.HTML")]
    options = [option for path in reports for option in ("--report", path)]
    code, out, err = command("report.py", first, second, "--tolerance", "0.5%", "--unit", "mm", *options)
    assert (code, err) == (0, "") and " at (" in out
    run = json.loads(reports[0].read_text())
    assert run["unit"] == "mm" and run["tolerance"]["percent"] == pytest.approx(0.5)
    assert [entry["bound"] for entry in run["forward"]["beyond"]] == [run["tolerance"]["absolute"]]
    assert run["forward"]["sides"] and run["a"]["file"] == str(first)
    assert f"forward,mean,,{run['forward']['mean']!r}," in reports[1].read_text()
    assert "a.ply from b.ply" in Page(reports[2].read_text()).text


def test_command_refuses_other_formats_before_it_measures(scan, tmp_path):
    for arguments, word in (
        (("--report", tmp_path / "r.txt"), "'.*r.txt' does not end in .json, .csv, .html"),
        (("--report", tmp_path / "no" / "r.csv"), "does not exist"),
        (("--tolerance", "0"), "not a finite number above 0"),
    ):
        code, out, err = command("report.py", scan, scan, *arguments)
        assert code == 2 and len(err.splitlines()) == 1 and "largest" not in out
        assert re.search(word, err)


# Save Report --------------------------------------------------------------------------------------------------------


def lifted_sheet():
    ob = sheet(count=20, bumps=0.0)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    bpy.ops.tolvol.set_reference()
    co = mesh_io.column(ob.data.vertices, "co", 3)
    co[co[:, 0] > 0.5, 2] += np.float32(0.1)
    ob.data.vertices.foreach_set("co", co.ravel())
    ob.data.update()
    activate(ob)
    return ob


def test_save_report_measures_and_writes(tmp_path):
    ob = lifted_sheet()
    for extension in deviation.EXTENSIONS:
        assert bpy.ops.tolvol.save_report(filepath=str(tmp_path / f"r{extension}")) == {"FINISHED"}
    run = json.loads((tmp_path / "r.json").read_text())
    assert run["a"]["name"] == ob.name and run["a"]["triangles"] == 800 and run["b"]["name"] == "its reference"
    assert run["tolerance"]["absolute"] == 0.05 and run["unit"] == "m"
    assert run["forward"]["largest"][1] == pytest.approx(0.1, rel=0.01)
    assert ob.data.polygons[run["forward"]["face"]].center.x > 0.4
    assert [entry["bound"] for entry in run["forward"]["beyond"]] == pytest.approx([0.0125, 0.025, 0.0375, 0.05])
    assert f"{ob.name} from its reference" in Page((tmp_path / "r.html").read_text()).text


def test_save_report_refuses(tmp_path):
    lifted_sheet()
    for name, message in (("r.txt", "does not end in .json, .csv, .html"), ("no/r.csv", "does not exist")):
        with pytest.raises(RuntimeError, match=message):
            bpy.ops.tolvol.save_report(filepath=str(tmp_path / name))
    (tmp_path / "r.csv").mkdir()
    with pytest.raises(RuntimeError, match="r.csv: this is a folder"):
        bpy.ops.tolvol.save_report(filepath=str(tmp_path / "r.csv"))
    activate(torus("without a reference"))
    assert not bpy.ops.tolvol.save_report.poll()
