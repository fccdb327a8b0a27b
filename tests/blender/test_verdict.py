# SPDX-License-Identifier: GPL-3.0-or-later
"""There is one verdict, and everything that is shown says the same."""

import ast
import csv
import io
import json
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from addon import units, wrapping
from addon.mesh import mesh_io
from addon.panels import deviation
from addon.proof import verdict
from addon.proof.verdict import FAIL, NOT_CHECKED, PASS, Interval, Verdict
from addon.shared.numbers import NO_BREAK
from addon.shared.proof import report
from scenes import sheet, torus

ROOT = Path(__file__).resolve().parents[2]


def judged(forward, backward, tolerance=1.0, **options):
    return Verdict(tolerance, Interval(*forward), Interval(*backward), **options)


@pytest.mark.parametrize(
    ("forward", "backward", "both", "one", "ways"),
    (
        ((0.8, 0.9), (0.7, 1.0), PASS, PASS, ("both ways, proved", "one way, proved")),
        ((0.8, 0.9), (1.1, 1.2), FAIL, PASS, ("the reference", "one way, proved")),
        ((1.1, 1.2), (0.8, 0.9), FAIL, FAIL, ("the mesh", "the mesh")),
        ((1.1, 1.2), (1.1, 1.2), FAIL, FAIL, ("both ways", "one way")),
        ((0.9, 1.0 + 1e-15), (0.8, 0.9), FAIL, FAIL, ("the mesh", "the mesh")),  # not decided
    ),
)
def test_the_word_is_about_the_directions_that_have_to_be_kept(forward, backward, both, one, ways):
    found = judged(forward, backward), judged(forward, backward, two_sided=False)
    assert [verdict.word for verdict in found] == [both, one]
    assert tuple(verdict.ways for verdict in found) == ways


@pytest.mark.parametrize(
    ("largest", "shown", "margin"),
    (
        (0.98765, "98.8 %", "1.2 %"),
        (0.998051, "99.9 %", "0.1 %"),
        (0.99951, "100 %", "<0.1 %"),
        (0.500000015, "50.0 %", "50.0 %"),
        (1.23451, "124 %", "24 %"),
        (1.003541, "100.36 %", "0.36 %"),
        (10.23, "1,030 %", "930 %"),
    ),
)
def test_margin_and_largest_distance_make_100_percent(largest, shown, margin):
    assert report.percent(largest, 1) == shown
    assert judged((0, largest), (0, 0)).margin_percent() == margin


def test_the_margin_never_looks_better_than_it_is():
    assert judged((0, 0.5), (0, 0.98765), two_sided=False).margin_percent() == "50.0 %"
    assert judged((0, 1), (0, 1)).margin_percent() == "0 %"
    assert judged((0, 0), (0, 0)).margin_percent() == "100 %"
    assert judged((1, 1.5), (0, 0)).margin == -0.5
    assert judged((1.2, 1.5), (0, 0)).surely_beyond and not judged((0.9, 1.5), (0, 0)).surely_beyond
    assert judged((0, 0), (1.2, 1.5)).surely_beyond
    assert not judged((0, 0), (1.2, 1.5), two_sided=False).surely_beyond


def shifted(length=0.1):
    """A sheet that was moved up by `length` after its reference was set; a part of the reference is not there any more."""
    ob = sheet(bumps=0.0)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for vertex in ob.data.vertices:
        vertex.co.z += length
    ob.data.update()
    bpy.context.view_layer.update()
    ob.tolvol.tolerance_mode = "LENGTH"
    return ob


@pytest.mark.usefixtures("measured_once")
@pytest.mark.parametrize(("tolerance", "word"), ((0.2, PASS), (0.05, FAIL)))
def test_check_report_and_select_outside_say_the_same(tolerance, word, tmp_path, capfd):
    ob = shifted()
    ob.tolvol.tolerance_length = tolerance
    assert verdict.word(ob) == NOT_CHECKED
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    assert f"{word}: " in capfd.readouterr().out and verdict.word(ob) == word
    for extension in ("json", "csv", "html"):
        assert bpy.ops.tolvol.save_report(filepath=str(tmp_path / f"report.{extension}")) == {"FINISHED"}
        assert f"/report.{extension}: {word}" in capfd.readouterr().out
    assert json.loads((tmp_path / "report.json").read_text())["verdict"] == word
    rows = list(csv.reader(io.StringIO((tmp_path / "report.csv").read_text())))
    assert ["", "verdict", "", word, "", ""] in rows
    page = (tmp_path / "report.html").read_text()
    assert f"{word}. " in page and {PASS: FAIL, FAIL: PASS}[word] not in page
    ob.data.vertices[0].co.z += 1e-6
    ob.data.update()
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED  # What is known is about another state of the mesh.
    assert bpy.ops.tolvol.select_outside() == {"FINISHED" if word == FAIL else "CANCELLED"}
    assert word in capfd.readouterr().out
    if word == FAIL:
        assert ob.mode == "EDIT" and verdict.word(ob) == NOT_CHECKED
        bpy.ops.object.mode_set(mode="OBJECT")
    assert verdict.word(ob) == word  # Select Outside has measured both ways.


