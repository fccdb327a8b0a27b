# SPDX-License-Identifier: GPL-3.0-or-later
"""Save Report: units, names and dates, pictures, several objects, formats, and what a page looks like on paper."""

import base64
import csv
import datetime
import io
import json
import re
import struct
import zlib

import bpy
import numpy as np
import pytest

import addon
from addon.files import file_io
from addon.operators.report import TOLVOL_OT_save_report
from addon.proof import verdict
from addon.reference import snapshots
from addon.shared.proof import deviation, deviation_drawings, deviation_pictures, deviation_units, measure
from addon.shared.proof.certify import certify
from addon.units import chosen_unit
from scenes import activate, add_object, sheet_arrays, torus
from test_report import Page, lifted_sheet, measured, step

pytestmark = pytest.mark.usefixtures("measured_once")
save_report = bpy.ops.tolvol.save_report


def saved(tmp_path, name="r.json", **options):
    path = tmp_path / name
    assert save_report(filepath=str(path), **options) == {"FINISHED"}
    return json.loads(path.read_text()) if name.endswith(".json") else path.read_text()


def of_units(system, scale, unit):
    settings = bpy.context.scene.unit_settings
    settings.system, settings.scale_length = system, scale
    if unit:
        settings.length_unit = unit


def also(ob, name, height):
    """Adds a square beside `ob` with its own reference, of which a part is lifted then."""
    other = add_object(name, *sheet_arrays(count=6, bumps=0.0))
    other.tolvol.tolerance_mode, other.tolvol.tolerance_length = "LENGTH", 0.05
    activate(other)
    bpy.ops.tolvol.set_reference()
    other.data.vertices[0].co.z += height
    activate(ob)
    other.select_set(True)
    return other


# Units, names and dates ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "system, scale, unit, name, factor",
    [
        ("METRIC", 1.0, "METERS", "m", 1.0),
        ("METRIC", 0.001, "MILLIMETERS", "mm", 1.0),
        ("METRIC", 1.0, "MILLIMETERS", "mm", 1000.0),
        ("METRIC", 0.01, "METERS", "m", 0.01),
        ("METRIC", 0.001, "ADAPTIVE", "mm", 1.0),
        ("METRIC", 1.0, "ADAPTIVE", "m", 1.0),
        ("METRIC", 1e-9, "ADAPTIVE", "µm", 0.001),
        ("IMPERIAL", 0.0254, "INCHES", "in", 1.0),
        ("IMPERIAL", 1.0, "ADAPTIVE", "ft", 1 / 0.3048),
        ("NONE", 1.0, None, "units", 1.0),
    ],
)
def test_unit_is_that_of_the_scene(system, scale, unit, name, factor):
    of_units(system, scale, unit)
    assert chosen_unit(bpy.context, 1.4) == (name, pytest.approx(factor, rel=1e-12))


def test_report_is_in_the_unit_of_the_scene(tmp_path):
    ob = lifted_sheet()
    of_units("METRIC", 1.0, "METERS")
    metres = saved(tmp_path)
    of_units("METRIC", 1.0, "MILLIMETERS")
    run = saved(tmp_path)
    assert (metres["unit"], run["unit"]) == ("m", "mm") and run["verdict"] == metres["verdict"] == "FAIL"
    assert run["tolerance"]["absolute"] == pytest.approx(50) and run["size"] == pytest.approx(1000 * metres["size"])
    assert run["tolerance"]["percent"] == metres["tolerance"]["percent"]
    for way in ("forward", "backward"):
        was, now = metres[way], run[way]
        for key in ("largest", "mean_range", "rms_range"):
            assert now[key] == pytest.approx([1000 * x for x in was[key]])
            # An interval of a converted number holds the true number in spite of the rounding.
            assert now[key][0] <= 1000 * was[key][0] and now[key][1] >= 1000 * was[key][1]
        for key in ("mean", "mean_error", "rms", "spacing"):
            assert now[key] == pytest.approx(1000 * was[key])
        assert now["position"] == pytest.approx([1000 * x for x in was["position"]])
        assert now["histogram"]["edges"] == pytest.approx([1000 * x for x in was["histogram"]["edges"]])
        assert now["histogram"]["shares"] == was["histogram"]["shares"]
        for one, other in zip(was["percentiles"], now["percentiles"]):
            assert other["distance"] == pytest.approx(1000 * one["distance"])
            assert other["range"] == pytest.approx([1000 * x for x in one["range"]])
        for one, other in zip(was["beyond"], now["beyond"]):
            assert other["bound"] == pytest.approx(1000 * one["bound"])
            assert (other["share"], other["range"]) == (one["share"], one["range"])
    assert run["solidity"]["a"]["area"] == pytest.approx(1e6 * metres["solidity"]["a"]["area"])
    assert run["solidity"]["change"] == metres["solidity"]["change"]
    page = Page(saved(tmp_path, "r.html")).text
    assert "50 mm" in page and "Unitmm" in page and f"{ob.name}: " in page


