# SPDX-License-Identifier: GPL-3.0-or-later
"""Reference, Check and Select Outside; bad input, with the reason; undo."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

import addon
from addon import native, overlay, preferences, units
from addon.mesh import mesh_io
from addon.operators import blocked, presets, reference
from addon.overlay import draw, reasons
from addon.proof import verdict
from addon.reference import measurements, snapshots, tolerances
from addon.reference.built import volume_of
from addon.shared.proof import report
from scenes import activate, add_object, link, sheet, torus, world_triangles

OPERATORS = (bpy.ops.tolvol.set_reference, bpy.ops.tolvol.check, bpy.ops.tolvol.select_outside, bpy.ops.tolvol.decimate)


def stored(ob):
    return [array.tobytes() for array in (*world_triangles(ob), mesh_io.column(ob.data.vertices, "co", 3))]


# The reference ------------------------------------------------------------------------------------------------------


def test_set_reference_takes_a_snapshot_that_edits_do_not_change():
    ob = torus()
    before = mesh_io.read_mesh(ob.data)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    snapshot = ob.tolvol.snapshot
    assert snapshot is not ob.data and snapshot.users == 1
    ob.data.vertices[0].co.x += 1
    ob.data.update()
    after = mesh_io.read_mesh(snapshot)
    assert np.array_equal(after.vertices, before.vertices) and np.array_equal(after.triangles, before.triangles)
    assert ob.tolvol.snapshot_size == pytest.approx(native.module.diagonal(before.vertices, before.triangles))


def test_update_replaces_and_clear_lets_go():
    ob = torus()
    bpy.ops.tolvol.set_reference()
    ob.data.vertices[0].co.x += 1
    ob.data.update()
    bpy.ops.tolvol.set_reference()
    assert ob.tolvol.snapshot.vertices[0].co.x == ob.data.vertices[0].co.x
    assert len(bpy.data.meshes) == 3  # The first snapshot and the first original were removed.
    bpy.ops.tolvol.clear_reference()
    assert ob.tolvol.snapshot is None and len(bpy.data.meshes) == 1
    assert not bpy.ops.tolvol.clear_reference.poll()


def test_own_reference_is_carried_along_moved_and_scaled():
    ob = torus(matrix=Matrix.Diagonal((1, 2, 1, 1)))
    bpy.ops.tolvol.set_reference()
    ob.matrix_world = Matrix.Translation((3, 1, 2)) @ Matrix.Rotation(1.1, 4, (1, 1, 0)) @ Matrix.Diagonal((1, 2, 1, 1))
    bpy.context.view_layer.update()
    assert snapshots.stale_reason(ob) is None
    bpy.ops.tolvol.check()
    assert ob.tolvol.measurement.forward <= 1e-5 and ob.tolvol.measurement.backward <= 1e-5
    ob.scale.x *= 1.5
    bpy.context.view_layer.update()
    assert snapshots.stale_reason(ob) is None and verdict.of(ob) is None
    bpy.ops.tolvol.check()
    assert verdict.of(ob).forward.upper <= 1e-5 and verdict.of(ob).backward.upper <= 1e-5


def test_a_scaled_object_keeps_its_original_as_the_reference():
    ob = torus()
    original = mesh_io.read_mesh(ob.data)
    bpy.ops.tolvol.decimate(tolerance_percent=4)
    bpy.ops.tolvol.check()
    before = verdict.of(ob)
    ob.scale = (10, 10, 10)
    bpy.context.view_layer.update()
    reference = snapshots.reference_of(ob)
    assert reference.arrays.fingerprint() == original.fingerprint()
    assert ob.tolvol.snapshot_size == reference.size()
    bpy.ops.tolvol.check()
    after = verdict.of(ob)
    assert after.tolerance == pytest.approx(10 * before.tolerance)
    assert after.forward.lower > 5 * before.forward.lower > 0 and after.backward_within


def test_when_a_reference_that_is_replaced_would_be_lost():
    ob = torus()
    bpy.ops.tolvol.set_reference()
    assert not reference.loses_something(ob)
    ob.scale.x = 2
    bpy.context.view_layer.update()
    assert not reference.loses_something(ob), "it was scaled as well"
    bpy.ops.tolvol.decimate()
    assert reference.loses_something(ob)
    assert reference.replace_label(ob) == "Replace Reference by This Mesh"
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", torus("other")
    activate(ob)
    assert reference.loses_something(ob) and reference.replace_label(ob) == "Replace Reference by other"
    bpy.ops.tolvol.set_reference(replace=True)
    assert not reference.loses_something(ob)


def test_choosing_another_reference_makes_it_stale():
    other = torus("other")
    ob = torus()
    bpy.ops.tolvol.set_reference()
    ob.tolvol.reference_kind = "OBJECT"
    assert snapshots.stale_reason(ob) == "another kind of reference was chosen"
    assert not bpy.ops.tolvol.set_reference.poll()  # No object was chosen.
    ob.tolvol.reference_object = other
    bpy.ops.tolvol.set_reference()
    assert snapshots.stale_reason(ob) is None
    ob.tolvol.reference_object = torus("third")
    assert snapshots.stale_reason(ob) == "another object was chosen"


def test_reference_object_cannot_be_the_object_itself_or_no_mesh():
    ob = torus()
    poll = type(ob.tolvol).__annotations__["reference_object"].keywords["poll"]
    assert not poll(ob.tolvol, ob)
    assert not poll(ob.tolvol, bpy.data.objects.new("empty", None))
    assert poll(ob.tolvol, torus("other"))


# Check and Select Outside -------------------------------------------------------------------------------------------


def moved_up(share=0.25, height=0.1):
    """Makes a flat sheet its own reference and then lifts the vertices beyond x = 1 - 2 share."""
    ob = sheet(count=20, bumps=0.0)
    bpy.ops.tolvol.set_reference()
    for vertex in ob.data.vertices:
        if vertex.co.x > 1 - 2 * share - 1e-6:
            vertex.co.z += height
    ob.data.update()
    activate(ob)
    return ob


def test_check_measures_both_ways_and_the_share_outside():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    bpy.ops.tolvol.check()
    measured = ob.tolvol.measurement
    assert measured.forward == pytest.approx(0.1, rel=0.011)
    assert not verdict.of(ob).forward_within and not verdict.of(ob).backward_within
    # Outside are the quarter of the sheet that is lifted by 0.1, and half of the slope to it, which is 0.1 wide.
    area = 2 * 2 * 0.75 - 2 * 0.1 + 2 * np.hypot(0.1, 0.1) + 2 * 2 * 0.25
    assert measured.share_outside == pytest.approx((2 * 2 * 0.25 + np.hypot(0.1, 0.1)) / area, abs=0.01)
    assert measurements.measurement_of(ob) is not None
    ob.tolvol.tolerance_length = 0.2
    bpy.ops.tolvol.check()
    assert verdict.of(ob).forward_within and verdict.of(ob).backward_within


def test_measurement_is_dropped_when_mesh_place_or_reference_change():
    other = torus("other")
    ob = torus()
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", other
    bpy.ops.tolvol.set_reference()
    bpy.ops.tolvol.check()
    assert measurements.measurement_of(ob) is not None
    ob.location.x = 1
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is None
    ob.location.x = 0
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is not None
    ob.data.vertices[5].co.z += 0.01
    ob.data.update()
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is None
    bpy.ops.tolvol.check()
    assert measurements.measurement_of(ob) is not None
    bpy.ops.tolvol.set_reference()
    assert measurements.measurement_of(ob) is None


def test_nothing_is_known_of_a_mesh_that_is_being_edited():
    ob = torus()
    bpy.ops.tolvol.set_reference()
    bpy.ops.tolvol.check()
    for mode in ("EDIT", "SCULPT"):
        bpy.ops.object.mode_set(mode=mode)
        assert measurements.measurement_of(ob) is None
        bpy.ops.object.mode_set(mode="OBJECT")
        assert measurements.measurement_of(ob) is not None


def test_own_measurement_moves_along():
    ob = torus()
    bpy.ops.tolvol.decimate(tolerance_percent=1)
    ob.rotation_euler.x = 1
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is not None


def test_select_outside_selects_those_faces_in_edit_mode():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "EDIT" and tuple(bpy.context.tool_settings.mesh_select_mode) == (False, False, True)
    bpy.ops.object.mode_set(mode="OBJECT")
    highest = np.array([max(ob.data.vertices[v].co.z for v in face.vertices) for face in ob.data.polygons])
    selected = mesh_io.column(ob.data.polygons, "select", 1, bool)
    assert np.array_equal(selected, highest > 0.05) and selected.any() and not selected.all()
    assert blocked.check_blocked(ob) is None


def test_select_outside_leaves_an_object_that_is_inside_alone():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.2
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "OBJECT"


def lifted_exactly(height):
    """Makes a flat square at z = 0 and the same square at `height`, which float32 stores exactly."""
    ob = sheet(count=1, bumps=0.0)
    bpy.ops.tolvol.set_reference()
    for vertex in ob.data.vertices:
        vertex.co.z = height
    ob.data.update()
    activate(ob)
    ob.tolvol.tolerance_mode = "LENGTH"
    return ob


def test_verdicts_agree_about_what_float32_cannot_tell_from_the_tolerance():
    """The distance is above and below the tolerance by less than a step of Blender's float32 numbers."""
    height = float(np.float32(0.1))  # 0.100000001490116
    ob = lifted_exactly(height)
    ob.tolvol.tolerance_length = 0.1
    bpy.ops.tolvol.check()
    assert np.float32(verdict.of(ob).tolerance) == np.float32(verdict.of(ob).forward.upper)
    assert verdict.of(ob).kind == verdict.BEYOND and "Beyond" in verdict.of(ob).line()
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.tolvol.tolerance_length = 0.3
    ob.tolvol.tolerance_length = 0.1
    ob.tolvol.tolerance_length_converted = repr(height * (1 + 1e-9))  # as converted from a percentage
    assert tolerances.tolerance_length(ob.tolvol, 1.0) > height
    assert verdict.of(ob).kind == verdict.WITHIN, "of what was measured, before it is measured again"
    bpy.ops.tolvol.check()
    assert verdict.of(ob).kind == verdict.WITHIN
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "OBJECT"


