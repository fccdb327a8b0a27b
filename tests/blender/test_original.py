# SPDX-License-Identifier: GPL-3.0-or-later
"""The original is kept with all its data, comes back in one step, and is let go with the reference."""

from functools import partial
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon.mesh import mesh_io, transfer
from addon.mesh.mesh_io import column
from addon.operators import original, reference
from addon.reference import originals
from scenes import activate, sheet, torus


def rich():
    """A sheet with every kind of data that decimation could lose."""
    ob = sheet(count=12)
    mesh = ob.data
    mesh.use_fake_user = True
    rng, corners = np.random.default_rng(3), column(mesh.loops, "vertex_index", 1, np.int32)
    mesh.uv_layers.new(name="map").data.foreach_set("uv", column(mesh.vertices, "co", 3)[corners, :2].ravel())
    for name in ("red", "blue"):
        mesh.materials.append(bpy.data.materials.new(name))
    mesh.polygons.foreach_set("material_index", rng.integers(0, 2, len(mesh.polygons)).astype(np.int32))
    mesh.attributes.new("heat", "FLOAT", "POINT").data.foreach_set("value", rng.random(len(mesh.vertices), np.float32))
    ob.vertex_groups.new(name="soft").add(range(0, 40), 0.25, "REPLACE")
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="up")
    key.data[3].co.z += 0.5
    mesh["note"] = "mine"
    return ob


def state(mesh):
    """Returns all that a mesh of rich() holds, for a comparison."""
    return {
        "co": column(mesh.vertices, "co", 3).tobytes(),
        "corners": column(mesh.loops, "vertex_index", 1, np.int32).tobytes(),
        "polygons": column(mesh.polygons, "loop_total", 1, np.int32).tobytes(),
        "uvs": [(layer.name, column(layer.data, "uv", 2).tobytes()) for layer in mesh.uv_layers],
        "materials": [material.name for material in mesh.materials],
        "material": column(mesh.polygons, "material_index", 1, np.int32).tobytes(),
        "heat": column(mesh.attributes["heat"].data, "value").tobytes(),
        "groups": [[(group.group, group.weight) for group in vertex.groups] for vertex in mesh.vertices],
        "keys": [(key.name, column(key.data, "co", 3).tobytes()) for key in mesh.shape_keys.key_blocks],
        "note": mesh.get("note"),
        "fake": mesh.use_fake_user,
    }


def test_restore_brings_back_the_mesh_with_all_its_data_in_one_undo_step():
    ob = rich()
    before, name = state(ob.data), ob.data.name
    bpy.ops.ed.undo_push(message="start")
    assert bpy.ops.tolvol.decimate("EXEC_DEFAULT", True, tolerance_percent=3, placement="OPTIMAL") == {"FINISHED"}
    decimated = state(ob.data)
    assert decimated["co"] != before["co"] and ob.tolvol.last_run
    assert bpy.ops.tolvol.restore_original("EXEC_DEFAULT", True) == {"FINISHED"}
    assert state(ob.data) == before and ob.data.name == name and ob.data is not ob.tolvol.original
    assert [group.name for group in ob.vertex_groups] == ["soft"] and not ob.tolvol.last_run
    assert ob.tolvol.snapshot is not None and ob.tolvol.original is not None  # It can be had again.
    bpy.ops.ed.undo()
    ob = bpy.data.objects["sheet"]
    assert state(ob.data) == decimated and ob.tolvol.last_run
    bpy.ops.ed.redo()
    assert state(bpy.data.objects["sheet"].data) == before


def test_custom_normals_come_back():
    ob = torus()
    mesh = ob.data
    if bpy.app.version < (4, 1):
        mesh.use_auto_smooth = True
    normals = np.random.default_rng(1).normal(size=(len(mesh.loops), 3))
    mesh.normals_split_custom_set((normals / np.linalg.norm(normals, axis=1)[:, None]).tolist())

    def stored():
        if bpy.app.version < (4, 1):
            ob.data.calc_normals_split()
            return column(ob.data.loops, "normal", 3)
        return column(ob.data.corner_normals, "vector", 3)

    before = stored()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    assert bpy.ops.tolvol.restore_original() == {"FINISHED"}
    assert ob.data.has_custom_normals and np.array_equal(stored(), before)


def test_the_original_is_saved_with_the_file_and_let_go_with_the_reference(tmp_path):
    ob = rich()
    before = state(ob.data)
    assert bpy.ops.tolvol.decimate(tolerance_percent=3) == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    ob = bpy.data.objects["sheet"]
    activate(ob)
    assert ob.tolvol.original.users == 1 and not ob.tolvol.original.use_fake_user
    assert bpy.ops.tolvol.restore_original() == {"FINISHED"}
    assert state(ob.data) == before
    assert len(bpy.data.meshes) == 3  # the mesh, the snapshot and the original
    assert bpy.ops.tolvol.clear_reference() == {"FINISHED"}
    assert ob.tolvol.original is None and list(bpy.data.meshes) == [ob.data]


