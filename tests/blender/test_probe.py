# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe reads exact distances at single points, and its labels are kept, saved, and known to be out of date."""

import csv
import io
import json

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh import mesh_io
from addon.operators import probe as operators
from addon.proof import labels, probing, verdict
from addon.reference import measurements
from scenes import activate, add_object, sheet, torus, world_triangles


def with_reference(ob):
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    return ob


def changed(ob):
    ob.data.update()
    bpy.context.view_layer.update()
    return ob


def lifted(height=0.1, **options):
    """A flat sheet that was lifted after its reference was set."""
    ob = with_reference(sheet(bumps=0.0, **options))
    for vertex in ob.data.vertices:
        vertex.co.z += height
    return changed(ob)


def probe(ob, on_reference=False):
    source = probing.Source(ob, on_reference)
    return probing.Probe(source, source.look_up(1, None), ob)


def scaled_torus(factor):
    ob = with_reference(torus(noise=0.0))
    ob.data.transform(Matrix.Scale(factor, 4))
    return changed(ob)


def add(position, **options):
    assert bpy.ops.tolvol.add_label(position=position, **options) == {"FINISHED"}
    ob = bpy.context.object
    return ob.tolvol.labels[-1]


# Readings ---------------------------------------------------------------------------------------------------------------


def test_a_ray_reads_the_exact_distance_where_it_meets_the_mesh():
    ob = lifted()
    height = float(np.float32(0.1))
    reading = probe(ob).along((0.3, -0.2, 5), (0, 0, -1))
    assert reading.position == pytest.approx((0.3, -0.2, height), abs=1e-7) and reading.distance == height
    assert reading.side == "" and not reading.on_reference and reading.share == 1  # An open reference has no sides.
    assert probe(ob).along((3, 0, 5), (0, 0, -1)) is None and probe(ob).along((0, 0, 5), (0, 0, 1)) is None


def test_an_untouched_mesh_deviates_by_nothing_at_any_point():
    """A point in single precision would be up to 1e-7 beside its face."""
    ob = with_reference(torus(matrix=Matrix.Translation((3, 1, 2)) @ Matrix.Rotation(1, 4, (1, 2, 3))))
    found, rng = probe(ob), np.random.default_rng(1)
    hits = 0
    for direction in rng.normal(size=(100, 3)):
        reading = found.along(np.array([3, 1, 2]) - 9 * direction / np.linalg.norm(direction), direction)
        if reading is not None:
            hits += 1
            assert reading.distance == 0 and reading.side == "" and reading.within(0)
    assert hits > 25


@pytest.mark.parametrize("matrix", (Matrix(), Matrix.Diagonal((-2, 1, 3, 1)) @ Matrix.Rotation(0.5, 4, "X")))
def test_readings_are_the_distances_of_their_points_whatever_the_matrix(matrix):
    ob = torus(matrix=matrix)
    with_reference(ob)
    reference = world_triangles(ob)
    ob.data.transform(Matrix.Translation((0.05, 0, 0)))
    found, rng, own = probe(changed(ob)), np.random.default_rng(2), world_triangles(ob)
    volume, now = (native.module.ToleranceVolume(*surface, 0.1) for surface in (reference, own))
    hits = 0
    for origin, target in zip(rng.normal(size=(60, 3)) * 9, rng.uniform(-0.7, 0.7, (60, 3))):
        reading = found.along(origin, target - origin)
        if reading is None:
            continue
        hits += 1
        point = reading.position[None]
        assert now.distance(point)[0] < 1e-12, "the point is on the mesh"
        assert reading.distance == pytest.approx(volume.distance(point)[0], abs=1e-12)
        away = np.cross(reading.position - origin, target - origin)
        assert np.linalg.norm(away) / np.linalg.norm(target - origin) < 1e-5, "the point is on the ray"
    assert hits > 20


@pytest.mark.parametrize(("factor", "side"), ((1.05, probing.OUTSIDE), (0.95, probing.INSIDE)))
def test_the_side_of_a_closed_reference(factor, side):
    ob = scaled_torus(factor)
    reading = probe(ob).along((1.25 * factor + 3, 0, 0), (-1, 0, 0))
    assert reading.side == side and reading.distance == pytest.approx(1.25 * 0.05, rel=0.02)
    # Seen from the reference, the mesh is on the other side.
    reading = probe(ob, True).along((4, 0, 0), (-1, 0, 0))
    assert reading.on_reference and reading.position[0] == pytest.approx(1.25, abs=1e-3)
    assert reading.side == {"outside": probing.INSIDE, "inside": probing.OUTSIDE}[side]