def test_exactly_at_the_tolerance_is_not_called_beyond():
    ob = lifted_exactly(0.25)
    ob.tolvol.tolerance_length = 0.25
    bpy.ops.tolvol.check()
    found = verdict.of(ob)
    assert found.forward.lower <= 0.25 < found.forward.upper and found.kind == verdict.UNDECIDED
    assert report.percent(found.forward.upper, found.tolerance) == "100 %"
    bpy.ops.tolvol.select_outside()
    assert ob.mode == "EDIT", "what is not proved counts as outside"


def test_a_measurement_that_cannot_be_read_is_none():
    ob = torus()
    bpy.ops.tolvol.set_reference()
    bpy.ops.tolvol.check()
    assert verdict.of(ob).kind == verdict.WITHIN
    ob.tolvol.measurement.forward_digits = "much"
    assert verdict.of(ob) is None
    ob.tolvol.measurement.forward_digits = ""
    assert verdict.of(ob) is None


def test_a_little_more_than_the_tolerance_is_not_shown_as_a_percent_more():
    assert report.percent(1 + 4.75e-8, 1) == "100.0000048 %"
    assert report.percent(1.005, 1) == "100.50 %"


def test_large_percentages_have_all_their_digits():
    assert report.percent(30.391, 1) == "3,040 %" and report.percent(9.998, 1) == "1,000 %"
    assert report.percent(9.98, 1) == "998 %"
    assert report.percent(1 + 1e-13, 1) == "100 %" == report.percent(0.99999, 1)


