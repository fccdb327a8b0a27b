# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference of an object: set, replaced, kept, shared, saved; undo."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh import mesh_io
from addon.operators import blocked, reference
from addon.proof import verdict
from addon.reference import instances, measurements, snapshots
from addon.reference.built import volume_of
from scenes import activate, link, stored, torus


def referenced(name="torus"):
    """Returns an object with a reference that was decimated and measured."""
    ob = torus(name)
    bpy.ops.tolvol.set_reference()
    bpy.ops.tolvol.decimate()
    return ob


def assert_whole(ob):
    assert snapshots.stale_reason(ob) is None and verdict.of(ob).forward_within
    assert len(ob.tolvol.snapshot.vertices) == 48 * 24 and ob.tolvol.tolerance_percent == 1
    assert bpy.ops.tolvol.check() == {"FINISHED"} and bpy.ops.tolvol.decimate.poll()


def test_the_objects_that_append_makes_of_references_are_removed(tmp_path):
    ob, path = referenced(), str(tmp_path / "torus.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.append(filepath=f"{path}/Object/torus", directory=f"{path}/Object/", filename="torus")
    made = [ob.name for ob in bpy.data.objects if ob.name != "torus"]
    assert len(made) == 2 and {ob.name for ob in instances.made_by_append()} == set(made)
    instances.remove()
    assert [ob.name for ob in bpy.data.objects] == ["torus"]
    ob = bpy.data.objects["torus"]
    activate(ob)
    assert_whole(ob)
    # An object that the user has made of a mesh stays.
    link(bpy.data.objects.new("mine", ob.tolvol.original))
    assert instances.made_by_append() == []


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
    assert snapshots.stale_reason(ob) is None and verdict.of(ob).largest == 0
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
    assert twin.tolvol.snapshot is not ob.tolvol.snapshot and measurements.measurement_of(twin).backward == 0
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