def test_the_nearest_point_is_read_where_no_ray_is_given():
    ob = lifted()
    found = probe(ob)
    for position, nearest in (((0.31, 0.2, 3), (0.31, 0.2)), ((5, 0.2, 0), (1, 0.2)), ((5, -7, 0), (1, -1))):
        assert found.nearest_to(position).position == pytest.approx((*nearest, 0.1), abs=1e-6)


def test_the_share_of_the_tolerance_is_the_least_weight_of_the_face():
    ob = lifted(count=2)
    group = ob.vertex_groups.new(name="soft")
    group.add(range(9), 1.0, "REPLACE")
    group.add([0], 0.25, "REPLACE")
    assert probe(ob).nearest_to((-0.9, -0.9, 0)).share == 1
    ob.tolvol.vertex_group = "soft"
    assert probe(ob).nearest_to((-0.9, -0.9, 0)).share == 0.25 and probe(ob).nearest_to((0.9, 0.9, 0)).share == 1
    said = operators.described(bpy.context, ob, probe(ob).nearest_to((-0.9, -0.9, 0)))
    assert said[2] == "Decimate may use 25 % of it here, by the group of Protect"
    ob.tolvol.invert_vertex_group = True
    assert probe(ob).nearest_to((-0.9, -0.9, 0)).share == 0
    ob.tolvol.vertex_group = "gone"
    assert probe(ob).nearest_to((-0.9, -0.9, 0)).share == 1


def test_readings_are_said_with_side_share_and_tolerance():
    ob = scaled_torus(1.05)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.1
    reading = probe(ob).along((4, 0, 0), (-1, 0, 0))
    said = [line.replace("\u00a0", " ") for line in operators.described(bpy.context, ob, reading)]
    assert said == ["6.25 cm outside, 62.5 % of the tolerance", "Tolerance 10 cm"]
    ob.tolvol.tolerance_length = 0.05
    said = [line.replace("\u00a0", " ") for line in operators.described(bpy.context, ob, reading)]
    assert said == ["6.25 cm outside, 125 % of the tolerance", "Tolerance 5 cm: beyond"]


def test_the_reference_is_read_where_it_is_coloured(chosen_preferences):
    ob = lifted()
    assert not operators.reads_reference(bpy.context, ob) and operators.what(bpy.context, ob) == "sheet"
    ob.tolvol.deviation_surface = "REFERENCE"
    assert operators.reads_reference(bpy.context, ob)
    assert operators.what(bpy.context, ob) == "Reference of sheet"
    reading = probe(ob, True).along((0.3, -0.2, 5), (0, 0, -1))
    assert reading.position[2] == 0 and "on the reference, " in operators.described(bpy.context, ob, reading)[0]
    ob.tolvol.show_deviation = False
    assert not operators.reads_reference(bpy.context, ob)
    ob.tolvol.show_deviation = True
    chosen_preferences.use_gl = False
    assert not operators.reads_reference(bpy.context, ob), "nothing is coloured"


def move(ob):
    ob.location.x = 1


def edit(ob):
    ob.data.vertices[3].co.z += 0.01


def edit_mode(_ob):
    bpy.ops.object.mode_set(mode="EDIT")


def other_group(ob):
    ob.tolvol.vertex_group = "soft"


@pytest.mark.parametrize("change", (move, edit, edit_mode, other_group))
def test_the_source_of_a_probe_knows_when_it_no_longer_fits(change):
    ob = lifted()
    found = probing.Source(ob, False)
    ob.tolvol.tolerance_percent = 3  # Distances do not depend on it.
    assert found.fits(ob)
    change(ob)
    assert not found.fits(changed(ob))