# Refused ------------------------------------------------------------------------------------------------------------


def refused(match):
    with pytest.raises(RuntimeError, match=match):
        bpy.ops.tolvol.decimate()


def test_multi_user_mesh_is_refused_with_the_remedy():
    ob = torus()
    link(bpy.data.objects.new("twin", ob.data))
    activate(ob)
    before = stored(ob)
    refused("has 2 users.*Make Single User")
    assert stored(ob) == before
    ob.data = ob.data.copy()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}


def test_fake_user_is_no_second_user():
    ob = torus()
    ob.data.use_fake_user = True
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}


@pytest.fixture
def library(tmp_path):
    torus("linked")
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


def test_linked_object_is_refused(library):
    with bpy.data.libraries.load(library, link=True) as (_, there):
        there.objects = ["linked"]
    ob = link(there.objects[0])
    refused("linked is linked from another file.*Make Local")
    assert not any(operator.poll() for operator in OPERATORS)
    assert blocked.decimate_blocked(ob).startswith("linked is linked")


def test_linked_mesh_of_a_local_object_is_refused(library):
    with bpy.data.libraries.load(library, link=True) as (_, there):
        there.meshes = ["linked"]
    link(bpy.data.objects.new("local", there.meshes[0]))
    refused("mesh linked is linked.*Make Local")
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}  # Setting a reference does not change a mesh.