@pytest.mark.usefixtures("measured_once")
def test_one_way_is_enough_only_if_it_was_asked_for(tmp_path, capfd):
    ob = sheet(bumps=0.0)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    mesh_io.select_faces(ob.data, np.arange(len(ob.data.polygons)) < 200)
    bpy.context.tool_settings.mesh_select_mode = (False, False, True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="FACE")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(ob.data.polygons) == 700
    said = {}
    for keep in ("BOTH", "ONE"):
        ob.tolvol.keep = keep
        assert bpy.ops.tolvol.check() == {"FINISHED"}
        assert bpy.ops.tolvol.save_report(filepath=str(tmp_path / f"{keep}.json")) == {"FINISHED"}
        stored = json.loads((tmp_path / f"{keep}.json").read_text())
        said[keep] = verdict.word(ob), stored["verdict"], stored["two_sided"]
    assert said == {"BOTH": (FAIL, FAIL, True), "ONE": (PASS, PASS, False)}
    # No new measurement is needed to change the mind.
    ob.tolvol.keep = "BOTH"
    assert verdict.word(ob) == FAIL
    capfd.readouterr()
    assert bpy.ops.tolvol.select_outside() == {"CANCELLED"}
    assert "No face of the mesh is outside. FAIL" in capfd.readouterr().out and ob.mode == "OBJECT"


def test_against_a_reference_that_is_out_of_date_nothing_is_known(tmp_path):
    other, ob = torus("other"), torus()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and verdict.word(ob) == PASS
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", other
    assert verdict.of(ob) is None and deviation.verdicts([ob]) == [("torus", NOT_CHECKED, None)]
    why = "another kind of reference was chosen. Replace the reference, or choose the previous one again"
    assert deviation._why_not_checked(ob) == f"The reference is out of date: {why}"
    good = torus("good")
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    ob.select_set(True)
    assert bpy.ops.tolvol.save_report(filepath=str(tmp_path / "r.json")) == {"FINISHED"}
    document = json.loads((tmp_path / "r.json").read_text())
    assert [run["a"]["name"] for run in document["objects"]] == [good.name] and document["verdict"] == NOT_CHECKED
    [unknown] = document["not_measured"]
    assert unknown["name"] == "torus" and unknown["reason"].startswith("The reference is out of date: another kind of")
    ob.tolvol.reference_kind = "SELF"
    assert verdict.word(ob) == PASS, "the previous reference was chosen again"


def test_a_mesh_that_is_its_own_reference_needs_no_measurement():
    ob = torus()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    assert verdict.word(ob) == PASS and verdict.of(ob).forward.upper == verdict.of(ob).backward.upper == 0
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and verdict.of(ob).largest > 0
    assert bpy.ops.tolvol.restore_original() == {"FINISHED"}
    assert verdict.word(ob) == PASS and verdict.of(ob).largest == 0
    ob.data.vertices[0].co.z += 1e-3
    ob.data.update()
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED
    # Another object's mesh lies at its own place.
    scan = torus("scan")
    scan.location.x = 1
    same = torus("same")
    same.tolvol.reference_kind, same.tolvol.reference_object = "OBJECT", scan
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    assert verdict.word(same) == NOT_CHECKED


def test_operations_begin_their_message_with_the_word(capfd):
    ob = torus()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    assert "PASS: 2,304 -> " in capfd.readouterr().out
    assert bpy.ops.tolvol.smooth() == {"FINISHED"}
    assert "PASS: " in capfd.readouterr().out and verdict.word(ob) == PASS


def test_an_operation_gives_its_own_verdict_where_a_panel_has_shown_the_former_one(capfd):
    ob = torus()
    assert bpy.ops.tolvol.decimate(tolerance_percent=0.5) == {"FINISHED"}
    bpy.context.view_layer.update()
    assert verdict.word(ob) == PASS  # as a panel that is drawn
    capfd.readouterr()
    assert bpy.ops.tolvol.decimate(tolerance_percent=2) == {"FINISHED"}
    assert f"{PASS}: " in capfd.readouterr().out


def test_a_row_of_numbers_has_a_text_that_fits_the_sidebar():
    # In Blender without a window the scale is 0.
    styles = bpy.context.preferences.ui_styles
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1), ui_styles=styles)

    def shown(width):
        context = SimpleNamespace(region=SimpleNamespace(width=width), preferences=preferences)
        return wrapping.fitting(context, *texts, share=0.62)

    texts = deviation._both("0.102 mm", "1.31 %")
    assert texts == ["0.102 mm  1.31 % of tolerance", "0.102 mm  1.31 %", "0.102 mm 1.31 %", "1.31 %"]
    # The sidebar is 220 pixels wide at first, where Blender would cut off the longest text.
    assert shown(400) == texts[0] and shown(220) not in texts[:2] and shown(150) == texts[3]


