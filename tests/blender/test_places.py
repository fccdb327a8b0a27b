# SPDX-License-Identifier: GPL-3.0-or-later
"""Worst Point finds each region beyond the tolerance, or the places nearest to it, and knows when that is out of date."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Quaternion

from addon.mesh import mesh_io
from addon.operators import places as operators
from addon.proof import places, verdict
from addon.reference import snapshots, tolerances
from scenes import activate, add_object, sheet, sheet_arrays, torus

PEAKS = {100: 0.2, 500: 0.3, 501: 0.25, 800: 0.22}  # 500 and 501 are neighbours


def peaked(peaks=PEAKS):
    """A flat sheet in which some vertices were lifted after the reference was set."""
    ob = sheet(bumps=0.0)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for vertex, height in peaks.items():
        ob.data.vertices[vertex].co.z = height
    return changed(ob)


def changed(ob):
    ob.data.update()
    bpy.context.view_layer.update()
    return ob


def area_above(ob, vertices, height):
    """The area, by samples, of what is above a height of the triangles that have one of these vertices."""
    arrays = mesh_io.read_mesh(ob.data)
    corners = arrays.vertices.astype(float)[arrays.triangles[np.isin(arrays.triangles, vertices).any(1)]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    weights = np.random.default_rng(1).dirichlet((1, 1, 1), 20_000)
    return areas @ (corners[:, :, 2] @ weights.T > height).mean(1)


def test_each_region_beyond_is_one_place_with_its_area_and_largest_distance(capfd):
    ob = peaked()
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    out = capfd.readouterr().out
    assert "FAIL: 1 of 6, on the mesh: 30 cm" in out.replace("\u00a0", " ") and verdict.word(ob) == "FAIL"
    found, at, regions = places.shown(ob)
    assert at == 0 and regions == len(found) == 6 and all(place.beyond for place in found)
    uppers = [place.distance.upper for place in found]
    assert uppers == sorted(uppers, reverse=True)
    on_mesh = [place for place in found if not place.on_reference]
    tolerance = tolerances.tolerance_length(ob.tolvol, snapshots.snapshot_size(ob))
    for place, group, height in zip(on_mesh, ((500, 501), (800,), (100,)), (0.3, 0.22, 0.2)):
        assert place.distance.lower <= height + 1e-6 and height - 1e-6 <= place.distance.upper
        assert np.allclose(place.position, ob.data.vertices[group[0]].co)
        assert place.area == pytest.approx(area_above(ob, group, tolerance), rel=0.02)
    # Below each peak a part of the reference is beyond the tolerance, too.
    below = [place for place in found if place.on_reference]
    assert len(below) == 3 and all(place.position[2] == 0 and place.area > 0 for place in below)


def test_the_view_shows_a_place_from_near_although_its_region_is_most_of_the_mesh():
    ob = peaked()
    ob.data.vertices.foreach_set("co", mesh_io.column(ob.data.vertices, "co", 3).ravel() + np.float32(0.2))
    changed(ob)
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    view = SimpleNamespace(view_perspective="PERSP", view_rotation=Quaternion(), lock_rotation=False)
    context = SimpleNamespace(space_data=SimpleNamespace(type="VIEW_3D", region_3d=view), area=None)
    operators._frame(context, ob)
    place, size = places.shown(ob)[0][0], snapshots.snapshot_size(ob)
    assert place.radius > 0.4 * size and view.view_distance == pytest.approx(0.7 * size)
    assert np.allclose(view.view_location, place.position)


def test_on_one_large_face_the_parts_that_are_beyond_are_told_apart():
    reference = sheet(bumps=0.0)
    vertices, _ = sheet_arrays(bumps=0.0)
    peaks = [int(np.abs(vertices[:, :2] - at).max(1).argmin()) for at in ((-0.5, -0.5), (0.5, 0.5), (0.4, -0.6))]
    for peak, height in zip(peaks, (0.3, 0.2, 0.25)):
        reference.data.vertices[peak].co.z = height
    changed(reference)
    low, high = vertices[:, :2].min(0), vertices[:, :2].max(0)
    corners = [(*low, 0), (high[0], low[1], 0), (*high, 0), (low[0], high[1], 0)]
    ob = add_object("large", corners, [(0, 1, 2, 3)])
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", reference
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    found, _, count = places.shown(ob)
    on_mesh = [place for place in found if not place.on_reference]
    assert count == 6 and len(on_mesh) == 3 and all(place.faces <= 2 for place in on_mesh)
    tops = np.array([reference.data.vertices[peak].co for peak in peaks])
    for place in on_mesh:
        assert place.position[2] == 0 and np.linalg.norm(tops[:, :2] - place.position[:2], axis=1).min() < 0.15
        assert place.radius < 0.3
    assert on_mesh[0].distance.upper == verdict.of(ob).forward.upper
    heights = [place.distance.upper for place in found if place.on_reference]
    assert np.allclose(heights, [0.3, 0.25, 0.2], rtol=2e-3)


def test_one_way_leaves_the_reference_out():
    ob = peaked()
    ob.tolvol.keep = "ONE"
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    assert [place.on_reference for place in places.shown(ob)[0]] == [False] * 3


def test_a_hole_is_a_place_on_the_reference():
    ob = sheet(bumps=0.0)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    middle = np.array([np.abs(face.center).max() < 0.3 for face in ob.data.polygons])
    mesh_io.select_faces(ob.data, middle)
    bpy.context.tool_settings.mesh_select_mode = (False, False, True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="FACE")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    (place,), _, regions = places.shown(ob)
    assert place.on_reference and regions == 1 and np.abs(place.position).max() < 0.05


def test_within_the_tolerance_the_places_are_the_highest_points():
    ob = peaked()
    ob.tolvol.tolerance_percent = 50
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    found, _, regions = places.shown(ob)
    assert regions == 0 and not any(place.beyond for place in found) and verdict.word(ob) == "PASS"
    heights = [place.position[2] for place in found if not place.on_reference]
    assert np.allclose(heights, [0.3, 0.22, 0.2])  # 501 is not higher than its neighbour
    assert [place.distance.upper for place in found] == sorted((p.distance.upper for p in found), reverse=True)


def test_an_untouched_mesh_has_one_place_in_each_direction():
    ob = torus()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    assert len(places.shown(ob)[0]) == 2


@pytest.mark.parametrize("mirrored", (False, True))
@pytest.mark.parametrize("inwards", (False, True))
def test_a_place_on_a_solid_is_seen_from_outside_whichever_way_its_faces_look(inwards, mirrored):
    ob = torus(matrix=Matrix.Diagonal((-1, 1, 1, 1))) if mirrored else torus()
    if inwards:
        ob.data.flip_normals()
        changed(ob)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    top = max(ob.data.vertices, key=lambda vertex: vertex.co.z)
    top.co.z += 0.3
    changed(ob)
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    found, _, _ = places.shown(ob)
    assert all(place.normal[2] > 0 for place in found) and {place.on_reference for place in found} == {False, True}


def test_a_place_on_a_mirrored_sheet_is_seen_from_its_front():
    ob = sheet(bumps=0.0)
    ob.matrix_world = Matrix.Diagonal((-1, 1, 1, 1))
    bpy.context.view_layer.update()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    ob.data.vertices[500].co.z = 0.3
    changed(ob)
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    found, _, _ = places.shown(ob)
    assert found and all(place.normal[2] > 0 for place in found)


def test_triangles_with_vertices_of_their_own_are_one_region():
    vertices, quads = sheet_arrays(bumps=0.0)
    ob = add_object("soup", vertices[quads].reshape(-1, 3), np.arange(4 * len(quads)).reshape(-1, 4))
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    lifted = np.isin(quads.ravel(), (500,))
    co = mesh_io.column(ob.data.vertices, "co", 3)
    co[lifted, 2] = 0.3
    ob.data.vertices.foreach_set("co", co.ravel())
    ob.tolvol.keep = "ONE"
    assert bpy.ops.tolvol.worst_point(changed(ob) and "EXEC_DEFAULT") == {"FINISHED"}
    assert len(places.shown(ob)[0]) == 1


def test_more_regions_than_are_measured_are_counted(monkeypatch):
    monkeypatch.setattr(places, "MOST", 2)
    ob = peaked()
    ob.tolvol.keep = "ONE"
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    found, _, regions = places.shown(ob)
    assert [round(place.distance.upper, 3) for place in found] == [0.3, 0.22] and regions == 3
    assert "3 regions in all" in places.described(bpy.context, ob)[1]


def test_next_and_previous_go_around(capfd):
    ob = peaked()
    with pytest.raises(RuntimeError, match="Press Worst Point first"):
        bpy.ops.tolvol.next_place()
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    seen = []
    for back in (False, False, True, True, True):
        capfd.readouterr()
        assert bpy.ops.tolvol.next_place(back=back) == {"FINISHED"}
        seen.append(places.shown(ob)[1])
        assert f"{seen[-1] + 1} of 6" in capfd.readouterr().out
    assert seen == [1, 2, 1, 0, 5]
    assert bpy.ops.tolvol.clear_places() == {"FINISHED"} and places.shown(ob) == ([], 0, 0)
    with pytest.raises(RuntimeError, match="No places are marked"):
        bpy.ops.tolvol.clear_places()


def move(ob):
    ob.location.x = 1


def edit(ob):
    ob.data.vertices[3].co.z = 0.01


def other_tolerance(ob):
    ob.tolvol.tolerance_percent = 2


def other_directions(ob):
    ob.tolvol.keep = "ONE"


def edit_mode(_ob):
    bpy.ops.object.mode_set(mode="EDIT")


def no_reference(_ob):
    bpy.ops.tolvol.clear_reference()


@pytest.mark.parametrize("change", (move, edit, other_tolerance, other_directions, edit_mode, no_reference))
def test_places_are_not_shown_after_a_change(change):
    ob = peaked()
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"} and places.shown(ob)[0]
    change(ob)
    assert places.shown(changed(ob))[0] == []


def test_places_are_those_of_one_object():
    ob = peaked()
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"}
    other = torus()
    assert places.shown(other)[0] == [] and places.shown(ob)[0] and places.shown(None)[0] == []
    activate(ob)
    assert operators.TOLVOL_OT_next_place.poll(bpy.context)


def test_places_do_not_outlive_their_file(tmp_path):
    peaked()
    assert bpy.ops.tolvol.worst_point() == {"FINISHED"} and places.any_shown()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert places.any_shown()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert not places.any_shown()