def test_override_is_refused(library):
    with bpy.data.libraries.load(library, link=True) as (_, there):
        there.objects = ["linked"]
    override = there.objects[0].override_create()
    link(override)
    refused("linked is linked.*Make Local")


def test_other_modes_no_faces_no_mesh_and_multires_are_refused():
    assert blocked.decimate_blocked(None) == "Select a mesh object"
    link(bpy.data.objects.new("empty", None))
    refused("Select a mesh object")
    add_object("edge", [(0, 0, 0), (1, 0, 0)], [])
    refused("edge has no faces")
    ob = torus()
    bpy.ops.object.mode_set(mode="EDIT")
    refused("Switch to Object Mode")
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.modifiers.new("multires", "MULTIRES")
    refused("Apply the Multiresolution modifier first")


def test_check_without_reference_is_refused():
    torus()
    with pytest.raises(RuntimeError, match="Set the reference first"):
        bpy.ops.tolvol.check()


def test_a_reference_that_is_no_mesh_is_refused():
    curve = bpy.data.objects.new("wire", bpy.data.curves.new("wire", "CURVE"))
    ob = torus()
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", curve
    with pytest.raises(RuntimeError, match="wire is not a mesh: Object > Convert > Mesh"):
        bpy.ops.tolvol.set_reference()
    assert measurements.shown_size(ob) is None


# What becomes of objects ---------------------------------------------------------------------------------------------


def referenced(name="torus"):
    """Returns an object with a reference that was decimated and measured."""
    ob = torus(name)
    bpy.ops.tolvol.set_reference()
    bpy.ops.tolvol.decimate()
    return ob


def test_volume_in_memory_is_that_of_the_tolerance():
    ob = referenced()
    built = volume_of(ob)
    assert built.tolerance == pytest.approx(0.01 * ob.tolvol.snapshot_size, rel=1e-6) and built.memory > 0
    ob.tolvol.tolerance_percent = 2
    assert volume_of(ob) is None
    bpy.ops.tolvol.check()
    bpy.ops.tolvol.decimate()
    assert volume_of(ob).tolerance == pytest.approx(2 * built.tolerance)


def test_renaming_changes_nothing():
    ob = referenced()
    ob.name, ob.data.name, ob.tolvol.snapshot.name = "other", "mesh", "moved"
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is not None and snapshots.stale_reason(ob) is None
    assert bpy.ops.tolvol.check() == {"FINISHED"}


def test_duplicates_share_a_reference_until_one_gets_another():
    ob = referenced()
    bpy.ops.object.duplicate()
    twin = bpy.context.object
    assert (
        twin is not ob and twin.tolvol.snapshot is ob.tolvol.snapshot and measurements.measurement_of(twin) is not None
    )
    before = mesh_io.read_mesh(ob.tolvol.snapshot).fingerprint()
    bpy.ops.tolvol.set_reference()
    assert twin.tolvol.snapshot is not ob.tolvol.snapshot and measurements.measurement_of(twin) is None
    assert mesh_io.read_mesh(ob.tolvol.snapshot).fingerprint() == before
    bpy.data.objects.remove(twin)
    activate(ob)
    assert measurements.measurement_of(ob) is not None and bpy.ops.tolvol.check() == {"FINISHED"}