def test_the_mouse_and_a_reference_are_needed():
    ob = sheet()
    with pytest.raises(RuntimeError, match="Set the reference first"):
        bpy.ops.tolvol.probe()
    with pytest.raises(RuntimeError, match="Set the reference first"):
        bpy.ops.tolvol.add_label()
    with_reference(ob)
    with pytest.raises(RuntimeError, match=r"needs the mouse.*A script uses Add Label"):
        bpy.ops.tolvol.probe("EXEC_DEFAULT")


# Labels -----------------------------------------------------------------------------------------------------------------


def test_labels_are_saved_with_the_file_to_the_last_digit(tmp_path):
    ob = lifted(1 / 3)
    label = add((0.3, 0.2, 0))
    distance = label.distance
    assert distance == float(np.float32(1 / 3)) and labels.current(ob, label)
    add((-0.5, 0, 0), on_reference=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    ob = bpy.data.objects["sheet"]
    first, second = ob.tolvol.labels
    assert first.distance == distance and labels.reading(ob, first).position[:2] == pytest.approx((0.3, 0.2), abs=1e-6)
    assert second.on_reference and labels.reading(ob, second).position == pytest.approx((-0.5, 0, 0), abs=1e-6)
    assert all(labels.current(ob, label) for label in ob.tolvol.labels) and ob.tolvol.label_index == 1


def test_adding_and_removing_a_label_is_one_undo_step_each():
    lifted()
    bpy.ops.ed.undo_push(message="start")
    for x in (0.1, 0.2, 0.3):
        assert bpy.ops.tolvol.add_label("EXEC_DEFAULT", True, position=(x, 0, 0)) == {"FINISHED"}

    def left():
        settings = bpy.data.objects["sheet"].tolvol
        return [round(label.place[0], 3) for label in settings.labels], settings.label_index

    assert left() == ([0.1, 0.2, 0.3], 2)
    bpy.context.object.tolvol.label_index = 1
    assert bpy.ops.tolvol.remove_label("EXEC_DEFAULT", True) == {"FINISHED"}
    assert left() == ([0.1, 0.3], 1)
    bpy.ops.ed.undo()
    assert left()[0] == [0.1, 0.2, 0.3]
    bpy.ops.ed.redo()
    assert bpy.ops.tolvol.remove_label("EXEC_DEFAULT", True, everything=True) == {"FINISHED"}
    assert left() == ([], 0)
    bpy.ops.ed.undo()
    assert left()[0] == [0.1, 0.3]
    bpy.context.object.tolvol.label_index = 99  # a script, or a damaged file
    assert bpy.ops.tolvol.remove_label() == {"FINISHED"} and left() == ([0.1], 0)
    assert bpy.ops.tolvol.remove_label() == {"FINISHED"}
    with pytest.raises(RuntimeError, match="There are no labels"):
        bpy.ops.tolvol.remove_label()


def other_reference(ob):
    ob.tolvol.reference_kind = "OBJECT"


def scale(ob):
    ob.scale = (2, 2, 2)


def no_reference(_ob):
    bpy.ops.tolvol.clear_reference()


def damage(ob):
    ob.tolvol.labels[0].distance_digits = "?"


@pytest.mark.parametrize("change", (edit, edit_mode, other_reference, scale, no_reference, damage))
def test_labels_are_out_of_date_after_a_change(change):
    ob = lifted()
    label = add((0.3, 0.2, 0))
    assert labels.current(ob, label)
    change(ob)
    assert not labels.current(changed(ob), label)


def test_labels_follow_an_object_whose_reference_moves_along():
    ob = lifted()
    label = add((0.3, 0.2, 0))
    ob.matrix_world = Matrix.Translation((5, 0, 0)) @ Matrix.Rotation(np.pi / 2, 4, "Z")
    changed(ob)
    assert labels.current(ob, label)
    assert labels.reading(ob, label).position == pytest.approx((4.8, 0.3, 0.1), abs=1e-5)


def test_labels_from_the_reference_of_another_object_end_when_either_moves():
    other = sheet("other", bumps=0.0)
    ob = sheet(bumps=0.0, matrix=Matrix.Translation((0, 0, 0.2)))
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", other
    with_reference(ob)
    label = add((0.3, 0.2, 0.2))
    assert label.distance == pytest.approx(0.2) and labels.current(ob, label)
    other.location.x = 3  # The reference stays where it was.
    assert labels.current(changed(ob), label)
    move(ob)
    assert not labels.current(changed(ob), label)


def test_labels_that_are_out_of_date_are_measured_again_where_they_were():
    ob = lifted()
    kept = [add((0.3, 0.2, 0)), add((-0.5, 0, 0), on_reference=True)]
    assert [round(label.distance, 6) for label in kept] == [0.1, 0.1]
    with pytest.raises(RuntimeError, match="No label is out of date"):
        bpy.ops.tolvol.renew_labels()
    for vertex in ob.data.vertices:
        vertex.co.z = 0.25
    changed(ob)
    assert not any(labels.current(ob, label) for label in ob.tolvol.labels)
    assert bpy.ops.tolvol.renew_labels() == {"FINISHED"}
    assert [label.distance for label in ob.tolvol.labels] == [0.25, 0.25]
    assert all(labels.current(ob, label) for label in ob.tolvol.labels)
    assert labels.reading(ob, ob.tolvol.labels[0]).position == pytest.approx((0.3, 0.2, 0.25), abs=1e-6)
    assert labels.reading(ob, ob.tolvol.labels[1]).position == pytest.approx((-0.5, 0, 0), abs=1e-6)
    bpy.ops.tolvol.remove_label(everything=True)
    with pytest.raises(RuntimeError, match="There are no labels"):
        bpy.ops.tolvol.renew_labels()


@pytest.mark.usefixtures("measured_once")
def test_labels_are_in_the_report(tmp_path):
    ob = lifted()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.2
    add((0.25, 0.5, 0))
    edit(ob)
    changed(ob)
    add((-0.5, 0, 0), on_reference=True)
    for extension in ("json", "csv", "html"):
        assert bpy.ops.tolvol.save_report(filepath=str(tmp_path / f"report.{extension}")) == {"FINISHED"}
    first, second = json.loads((tmp_path / "report.json").read_text())["labels"]
    assert first["on"] == "mesh" and first["position"] == pytest.approx([0.25, 0.5, 0.1], abs=1e-6)
    assert first["distance"] == float(np.float32(0.1)) and first["side"] is None and not first["current"]
    assert first["share_of_tolerance"] == pytest.approx(0.5) and second["on"] == "reference" and second["current"]
    rows = {row[1]: row[3] for row in csv.reader(io.StringIO((tmp_path / "report.csv").read_text()))}
    assert float(rows["label 1 x"]) == pytest.approx(0.25) and rows["label 2 on"] == "reference"
    page = (tmp_path / "report.html").read_text()
    assert "<h3>Labels</h3>" in page and "50&nbsp;%" in page and page.count("out of date") == 1
    bpy.ops.tolvol.remove_label(everything=True)
    bpy.ops.tolvol.save_report(filepath=str(tmp_path / "report.html"))
    assert "Labels" not in (tmp_path / "report.html").read_text()


def test_the_worst_point_reads_the_largest_distance():
    ob = with_reference(sheet())
    ob.data.vertices[500].co.z += 0.3
    changed(ob)
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    found, reading = verdict.of(ob).forward, probe(ob).nearest_to(ob.data.vertices[500].co)
    assert found.lower <= reading.distance <= found.upper


def test_what_is_on_top_is_not_read():
    ob = lifted()
    ob.modifiers.new("up", "DISPLACE")
    assert probe(changed(ob)).along((0, 0, 5), (0, 0, -1)).distance == float(np.float32(0.1))
    assert operators.what(bpy.context, ob) == "Base mesh of sheet, without its modifiers"
    assert measurements.on_top(ob) == ["modifiers"]


def test_faces_of_any_size_are_read_on_their_triangles():
    """A bent face of five corners: its points are on the triangles that Blender shows and the proof takes."""
    ob = add_object("bent", [(0, 0, 0), (2, 0, 0.3), (3, 2, 0), (1, 3, 0.5), (-1, 2, 0)], [(0, 1, 2, 3, 4)])
    with_reference(ob)
    found, arrays = probe(ob), mesh_io.read_mesh(ob.data)
    assert len(arrays.triangles) == 3
    for corners in arrays.triangles:
        middle = arrays.vertices[corners].mean(0)
        assert found.along((*middle[:2], 9), (0, 0, -1)).distance == 0
    activate(ob)