@pytest.mark.parametrize(
    ("system", "text"), (("METRIC", "0.00339 µm"), ("IMPERIAL", "0.000133 thou"), ("NONE", "3.39e-09"))
)
def test_a_length_that_blender_rounds_to_0_keeps_its_digits_and_its_unit(system, text):
    bpy.context.scene.unit_settings.system = system
    assert units.length(bpy.context, 3.39e-9).replace(NO_BREAK, " ") == text


def test_the_list_of_the_selected_objects_has_their_verdicts_and_what_fails_first():
    objects = [shifted(), torus("whole"), torus("another"), sheet("unknown")]
    objects[0].tolvol.tolerance_length = 0.05
    for ob in objects[1:]:
        bpy.context.view_layer.objects.active = ob
        assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    objects[3].data.vertices[0].co.z += 1
    objects[3].data.update()
    for ob in objects[:3]:
        bpy.context.view_layer.objects.active = ob
        assert bpy.ops.tolvol.check() == {"FINISHED"}
    rows = deviation.verdicts(objects)
    assert [row[:2] for row in rows] == [
        ("sheet", FAIL),
        ("unknown", NOT_CHECKED),
        ("another", PASS),
        ("whole", PASS),
    ]
    assert [row[2] for row in rows] == ["200 %", None, "almost 0", "almost 0"]
    assert verdict.together(word for _, word, _ in rows) == FAIL
    assert verdict.together(word for _, word, _ in rows[1:]) == NOT_CHECKED
    assert verdict.together(word for _, word, _ in rows[2:]) == PASS


# Comparisons with a tolerance that decide something else: (file, a part of the line).
_OTHERS = {
    ("addon/shared/proof/certify.py", "Verdict.INSIDE"),  # the native check of single triangles
    ("addon/proof/verdict.py", "_MOST"),  # whether a number in a damaged file can be a distance
    ("addon/overlay/field.py", "finest"),  # whether colours can show the tolerance
    ("addon/overlay/scale.py", "self.tolerance"),  # the shares in the legend of the colours, which prove nothing
    ("addon/shared/proof/deviation_drawings.py", "abs(lower)"),  # the bars of the histogram that are striped
    (
        "addon/operators/fit_modifier.py",
        "largest > self.tolerance",
    ),  # where sampling ends; the proof decides afterwards
    ("addon/proof/regions.py", "high > tolerance"),  # which pieces of faces that have failed make a region
    ("addon/estimate/curve.py", ""),  # the order of tolerances on a curve
    ("addon/shared/command/arguments.py", "tolerance > size"),  # an argument that makes no sense
    ("addon/shared/command/file_report.py", "left <= target"),  # numbers of triangles
    ("addon/shared/command/decimate.py", "tolerance <= found[i - 1]"),  # the order of the levels
}


def test_nothing_else_compares_a_distance_with_the_tolerance():
    found = set()
    for path in [*ROOT.glob("addon/**/*.py"), *ROOT.glob("blender_scripts/*.py")]:
        name = path.relative_to(ROOT).as_posix()
        if name == "addon/shared/proof/verdict.py":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Compare):
                continue
            ordered = any(isinstance(op, (ast.Lt, ast.LtE, ast.Gt, ast.GtE)) for op in node.ops)
            text = ast.unparse(node)
            about = any(word in text for word in ("tolerance", "bound", ".upper", ".lower", "forward", "backward"))
            if ordered and about and not any(name == other and part in text for other, part in _OTHERS):
                found.add((name, text))
    assert not found


def test_a_measurement_against_the_own_reference_says_nothing_about_another_with_the_same_shape():
    ob = torus("scan")
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    copy = ob.copy()
    copy.data = ob.data.copy()
    bpy.context.collection.objects.link(copy)
    ob.location.x += 1
    bpy.context.view_layer.update()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and verdict.word(ob) == PASS
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", copy
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    assert verdict.word(ob) == NOT_CHECKED
    bpy.ops.tolvol.check()
    assert verdict.word(ob) == FAIL


@pytest.mark.parametrize("axis", range(3))
def test_an_object_that_is_stretched_along_any_axis_is_not_checked(axis):
    ob = sheet(count=6, bumps=0.0)
    ob.scale = (1000, 1, 1)
    bpy.context.view_layer.update()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for vertex in ob.data.vertices:
        vertex.co.z += 0.04
    ob.data.update()
    bpy.ops.tolvol.check()
    assert verdict.word(ob) == PASS
    ob.rotation_euler.z = 1
    bpy.context.view_layer.update()
    assert verdict.word(ob) == PASS
    ob.scale[axis] *= 1.3
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED


def test_a_change_of_an_object_that_no_view_shows_counts():
    ob = torus()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and verdict.word(ob) == PASS
    ob.hide_viewport = True
    bpy.context.view_layer.update()
    for vertex in ob.data.vertices:
        vertex.co.z += 1
    ob.data.update()
    bpy.context.view_layer.update()
    assert verdict.word(ob) == NOT_CHECKED