def test_reference_outlives_the_object_it_was_taken_of():
    other = torus("other")
    ob = torus()
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", other
    bpy.ops.tolvol.set_reference()
    bpy.data.objects.remove(other)
    assert measurements.shown_size(ob) == ob.tolvol.snapshot_size
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    bpy.ops.tolvol.clear_reference()
    assert blocked.reference_blocked(ob) == "Choose the reference object" and measurements.shown_size(ob) is None


def test_another_mesh_on_the_object_is_noticed():
    ob = referenced()
    ob.data = torus("other", seed=2).data
    bpy.context.view_layer.update()
    assert measurements.measurement_of(ob) is None


def assert_whole(ob):
    assert snapshots.stale_reason(ob) is None and verdict.of(ob).forward_within
    assert len(ob.tolvol.snapshot.vertices) == 48 * 24 and ob.tolvol.tolerance_percent == 1
    assert bpy.ops.tolvol.check() == {"FINISHED"} and bpy.ops.tolvol.decimate.poll()


def test_saved_loaded_and_appended(tmp_path):
    ob = referenced()
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    ob = bpy.data.objects["torus"]
    assert volume_of(ob) is None
    assert_whole(ob)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path) as (_, there):
        there.objects = ["torus"]
    assert_whole(link(there.objects[0]))


# Beside the panel ----------------------------------------------------------------------------------------------------


def test_legend_says_what_no_proof_covers():
    ob = torus()
    assert draw.note(ob) == "Colours not proved"
    ob.modifiers.new("wave", "WAVE")
    ob.shape_key_add()
    assert draw.note(ob) == "Colours with its modifiers and shape keys, not proved"
    bpy.ops.object.mode_set(mode="SCULPT")
    assert draw.note(ob) == "Colours without its modifiers, not proved"


def test_drawing_that_was_refused_is_asked_for_again_once_it_is_turned_on_anew(chosen_preferences):
    reasons.broken[:] = ["no such texture"]
    overlay.refresh()
    assert reasons.broken
    chosen_preferences.use_gl = False
    assert not reasons.broken


def test_menus_have_entries_while_the_addon_is_on():
    def ours():
        kinds = bpy.types.VIEW3D_MT_object, bpy.types.VIEW3D_MT_edit_mesh_vertices
        return [sum(f.__module__.startswith("addon.") for f in kind.draw._draw_funcs) for kind in kinds]

    assert ours() == [1, 1]
    addon.unregister()
    try:
        assert ours() == [0, 0]
    finally:
        addon.register()


# Undo ---------------------------------------------------------------------------------------------------------------


def test_one_undo_step_restores_everything_bit_for_bit():
    ob = torus()
    bpy.ops.ed.undo_push(message="start")
    before = stored(ob)
    bpy.ops.tolvol.decimate("EXEC_DEFAULT", True, tolerance_percent=1)
    after = stored(bpy.data.objects["torus"])
    assert after != before and bpy.data.objects["torus"].tolvol.snapshot is not None
    bpy.ops.ed.undo()
    ob = bpy.data.objects["torus"]
    assert stored(ob) == before and ob.tolvol.snapshot is None and not ob.tolvol.last_run
    assert len(bpy.data.meshes) == 1
    bpy.ops.ed.redo()
    ob = bpy.data.objects["torus"]
    assert stored(ob) == after and ob.tolvol.snapshot is not None