def test_holes_and_labels_are_converted():
    a, b = step()
    run = measured(a, b, tolerance=0.05)
    place = {"perimeter": 2.0, "centre": [1.0, 2.0, 3.0]}
    run["a"]["holes"] = {"closed": 1, "triangles_added": 1, "refused": {"perimeter": 3}, "places": [place]}
    run["labels"] = [
        {"on": "mesh", "position": [1.0, 0.0, 0.0], "distance": 0.5, "side": None, "share_of_tolerance": 2.0}
    ]
    found = deviation_units.in_unit(run, 10.0, "dm")
    assert found["a"]["holes"]["places"] == [{"perimeter": 20.0, "centre": [10.0, 20.0, 30.0]}]
    assert found["a"]["holes"]["refused"] == {"perimeter": 3}
    assert found["labels"][0]["position"] == [10.0, 0.0, 0.0] and found["labels"][0]["distance"] == 5.0
    assert found["labels"][0]["share_of_tolerance"] == 2.0


def test_report_names_file_date_objects_tolerance_and_version(tmp_path):
    ob = lifted_sheet()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "part <3>.blend"))
    before = datetime.datetime.now().astimezone().replace(microsecond=0)
    run = saved(tmp_path)
    when = datetime.datetime.fromisoformat(run["date"])
    assert before <= when <= datetime.datetime.now().astimezone() and when.utcoffset() == before.utcoffset()
    assert run["blend_file"] == "part <3>.blend" and run["tolerance"]["given_in"] == "length"
    page = Page(saved(tmp_path, "r.html")).text
    for text in ("part <3>.blend", str(when.date()), run["version"], "0.05 m = 1.768 % of size, both ways"):
        assert text in page, text
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_percent, ob.tolvol.keep = "PERCENT", 0.2, "ONE"
    page = Page(saved(tmp_path, "r.html")).text
    assert "0.2 % of size = 0.00565685 m, one way" in page
    rows = {row["quantity"]: row["value"] for row in csv.DictReader(io.StringIO(saved(tmp_path, "r.csv")))}
    assert rows["tolerance as text"] == "0.2 % of size = 0.00565685 m" and rows["blend_file"] == "part <3>.blend"


def test_reference_that_is_another_object_is_named(tmp_path):
    torus("Master")
    ob = torus("Copy", seed=2)
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", bpy.data.objects["Master"]
    activate(ob)
    bpy.ops.tolvol.set_reference()
    assert saved(tmp_path)["b"]["name"] == "Master"
    assert "Copy from Master" in Page(saved(tmp_path, "r.html")).text


# Pictures -----------------------------------------------------------------------------------------------------------


def decoded(png):
    """Returns the pixels of a PNG that uses the filter "Up" alone."""
    width, height = struct.unpack(">II", png[16:24])
    data = b"".join(
        png[start + 8 : start + 8 + length]
        for start, length in [
            (m.start() - 4, struct.unpack(">I", png[m.start() - 4 : m.start()])[0]) for m in re.finditer(b"IDAT", png)
        ]
    )
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, 1 + 3 * width)
    assert (rows[:, 0] == 2).all()
    return np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(height, width, 3)


def test_png_holds_the_pixels(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 256, (7, 5, 3), np.uint8)
    path = tmp_path / "p.png"
    path.write_bytes(deviation_pictures.png(pixels))
    image = bpy.data.images.load(str(path))
    found = np.array(image.pixels[:]).reshape(7, 5, 4)[::-1, :, :3]
    assert np.abs(found * 255 - pixels).max() < 0.5
    assert np.array_equal(decoded(path.read_bytes()), pixels)


def test_page_has_pictures_of_both(gl, tmp_path):
    lifted_sheet()
    page = Page(saved(tmp_path, "r.html"))
    assert len(page.images) == 2 and page.text.count("farther away") == 2
    mesh, reference = (decoded(base64.b64decode(image.split(",")[1])) for image in page.images)
    assert not np.array_equal(mesh, reference)
    stripes = np.array(addon.native.module.OUTSIDE_COLOURS)
    for pixels, name in ((mesh, "mesh"), (reference, "reference")):
        drawn = (pixels != 255).any(2)
        striped = (pixels[:, :, None] == stripes).all(3).any(2)
        assert 0.1 < drawn.mean() < 0.9, name
        assert (striped & drawn).sum() > 0.1 * drawn.sum(), name  # a fifth of the sheet is lifted beyond the tolerance


# Several objects ----------------------------------------------------------------------------------------------------