def test_a_new_reference_lets_the_old_original_go():
    ob = torus()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    ob.data.vertices[0].co.x += 1
    ob.data.update()
    assert bpy.ops.tolvol.set_reference(replace=True) == {"FINISHED"}
    assert len(bpy.data.meshes) == 3 and ob.tolvol.original.vertices[0].co == ob.data.vertices[0].co


def add_uv_map(mesh):
    mesh.uv_layers.new(name="another")


def change_uvs(mesh):
    mesh.uv_layers[0].data[5].uv.x += 0.5


def change_material(mesh):
    mesh.polygons[3].material_index = 1 - mesh.polygons[3].material_index


def remove_material(mesh):
    mesh.materials.pop()


def change_attribute(mesh):
    mesh.attributes["heat"].data[7].value = 3


def change_weight(mesh):
    mesh.vertices[2].groups[0].weight = 0.75


def change_shape_key(mesh):
    mesh.shape_keys.key_blocks["up"].data[4].co.z += 0.5


def mark_seam(mesh):
    mesh.edges[9].use_seam = True


def shade_smooth(mesh):
    mesh.polygons[0].use_smooth = not mesh.polygons[0].use_smooth


def set_normals(mesh):
    if bpy.app.version < (4, 1):
        mesh.use_auto_smooth = True
    mesh.normals_split_custom_set([(0, 0.6, 0.8)] * len(mesh.loops))


@pytest.mark.parametrize(
    "change",
    (
        *(add_uv_map, change_uvs, change_material, remove_material, change_attribute, change_weight, change_shape_key),
        *(mark_seam, shade_smooth, set_normals),
    ),
)
def test_an_original_with_other_data_is_not_discarded_without_a_question(change, monkeypatch):
    ob = rich()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    assert not reference.loses_something(ob)
    mesh_io.select_faces(ob.data, np.arange(len(ob.data.polygons)) < 5)
    assert not reference.loses_something(ob), "a selection is no data"
    change(ob.data)
    assert reference.loses_something(ob)
    asked = []
    monkeypatch.setattr(reference, "ask", lambda _context, title, lines, _draw: asked.append((title, lines)))
    # Blender without a window calls no invoke().
    button = SimpleNamespace(sure=False, replace=False)
    for operator in (reference.TOLVOL_OT_set_reference, reference.TOLVOL_OT_clear_reference):
        assert operator.invoke(button, bpy.context, None) == {"CANCELLED"} and ob.tolvol.original is not None
    assert [title for title, _ in asked] == ["Replace the reference of sheet?", "Remove the reference of sheet?"]
    lost = "The original is discarded, too, with its UV maps, materials, shape keys, vertex groups."
    assert all(lines[1] == lost for _, lines in asked)


def test_a_reference_like_the_mesh_is_removed_without_a_question():
    ob = rich()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    button = SimpleNamespace(sure=False)
    button.execute = partial(reference.TOLVOL_OT_clear_reference.execute, button)
    assert reference.TOLVOL_OT_clear_reference.invoke(button, bpy.context, None) == {"FINISHED"}
    assert ob.tolvol.snapshot is None and ob.tolvol.original is None
    assert bpy.ops.tolvol.decimate(tolerance_percent=3) == {"FINISHED"}
    assert reference.loses_something(ob), "the original is not the mesh"


def smooth(_ob):
    return bpy.ops.tolvol.smooth(iterations=3)


def smooth_in_edit_mode(_ob):
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    try:
        return bpy.ops.tolvol.smooth(iterations=3)
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def apply_modifier(ob, result="REPLACE"):
    ob.modifiers.new("smooth", "SMOOTH").iterations = 3
    return bpy.ops.tolvol.apply_modifier(result=result)


def apply_modifier_to_a_key(ob):
    return apply_modifier(ob, "SHAPE_KEY")


def fit_modifier(ob):
    ob.modifiers.new("decimate", "DECIMATE")
    return bpy.ops.tolvol.fit_modifier(value=0.5)


@pytest.mark.parametrize(
    "operation", (smooth, smooth_in_edit_mode, apply_modifier, apply_modifier_to_a_key, fit_modifier)
)
def test_each_operation_keeps_the_mesh_as_it_was_before(operation):
    ob = torus()
    ob.data.uv_layers.new(name="map")
    before = column(ob.data.vertices, "co", 3).tobytes()
    assert operation(ob) == {"FINISHED"}
    kept = ob.tolvol.original
    assert column(kept.vertices, "co", 3).tobytes() == before and kept.uv_layers and kept.shape_keys is None
    assert bpy.ops.tolvol.restore_original() == {"FINISHED"}
    assert column(ob.data.vertices, "co", 3).tobytes() == before and len(ob.data.polygons) == 48 * 24
    assert ob.data.uv_layers and ob.data.shape_keys is None