def test_undo_of_a_second_decimation_keeps_the_reference_of_the_first():
    torus()
    bpy.ops.ed.undo_push(message="start")
    bpy.ops.tolvol.decimate("EXEC_DEFAULT", True, tolerance_percent=0.3)
    first = stored(bpy.data.objects["torus"])
    bpy.ops.tolvol.decimate("EXEC_DEFAULT", True, tolerance_percent=1)
    bpy.ops.ed.undo()
    ob = bpy.data.objects["torus"]
    activate(ob)
    assert stored(ob) == first and len(ob.tolvol.snapshot.vertices) == 48 * 24
    bpy.ops.tolvol.check()
    assert verdict.of(ob).forward_within


# Settings -----------------------------------------------------------------------------------------------------------


def test_placement_follows_uvs_until_it_is_chosen():
    ob = torus()
    assert ob.tolvol.placement == "OPTIMAL"
    ob.data.uv_layers.new()
    assert ob.tolvol.placement == "SUBSET"
    ob.tolvol.placement = "OPTIMAL"
    assert ob.tolvol.placement == "OPTIMAL"


def test_settings_not_given_are_the_objects_own_and_those_given_are_kept():
    ob = torus()
    ob.tolvol.tolerance_percent, ob.tolvol.keep, ob.tolvol.placement = 2.0, "ONE", "SUBSET"
    ob.tolvol.use_target, ob.tolvol.target_triangles = True, 700
    bpy.ops.tolvol.decimate()
    report = ob.tolvol.last_run
    assert '"percent": 2.0' in report and '"two_sided": false' in report and '"placement": "subset"' in report
    assert '"target_triangles": 700' in report
    bpy.ops.tolvol.decimate(tolerance_percent=1.5, use_target=False)
    assert ob.tolvol.tolerance_percent == 1.5 and not ob.tolvol.use_target and ob.tolvol.keep == "ONE"
    # The next object uses its own settings, never those of the last run.
    other = torus("other")
    bpy.ops.tolvol.decimate()
    assert '"percent": 1.0' in other.tolvol.last_run and '"two_sided": true' in other.tolvol.last_run


@pytest.fixture
def chosen_preferences():
    """Preferences that the user has chosen for the installed add-on."""
    installed = bpy.context.preferences.addons.new()
    installed.module = addon.__name__
    yield installed.preferences
    bpy.context.preferences.addons.remove(installed)


def test_tolerance_begins_as_the_preferences_say_and_stays_once_a_reference_is_set(chosen_preferences):
    ob = link(bpy.data.objects.new("new", torus().data.copy()))
    assert (
        ob.tolvol.tolerance_percent == np.float32(0.2)
        and ob.tolvol.tolerance_mode == "PERCENT"
        and ob.tolvol.keep == "BOTH"
    )
    chosen_preferences.tolerance = 0.25
    assert ob.tolvol.tolerance_percent == 0.25
    bpy.ops.tolvol.set_reference()
    chosen_preferences.tolerance = 2
    assert ob.tolvol.tolerance_percent == 0.25


def offered(ob):
    """Returns {title: [(unit, value, text)]} of the presets, with plain spaces."""
    groups = presets.offered(bpy.context, measurements.shown_size(ob) if ob else None)
    return {title: [(*choice, text.replace("\u00a0", " ")) for *choice, text in choices] for title, choices in groups}


def test_presets_by_size_are_shown_as_length_and_share():
    ob = torus()
    size = measurements.shown_size(ob)
    choices = offered(ob)["By Size"]
    assert [text.split(":")[0] for *_, text in choices] == ["Coarse", "Normal", "Fine"]
    assert [(unit, value) for unit, value, _ in choices] == [("PERCENT", 1.0), ("PERCENT", 0.2), ("PERCENT", 0.05)]
    assert choices[1][2] == f"Normal:  0.2 % of size,  {units.length(bpy.context, 0.002 * size)}".replace("\u00a0", " ")
    for unit, value, _ in choices:
        assert bpy.ops.tolvol.set_tolerance(mode=unit, value=value) == {"FINISHED"}
        assert (
            ob.tolvol.tolerance_mode == "PERCENT" and tolerances.tolerance_length(ob.tolvol, size) == value / 100 * size
        )
    assert offered(None)["By Size"][0][2] == "Coarse:  1 % of size"
    assert preferences.TOLERANCE == dict(presets.BY_SIZE)["Normal"]