def test_several_objects_are_one_report(tmp_path):
    ob = lifted_sheet()
    good = also(ob, "Good <1>", 0.01)
    run = saved(tmp_path)
    assert [entry["a"]["name"] for entry in run["objects"]] == [ob.name, good.name] and run["not_measured"] == []
    assert [entry["verdict"] for entry in run["objects"]] == ["FAIL", "PASS"] and run["verdict"] == "FAIL"
    assert [verdict.word(one) for one in (ob, good)] == ["FAIL", "PASS"], "the panel says the same"
    assert "date" in run and all(entry["forward"]["samples"] for entry in run["objects"])
    page = Page(saved(tmp_path, "r.html"))
    assert page.tags.count("section") == 2 and page.tags.count("article") == 4 and "Deviation of 2 objects" in page.text
    text = (tmp_path / "r.html").read_text()
    assert page.links == ["#object-0", "#object-1"] and all(f'id="{link[1:]}"' in text for link in page.links)
    names = re.findall(r' id="([^"]+)"', text)
    assert len(set(names)) == len(names)
    overview = page.text[: page.text.index("Reference: ") if "Reference: " in page.text else None]
    assert overview.index("✗ FAIL") < overview.index("✓ PASS") and "Good <1>" in overview
    rows = list(csv.DictReader(io.StringIO(saved(tmp_path, "r.csv"))))
    for entry in run["objects"]:
        found = [row for row in rows if row["object"] == entry["a"]["name"]]
        assert [row["value"] for row in found if row["quantity"] == "verdict"] == [entry["verdict"]]
        largest = [float(row["upper"]) for row in found if row["quantity"] == "largest"]
        assert largest == [entry[way]["largest"][1] for way in ("forward", "backward")]


def test_object_without_a_reference_is_listed_as_not_checked(tmp_path):
    ob = lifted_sheet()
    ob.tolvol.tolerance_length = 0.5
    other = torus("without")
    activate(ob)
    other.select_set(True)
    run = saved(tmp_path)
    assert [entry["a"]["name"] for entry in run["objects"]] == [ob.name] and run["objects"][0]["verdict"] == "PASS"
    assert run["not_measured"] == [{"name": "without", "reason": "Set the reference first"}]
    assert run["verdict"] == verdict.NOT_CHECKED
    page = Page(saved(tmp_path, "r.html")).text
    assert "withoutNOT CHECKED" in page and "without: Set the reference first" in page
    assert "without,,not measured,,Set the reference first" in saved(tmp_path, "r.csv")


def test_report_of_one_object_keeps_its_keys(tmp_path):
    lifted_sheet()
    run = saved(tmp_path)
    assert {"version", "method", "unit", "size", "tolerance", "two_sided", "verdict", "solidity", "forward"} <= set(run)


# What was measured before -------------------------------------------------------------------------------------------


def calls_of_hausdorff(monkeypatch):
    """Returns a list that grows with each search for a largest distance."""
    calls, search = [], addon.native.module.directed_hausdorff
    monkeypatch.setattr(
        addon.native.module,
        "directed_hausdorff",
        lambda *given, **named: calls.append(named) or search(*given, **named),
    )
    return calls


def test_report_takes_over_what_check_has_proved(tmp_path, monkeypatch):
    ob = lifted_sheet()
    bpy.ops.tolvol.check()
    calls = calls_of_hausdorff(monkeypatch)
    run = saved(tmp_path)
    assert not calls
    assert run["forward"]["largest"][1] == ob.tolvol.measurement.forward
    # A change of one vertex, or of the tolerance to one that the interval has not decided, is measured.
    ob.data.vertices[0].co.z += 1.0
    ob.data.update()
    moved = saved(tmp_path)
    assert calls and moved["forward"]["largest"][0] > 0.9
    assert moved["solidity"]["a"]["area"] > run["solidity"]["a"]["area"]


@pytest.mark.parametrize("polygons", ["triangles", "quads"])
def test_a_decimation_is_measured_once_each_way_for_its_report_and_its_file_too(tmp_path, monkeypatch, polygons):
    ob = torus("ring")
    if polygons == "triangles":
        ob.modifiers.new("triangles", "TRIANGULATE")
        bpy.ops.object.modifier_apply(modifier="triangles")
    calls = calls_of_hausdorff(monkeypatch)
    bpy.ops.tolvol.decimate(tolerance_mode="PERCENT", tolerance_percent=0.5)
    assert [named["bound"] for named in calls] == [ob.tolvol.measurement.tolerance] * 2
    run = saved(tmp_path)
    assert run["forward"]["largest"][1] == ob.tolvol.measurement.forward
    surface, reference = snapshots.surface_of(ob), snapshots.reference_of(ob)
    on = surface.world()[surface.arrays.triangles[run["forward"]["triangle"]]]
    point = np.array(run["forward"]["position"])
    assert measure.sampled_distance(point[None], (on, np.array([[0, 1, 2]]))) < 1e-6
    calls.clear()
    file_io.write_file(tmp_path / "ring.ply", [ob], tmp_path)
    [stored] = [snapshots.surface_of(one) for one in file_io.read_file(tmp_path / "ring.ply").objects]
    certified = certify(stored, reference, ob.tolvol.measurement.tolerance, again=False)
    assert not calls
    assert certified["forward"][1] == ob.tolvol.measurement.forward


