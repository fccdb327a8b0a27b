# SPDX-License-Identifier: GPL-3.0-or-later
"""The facts about a surface, what report.py requires of it, and Select Crossing Faces."""

import json
import re
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon.mesh import mesh_io
from addon.panels import deviation, notes
from addon.proof import last_run
from addon.reference import snapshots
from addon.shared.proof import solidity
from addon.shared.surface import joined
from commands import command, save
from drawn import drawn, sidebar
from scenes import activate, add_object, link, sheet, torus, torus_arrays

CUBE = (
    np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32),
    np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]),
)


def facts(*parts, matrix=None):
    """The facts about parts, pairs (vertices, faces), as one object."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    faces = [[vertex + start for vertex in face] for (_, of_part), start in zip(parts, first) for face in of_part]
    ob = add_object("parts", np.concatenate([vertices for vertices, _ in parts]), faces, matrix)
    return solidity.facts(snapshots.surface_of(ob))


def moved(part, by):
    return part[0] + np.float32(by), part[1]


def test_a_cube_is_a_solid():
    found = facts(CUBE)
    assert all(found[name] for name in solidity.REQUIREMENTS) and found["shells"] == 1
    assert found["area"] == pytest.approx(6) and found["volume"] == pytest.approx(1)
    assert solidity.line(found) == "closed, manifold, no crossings: printable"
    assert facts(moved(CUBE, 100), matrix=np.diag([2.0, 1, 3, 1]))["volume"] == pytest.approx(6)


def test_faces_with_vertices_of_their_own_hang_together_by_position():
    vertices, faces = CUBE
    alone = [(vertices[face], [[0, 1, 2, 3]]) for face in faces]
    assert facts(*alone) == facts(CUBE)


def test_holes_are_counted_as_loops():
    vertices, faces = torus_arrays(noise=0)
    found = facts((vertices, np.delete(faces, [0, 300, 301], axis=0)))
    assert (found["closed"], found["boundary_loops"], found["open_edges"]) == (False, 2, 10)
    assert found["manifold"] and found["oriented"] and found["volume"] is None
    assert solidity.line(found) == "not printable: 2 boundary loops"


def test_a_turned_face_is_found():
    vertices, faces = CUBE
    found = facts((vertices, [faces[0][::-1], *faces[1:]]))
    assert (found["oriented"], found["misoriented_edges"], found["volume"]) == (False, 4, None) and found["closed"]


def test_a_solid_that_is_turned_inside_out_is_not_printable(tmp_path):
    vertices, faces = CUBE
    inward = faces[:, ::-1]
    found = facts((vertices, inward))
    assert found["oriented"] and found["volume"] == pytest.approx(-1)
    assert solidity.line(found) == "not printable: faces look inwards"
    assert solidity.line(facts((vertices, inward), matrix=np.diag([2.0, 1, -3, 1]))) == solidity.line(found)
    # A mirror turns no solid inside out, alone or beside another object, and neither does a cavity.
    mirror = np.diag([2.0, 1, -3, 1])
    assert solidity.line(facts(CUBE, matrix=mirror)).endswith(": printable")
    objects = add_object("plain", *moved(CUBE, 5)), add_object("mirrored", *CUBE, mirror)
    found = solidity.facts(joined(snapshots.surface_of(ob) for ob in objects))
    assert found["volume"] == pytest.approx(1 + 6)
    cavity = 0.5 * vertices + np.float32(0.25), inward
    assert solidity.line(facts(CUBE, cavity)).endswith(": printable")
    turned = save(tmp_path / "turned.ply", ("turned", vertices, inward))
    whole = save(tmp_path / "whole.ply", ("whole", *CUBE))
    code, out, err = command("report.py", turned, whole, "--require", "closed,oriented")
    assert code == 3 and "A: not printable: faces look inwards" in out and "B: closed, manifold" in out
    assert err == "--require: A is not oriented (faces look inwards)\n"
    assert command("report.py", turned, whole, "--require", "closed,manifold,uncrossed")[0] == 0
    assert command("report.py", whole, turned, "--require", "oriented")[0] == 0


def test_sheets_that_share_an_edge_or_a_vertex_are_no_manifold():
    at_edge, at_vertex = facts(CUBE, moved(CUBE, [1, 1, 0])), facts(CUBE, moved(CUBE, 1))
    assert (at_edge["non_manifold_edges"], at_edge["non_manifold_vertices"], at_edge["shells"]) == (1, 0, 1)
    assert (at_vertex["non_manifold_edges"], at_vertex["non_manifold_vertices"], at_vertex["shells"]) == (0, 1, 2)
    assert at_vertex["closed"] and not at_vertex["manifold"]
    assert "1 vertex where sheets touch" in solidity.line(at_vertex)


def test_crossing_shells_and_degenerate_triangles_are_counted():
    found = facts(CUBE, moved(CUBE, [0.5, 0.4, 0.3]))
    assert not found["uncrossed"] and found["crossing_pairs"] > 10 and found["shells"] == 2 and found["manifold"]
    apart = facts(CUBE, moved(CUBE, 3))
    assert apart["uncrossed"] and apart["volume"] == pytest.approx(2)
    vertices = np.concatenate([CUBE[0], CUBE[0][:1]])
    sliver = facts((vertices, [*CUBE[1], [0, 8, 1]]))
    assert sliver["degenerate_triangles"] == 1 and sliver["closed"]


def test_the_panel_states_what_became_of_a_decimated_solid():
    ob = torus()
    activate(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    run = json.loads(ob.tolvol.last_run)
    found = run["solidity"]
    assert found["after"] == pytest.approx(solidity.facts(snapshots.surface_of(ob)))
    assert found["before"]["area"] * (1 + found["change"]["area"]) == pytest.approx(found["after"]["area"])
    assert -0.1 < found["change"]["volume"] < 0.1
    _, line = last_run.remembered(ob.tolvol.last_run, bpy.context)
    assert line.startswith("Closed, manifold, no crossings, 1 shell, area ")
    parts = re.fullmatch(
        r".*, area ([\d.]+)\xa0m² \(([+-][\d.]+)\xa0%\), volume ([\d.]+)\xa0m³ \(([+-][\d.]+)\xa0%\)", line
    )
    assert float(parts[1]) == pytest.approx(found["after"]["area"], rel=1e-2)
    assert float(parts[2]) == pytest.approx(100 * found["change"]["area"], rel=1e-2)
    assert float(parts[3]) == pytest.approx(found["after"]["volume"], rel=1e-2)
    assert float(parts[4]) == pytest.approx(100 * found["change"]["volume"], rel=1e-2)
    none = {"area": None, "volume": None}
    holed = found["after"] | {"closed": False, "boundary_loops": 2, "shells": 3, "area": 0.25, "volume": None}
    compared = {"before": found["before"], "after": holed, "change": none}
    bpy.context.scene.unit_settings.system = "NONE"
    assert last_run.facts(compared, bpy.context) == "2 boundary loops, 3 shells (+2), area 0.25"
    bpy.context.scene.unit_settings.system = "METRIC"
    bpy.context.scene.unit_settings.scale_length = 0.001
    assert last_run.facts(compared, bpy.context) == "2 boundary loops, 3 shells (+2), area 0.25\xa0mm²"
    assert ", volume 1e+300" in last_run.facts(compared | {"after": holed | {"volume": 1e300}}, bpy.context)
    assert ", volume 717,274\xa0cm³" in last_run.facts(compared | {"after": holed | {"volume": 717_274e3}}, bpy.context)
    assert ", volume -0.25\xa0mm³" in last_run.facts(compared | {"after": holed | {"volume": -0.25}}, bpy.context)
    assert ", volume 0.5\xa0mm³" in last_run.facts(compared | {"after": holed | {"volume": 0.5}}, bpy.context)


def test_the_command_requires(tmp_path):
    vertices, faces = torus_arrays(noise=0)
    whole = save(tmp_path / "whole.ply", ("torus", vertices, faces))
    holed = save(tmp_path / "holed.ply", ("torus", vertices, faces[1:]))
    words = "closed,manifold,oriented,uncrossed"
    page = tmp_path / "whole.html"
    code, out, err = command("report.py", whole, holed, "--require", words, "--report", page)
    assert (code, err) == (0, "") and "A: closed, manifold, no crossings: printable" in out
    assert "closed, manifold, no crossings: printable" in page.read_text()
    reports = [tmp_path / f"report{extension}" for extension in (".json", ".html", ".csv")]
    asked = [part for path in reports for part in ("--report", path)]
    code, out, err = command("report.py", holed, whole, "--require", words, *asked)
    assert code == 3 and "A is not closed (1 boundary loop)" in err and "B: closed, manifold" in out
    found = json.loads(reports[0].read_text())["solidity"]
    assert (found["a"]["closed"], found["b"]["closed"]) == (False, True)
    assert found["change"]["area"] < 0 and found["change"]["volume"] is None
    assert "not printable: 1 boundary loop" in reports[1].read_text()
    assert ",a boundary_loops,,1,," in reports[2].read_text()
    assert command("report.py", holed, whole, "--require", "manifold,uncrossed")[0] == 0
    assert command("report.py", holed, whole, "--require", "solid")[0] == 2


def test_reports_say_shells_area_and_volume(tmp_path):
    two = np.concatenate([CUBE[0], 2 * CUBE[0] + 3]), np.concatenate([CUBE[1], CUBE[1] + 8])
    one, both = save(tmp_path / "one.ply", ("one", 2 * CUBE[0], CUBE[1])), save(tmp_path / "both.ply", ("both", *two))
    page = tmp_path / "report.html"
    code, out, _ = command("report.py", both, one, "--report", page, "--unit", "mm")
    assert code == 0 and "A: shells 2 (B: 1, +1), area 30 (B: 24, +25 %), volume 9 (B: 8, +12.5 %)\n" in out
    cells = re.findall(r"<t[dh]>(.*?)</t[dh]>", page.read_text())
    start = cells.index("Shells")
    assert cells[start - 4 : start] == ["", "both.ply", "one.ply", "change"]
    assert cells[start : start + 12] == [
        *("Shells", "2", "1", "+1"),
        *("Area in mm&sup2;", "30", "24", "+25\xa0%"),
        *("Volume in mm&sup3;", "9", "8", "+12.5\xa0%"),
    ]
    holed = save(tmp_path / "holed.ply", ("holed", CUBE[0], CUBE[1][1:]))
    code, out, _ = command("report.py", holed, one, "--report", page)
    assert code == 0 and "A: shells 1 (B: 1), area 5 (B: 24, -79.2 %), volume not closed (B: 8)\n" in out
    assert "<td>Area</td>" in page.read_text() and "<td>not closed</td>" in page.read_text()
    code, out, _ = command("report.py", holed, holed, "--report", page)
    assert code == 0 and "A: shells 1 (B: 1), area 5 (B: 5" in out and "volume" not in out
    assert "<td>Area</td>" in page.read_text() and "<td>Volume" not in page.read_text()
    turned = save(tmp_path / "turned.ply", ("turned", CUBE[0], [CUBE[1][0][::-1], *CUBE[1][1:]]))
    code, out, _ = command("report.py", turned, one)
    assert code == 0 and "volume not oriented (B: 8)\n" in out


def test_select_crossing_faces():
    vertices, faces = CUBE
    both = np.concatenate([vertices, vertices * 0.5 + np.float32([0.75, 0.25, 0.25])])
    ob = add_object("cubes", both, [*faces, *(faces + 8)])
    activate(ob)
    bpy.ops.tolvol.select_crossing()
    assert ob.mode == "EDIT" and tuple(bpy.context.tool_settings.mesh_select_mode) == (False, False, True)
    bpy.ops.object.mode_set(mode="OBJECT")
    selected = mesh_io.column(ob.data.polygons, "select", 1, bool)
    at_one = (both[[*faces, *(faces + 8)]][:, :, 0] == 1).all(1)
    assert selected[at_one].all() and selected.sum() == 5, "one face of the first cube, four of the second"
    for whole in (torus(), sheet()):
        activate(whole)
        bpy.ops.tolvol.select_crossing()
        assert whole.mode == "OBJECT"


def test_the_button_has_the_name_of_the_manual():
    activate(torus())
    shown = drawn(deviation.TOLVOL_PT_deviation, sidebar())
    assert shown.buttons["tolvol.select_crossing"] == "Select Crossing Faces"
    manual = Path(__file__).resolve().parents[2] / "docs" / "manual.md"
    assert "*Select Crossing Faces*" in manual.read_text()


def test_more_pairs_than_are_counted_are_at_least_so_many(monkeypatch, capfd):
    monkeypatch.setattr(solidity, "MOST_PAIRS", 10)
    found = facts(CUBE, moved(CUBE, [0.5, 0.4, 0.3]))
    assert found["crossing_pairs"] == 10 and "at least 10 crossing pairs of faces" in solidity.line(found)
    ob = bpy.context.active_object
    bpy.ops.tolvol.decimate(target_triangles=10**6)
    assert json.loads(ob.tolvol.last_run)["crossings"] == {"before": 10, "after": 10}
    assert "at least 10 pairs of faces cross, before at least 10" in capfd.readouterr().out
    bpy.ops.tolvol.select_crossing()
    said = re.search(r"at least (\d+) of \d+ faces cross others", capfd.readouterr().out)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert int(said[1]) == mesh_io.column(ob.data.polygons, "select", 1, bool).sum() > 0


def test_a_motion_with_more_crossing_pairs_than_are_counted_is_refused(monkeypatch, capfd):
    monkeypatch.setattr(solidity, "MOST_PAIRS", 10)
    facts(CUBE, moved(CUBE, [0.5, 0.4, 0.3]))
    with pytest.raises(RuntimeError, match="at least 10 pairs of faces cross, too many to keep others out"):
        bpy.ops.tolvol.smooth(iterations=3)


# After every operation ------------------------------------------------------------------------------------------------


def smooth(ob):
    bpy.ops.tolvol.smooth(iterations=3)


def smooth_in_edit_mode(ob):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.tolvol.smooth(iterations=3)
    assert last_run.shown(ob) == "", "edits that Python does not see may follow"
    bpy.ops.object.mode_set(mode="OBJECT")


def deform(ob):
    cage = link(bpy.data.objects.new("cage", bpy.data.lattices.new("cage")))
    cage.scale = (3, 3, 3)
    cage.data.points[0].co_deform.x += 0.05
    activate(ob)
    bpy.ops.tolvol.deform(lattice=cage.name, mode="PULL_BACK")


def apply_modifier(ob):
    ob.modifiers.new("Smooth", "SMOOTH").iterations = 5
    bpy.ops.tolvol.apply_modifier()


def apply_to_a_new_object(ob):
    ob.modifiers.new("Smooth", "SMOOTH").iterations = 5
    bpy.ops.tolvol.apply_modifier(result="OBJECT")


def fit_modifier(ob):
    ob.modifiers.new("Decimate", "DECIMATE")
    bpy.ops.tolvol.fit_modifier(value=0.8)


OPERATIONS = (smooth, smooth_in_edit_mode, deform, apply_modifier, apply_to_a_new_object, fit_modifier)


@pytest.mark.parametrize("operation", OPERATIONS, ids=lambda operation: operation.__name__)
def test_the_panel_states_what_became_of_the_solid_in_each_operation(operation):
    # One quad is missing, so that a fact differs from what a decimation has said.
    vertices, faces = torus_arrays(around=32, across=16, noise=0.01)
    ob = add_object("torus", vertices, faces, np.diag([2.0, 1, 1, 1]))
    ob.tolvol.tolerance_percent = 3
    bpy.ops.tolvol.decimate(target_triangles=10**6)
    assert "Closed, manifold, no crossings" in noted()[-1]
    holed = add_object("holed", vertices, faces[1:], np.diag([2.0, 1, 1, 1]))
    holed.tolvol.last_run, holed.tolvol.last_run_of = ob.tolvol.last_run, ob.tolvol.last_run_of
    holed.tolvol.tolerance_percent = 3
    before = solidity.facts(snapshots.surface_of(holed))
    operation(holed)
    result = bpy.context.active_object
    after = solidity.facts(snapshots.surface_of(result))
    run = json.loads(last_run.shown(result))
    assert run["solidity"]["before"] == pytest.approx(before) and run["solidity"]["after"] == pytest.approx(after)
    assert run["solidity"]["change"]["area"] == pytest.approx(after["area"] / before["area"] - 1) and after != before
    assert last_run.facts(run["solidity"], bpy.context) in noted()
    # The facts are of this mesh, at this size.
    bpy.ops.object.mode_set(mode="OBJECT")
    result.matrix_world = Matrix.Translation((1, 2, 3)) @ result.matrix_world
    bpy.context.view_layer.update()
    assert last_run.shown(result)
    result.scale *= 1.1
    bpy.context.view_layer.update()
    assert last_run.shown(result) == ""
    result.scale /= 1.1
    bpy.context.view_layer.update()
    assert last_run.shown(result)
    result.data.vertices[0].co.z += 0.01
    result.data.update()
    bpy.context.view_layer.update()
    assert last_run.shown(result) == ""


def noted():
    """Returns the texts of the panel Notes."""
    return [text for text, _ in notes.notes(bpy.context, bpy.context.active_object)[0]]


def test_an_operation_that_makes_a_shape_key_leaves_the_facts_of_the_base_mesh():
    ob = torus(around=32, across=16, noise=0.01)
    bpy.ops.tolvol.smooth(iterations=3)
    before = last_run.shown(ob)
    ob.modifiers.new("Smooth", "SMOOTH").iterations = 5
    bpy.ops.tolvol.apply_modifier(result="SHAPE_KEY")
    assert before and last_run.shown(ob) == before