@pytest.mark.parametrize(
    ("system", "scale", "real"),
    (
        ("METRIC", 1.0, 5e-5),
        ("METRIC", 0.01, 0.005),
        ("METRIC", 0.001, None),
        ("IMPERIAL", 1.0, 5e-5),
        ("NONE", 1.0, None),
    ),
)
def test_presets_for_printers_are_millimetres_of_the_scene_or_of_the_file(system, scale, real):
    ob, settings = torus(), bpy.context.scene.unit_settings
    settings.system, settings.scale_length = system, scale
    size, groups = measurements.shown_size(ob), offered(ob)
    wanted = {"For a Printer": real, "For a Printer, File in Millimetres": 0.05}
    assert set(groups) == {"By Size", *(title for title, value in wanted.items() if value)}
    for title, wish in wanted.items():
        if wish is None:
            continue
        _, (unit, value, text) = groups[title]
        assert text.startswith("0.05 mm:  ") and text.endswith(f"{100 * wish / size:.3g} % of size")
        assert bpy.ops.tolvol.set_tolerance(mode=unit, value=value) == {"FINISHED"}
        assert tolerances.tolerance_length(ob.tolvol, size) == wish
    assert f"shown as {units.length(bpy.context, 0.05)}".replace("\u00a0", " ") in text


def test_every_setting_has_a_tooltip():
    groups = [cls for cls in bpy.types.PropertyGroup.__subclasses__() if cls.__name__.startswith("TOLVOL_PG")]
    assert len(groups) >= 5
    for group in (*groups, preferences.TOLVOL_AP_preferences):
        for name in group.__annotations__:
            rna = group.bl_rna.properties[name]
            if rna.type != "POINTER" or rna.fixed_type.bl_rna.identifier[:9] != "TOLVOL_PG":
                assert rna.description and not rna.description.endswith("."), (group, name)


def test_what_the_module_refuses_is_said_in_the_panels_words():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    for operator in (bpy.ops.tolvol.decimate, bpy.ops.tolvol.smooth):
        with pytest.raises(
            RuntimeError, match=r"faces are .* take a larger tolerance or set the reference anew\. Select Outside"
        ) as said:
            operator()
        assert "=" not in str(said.value)
    # Every remaining face is inside, but half of the reference has no face near it.
    ob = sheet(bumps=0.0)
    bpy.ops.tolvol.set_reference()
    half = sheet("half", bumps=0.0)
    half.data.transform(Matrix.Diagonal((0.5, 1, 1, 1)))
    ob.data = half.data
    bpy.data.objects.remove(half)
    activate(ob)
    with pytest.raises(RuntimeError, match="or set Keep to One Way") as said:
        bpy.ops.tolvol.decimate()
    assert "=" not in str(said.value)
    assert bpy.ops.tolvol.decimate(keep="ONE") == {"FINISHED"}


def test_percent_that_was_typed_is_the_percent_that_is_used():
    ob = torus()
    ob.tolvol.tolerance_percent = 0.1  # The tolerance is the typed 0.1, not its float32.
    assert tolerances.tolerance_length(ob.tolvol, 1.0) == 0.1 / 100


def test_changing_the_unit_keeps_the_tolerance():
    ob = torus()
    ob.scale = (0.1, 0.1, 0.1)
    bpy.context.view_layer.update()
    size = measurements.shown_size(ob)
    ob.tolvol.tolerance_percent = 0.3
    wanted = 0.3 / 100 * size
    ob.tolvol.tolerance_mode = "LENGTH"
    assert tolerances.tolerance_length(ob.tolvol, size) == wanted and ob.tolvol.tolerance_length == pytest.approx(
        wanted
    )
    ob.tolvol.tolerance_mode = "PERCENT"
    assert tolerances.tolerance_length(ob.tolvol, size) == wanted and ob.tolvol.tolerance_percent == pytest.approx(0.3)
    bpy.ops.tolvol.decimate()
    assert verdict.of(ob).kind == verdict.WITHIN
    # In Adjust Last Operation the operator has the used tolerance in both units.
    ob.tolvol.tolerance_mode = "LENGTH"
    assert verdict.of(ob).kind == verdict.WITHIN and verdict.of(ob).tolerance == wanted
    ob.tolvol.tolerance_length = 0.05
    assert tolerances.tolerance_length(ob.tolvol, size) == 0.05
    ob.tolvol.tolerance_mode = "LENGTH"
    assert tolerances.tolerance_length(ob.tolvol, size) == 0.05, "not converted again"
    ob.tolvol.tolerance_mode = "PERCENT"
    assert tolerances.tolerance_length(ob.tolvol, size) == pytest.approx(0.05, rel=1e-15)