# The format in the dialog -------------------------------------------------------------------------------------------


class Dialog:
    """Stands for the operator while the file browser calls check()."""

    def __init__(self, filepath):
        self.filepath, self.format, self._named_for = filepath, "HTML", "HTML"

    def check(self, **changes):
        for name, value in changes.items():
            setattr(self, name, value)
        return TOLVOL_OT_save_report.check(self, bpy.context)


def test_format_and_ending_agree():
    dialog = Dialog("/tmp/part deviation.html")
    assert not dialog.check()
    assert dialog.check(format="CSV") and dialog.filepath == "/tmp/part deviation.csv"
    assert dialog.check(format="JSON") and dialog.filepath == "/tmp/part deviation.json"
    # A typed ending wins.
    assert dialog.check(filepath="/tmp/other.HTML") and dialog.format == "HTML" and dialog.filepath == "/tmp/other.HTML"
    assert dialog.check(filepath="/tmp/other.csv") and dialog.format == "CSV"
    # What is no ending stays part of the name.
    assert dialog.check(filepath="/tmp/version 1.2") and dialog.filepath == "/tmp/version 1.2.csv"
    assert dialog.check(format="HTML") and dialog.filepath == "/tmp/version 1.2.html"
    assert dialog.check(filepath="/tmp/note.txt") and dialog.filepath == "/tmp/note.txt.html"
    assert not dialog.check(filepath="/tmp/x.html")
    # The name was cleared.
    assert not dialog.check(filepath="/tmp/reports/") and dialog.filepath == "/tmp/reports/"


# What the page looks like -------------------------------------------------------------------------------------------


def boxes(svg):
    """Returns (left, top, right, bottom) of the texts of a drawing, of letters as wide as in most fonts."""
    for x, y, anchor, text in re.findall(r'<text x="([-\d.]+)" y="([-\d.]+)" text-anchor="(\w+)">([^<]*)</text>', svg):
        width = 6.5 * len(text.replace("&#160;", " ").replace("&nbsp;", " "))
        left = float(x) - width * {"start": 0, "middle": 0.5, "end": 1}[anchor]
        yield left, float(y) - 10, left + width, float(y) + 2


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1.0, 123.456, 1e7])
@pytest.mark.parametrize("tolerance", [1e-4, 0.02, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("signed", [False, True])
def test_no_text_of_a_histogram_is_over_another(scale, tolerance, signed):
    top = max(1.0, tolerance)
    edges = np.linspace(-top if signed else 0.0, top, 31) * scale
    run = {
        "tolerance": {"absolute": tolerance * scale},
        "forward": {"histogram": {"edges": edges.tolist(), "shares": [1 / 30] * 30}, "sides": signed},
    }
    svg = deviation_drawings.histogram(run, "forward", 1 / 30, "forward", "distance in mm")
    found = [*boxes(svg)]
    assert len(found) >= 8
    for i, (left, above, right, below) in enumerate(found):
        assert left >= 0 and right <= 400, found[i]
        for other in found[i + 1 :]:
            assert right <= other[0] or other[2] <= left or below <= other[1] or other[3] <= above, (found[i], other)


@pytest.mark.parametrize("reach", [1e-12, 0.05, 123456.7])
@pytest.mark.parametrize("signed", [False, True])
def test_no_text_of_a_legend_is_over_another(reach, signed):
    picture = deviation_pictures.Picture("", b"", reach, signed)
    found = [*boxes(deviation_drawings.legend(picture, "units", "p"))]
    for i, (left, above, right, below) in enumerate(found):
        assert left >= 0 and right <= 400
        for other in found[i + 1 :]:
            assert right <= other[0] or other[2] <= left or below <= other[1] or other[3] <= above, (found[i], other)


def test_page_is_made_for_paper_and_for_a_telephone():
    a, b = step()
    text = deviation.deviation_page.page(measured(a, b, tolerance=0.05))
    assert "@page { size: A4" in text and "print-color-adjust: exact" in text and "break-inside: avoid" in text
    assert "minmax(min(31rem, 100%), 1fr)" in text and 'name="viewport"' in text
    # A table that is wider than the screen scrolls by itself.
    assert text.count("<table>") == text.count('<div class="table"><table>')