def test_the_mesh_that_was_changed_meanwhile_is_not_kept_as_the_original():
    ob = torus()
    arrays = mesh_io.read_mesh(ob.data)
    assert len(bpy.data.meshes) == 1
    ob.data.vertices[5].co.z += 1e-3
    assert originals.copy_of(ob, arrays) is None and len(bpy.data.meshes) == 1


def test_a_decimation_that_cannot_write_the_mesh_leaves_no_reference(monkeypatch):
    ob = rich()
    before = state(ob.data)

    def fail(_writing, _mesh):
        raise RuntimeError("no memory")

    monkeypatch.setattr(transfer.Writing, "write", fail)
    with pytest.raises(RuntimeError, match="no memory"):
        bpy.ops.tolvol.decimate(tolerance_percent=1)
    assert ob.tolvol.snapshot is None and ob.tolvol.original is None and state(ob.data) == before


def test_an_earlier_file_has_only_the_shape():
    ob = torus()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    ob.tolvol.original = None
    with pytest.raises(RuntimeError, match="poll"):
        bpy.ops.tolvol.restore_original()
    assert original.restore_blocked(ob).startswith("An earlier version kept only the shape")
    assert bpy.ops.tolvol.new_original() == {"FINISHED"}
    assert len(bpy.context.object.data.polygons) == 2 * 48 * 24


def test_original_as_new_object_leaves_the_object_as_it_is():
    ob = rich()
    ob.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Scale(2, 4)
    ob.modifiers.new("solid", "SOLIDIFY")
    before = state(ob.data) | {"fake": False}
    assert bpy.ops.tolvol.decimate(tolerance_percent=3) == {"FINISHED"}
    decimated = state(ob.data)
    bpy.ops.ed.undo_push(message="start")
    assert bpy.ops.tolvol.new_original("EXEC_DEFAULT", True) == {"FINISHED"}
    new = bpy.context.object
    assert new is not ob and new.name == "sheet original" and new.select_get() and not ob.select_get()
    assert state(new.data) == before and new.data is not ob.tolvol.original and state(ob.data) == decimated
    assert new.matrix_world == ob.matrix_world and [modifier.name for modifier in new.modifiers] == ["solid"]
    assert new.tolvol.snapshot is None and not new.tolvol.last_run and ob.tolvol.original.users == 1
    bpy.ops.ed.undo()
    assert "sheet original" not in bpy.data.objects


def test_the_reference_of_another_object_is_not_the_original_of_this_one():
    scan = torus("scan", Matrix.Translation((0, 0, 5)))
    scan.data.uv_layers.new(name="map")
    ob = torus()
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", scan
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    assert original.restore_blocked(ob).startswith("The reference is the mesh of another object")
    bpy.data.objects.remove(scan)
    assert bpy.ops.tolvol.new_original() == {"FINISHED"}
    new = bpy.context.object
    assert new.data.uv_layers and new.matrix_world == Matrix.Translation((0, 0, 5))


def test_what_is_in_the_way_of_the_original_is_said():
    ob = torus()
    assert original.restore_blocked(ob) == "Set the reference first"
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    assert original.restore_blocked(ob) is None
    twin = ob.copy()
    bpy.context.collection.objects.link(twin)
    assert "2 users share the mesh" in original.restore_blocked(ob)
    bpy.data.objects.remove(twin)
    bpy.ops.object.mode_set(mode="EDIT")
    assert original.restore_blocked(ob) == "Switch to Object Mode"
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.tolvol.original.clear_geometry()
    assert original.restore_blocked(ob) == "The snapshot in the file is damaged"


def test_show_original_needs_a_window_and_changes_nothing():
    ob = torus()
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    objects = list(bpy.data.objects)
    for how in ("EXEC_DEFAULT", "INVOKE_DEFAULT"):
        with pytest.raises(RuntimeError, match="held"):
            bpy.ops.tolvol.show_original(how)
    assert not original.shown() and list(bpy.data.objects) == objects and not ob.hide_get()


def test_what_is_shown_ends_before_the_file_is_saved(tmp_path):
    ob = torus()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    for mode in ("OBJECT", "SCULPT"):
        bpy.ops.object.mode_set(mode=mode)
        count, objects = len(ob.data.polygons), list(bpy.data.objects)
        original._shown.append(original._Shown(bpy.context, ob))
        twin = original._shown[0].twin
        assert ob.hide_get() and len(twin.data.polygons) == 48 * 24 and twin.visible_get()
        assert (
            twin.data == ob.tolvol.original and twin.tolvol.snapshot is None
        )  # Neither guard nor overlay is about it.
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{mode}.blend"))
        assert not original.shown() and list(bpy.data.objects) == objects and len(ob.data.polygons) == count
        assert not ob.hide_get() and ob.select_get() and ob.mode == mode
        assert ob.tolvol.original.users == 1
    bpy.ops.object.mode_set(mode="OBJECT")