def test_a_quarter_of_a_metre():
    """0.3 % of 250 mm are 0.75 mm."""
    ob = add_object("rod", [(0, 0, 0), (0.15, 0, 0), (0.15, 0.2, 0), (0, 0.2, 0)], [(0, 1, 2, 3)])
    ob.tolvol.tolerance_percent = 0.3
    ob.tolvol.tolerance_mode = "LENGTH"
    assert ob.tolvol.tolerance_length == pytest.approx(0.00075, rel=1e-6)
    assert bpy.ops.tolvol.decimate(tolerance_percent=0.3) == {"FINISHED"}
    assert ob.tolvol.tolerance_mode == "PERCENT" and ob.tolvol.tolerance_length == pytest.approx(0.00075, rel=1e-6)


@pytest.mark.parametrize("mm", (0.5, 0.05, 0.1, 1.75, 0.3, 7e-4))
def test_there_and_back_a_typed_number_is_the_same_to_the_last_bit(mm):
    """The sides of the plate are 3 : 4 : 5, so that its size is 250."""
    ob = add_object("plate", [(0, 0, 0), (150, 0, 0), (150, 200, 0), (0, 200, 0)], [(0, 1, 2, 3)])
    settings = ob.tolvol
    for typed, other in (("LENGTH", "PERCENT"), ("PERCENT", "LENGTH")):
        settings.tolerance_mode = typed
        setattr(settings, f"tolerance_{typed.lower()}", mm if typed == "LENGTH" else mm / 2.5)
        before = tolerances.tolerance_length(settings, 250.0)
        assert before == pytest.approx(mm, rel=1e-15)
        for _ in range(3):
            settings.tolerance_mode = other
            settings.tolerance_mode = typed
        assert tolerances.tolerance_length(settings, 250.0) == before
    settings.tolerance_mode = "LENGTH"
    assert tolerances.tolerance_length(settings, 250.0) == mm  # 0.3 % of 250 are 0.75 and no neighbour of it.


def test_a_length_typed_in_a_unit_of_the_scene_is_that_length():
    ob = torus()
    settings, units = ob.tolvol, bpy.context.scene.unit_settings
    settings.tolerance_mode = "LENGTH"
    for system, scale, metres, wanted in (
        ("METRIC", 0.001, 0.0005, 0.5),
        ("METRIC", 0.001, 0.00075, 0.75),
        ("METRIC", 0.01, 0.0005, 0.05),
        ("METRIC", 1.0, 0.0005, 0.0005),
        ("IMPERIAL", 1.0, 0.0254 / 8, 0.003175),
        ("IMPERIAL", 0.001, 0.3048, 304.8),
        ("NONE", 0.001, 0.0005, 0.5),
    ):
        units.system, units.scale_length = system, scale
        scale_as_stored = 1.0 if system == "NONE" else units.scale_length
        # Blender computes the length of a text field in this way.
        settings.tolerance_length = wanted if system == "NONE" else metres / scale_as_stored
        assert tolerances.tolerance_length(settings, 1.0) == pytest.approx(wanted, rel=1e-15), (system, scale, metres)
    units.system, units.scale_length = "METRIC", 0.001
    settings.tolerance_length = 0.123456789  # A value that was dragged has all digits.
    assert np.float32(tolerances.tolerance_length(settings, 1.0)) == np.float32(0.123456789)
