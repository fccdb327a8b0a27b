# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects and references that the operators refuse, with the reason."""

import bpy
import pytest
from mathutils import Matrix

from addon.job import refusals
from addon.operators import blocked
from addon.panels import notes
from addon.proof import verdict
from addon.reference import measurements
from scenes import activate, add_object, link, moved_up, sheet, stored, torus

OPERATORS = (bpy.ops.tolvol.set_reference, bpy.ops.tolvol.check, bpy.ops.tolvol.select_outside, bpy.ops.tolvol.decimate)


def refused(match):
    with pytest.raises(RuntimeError, match=match):
        bpy.ops.tolvol.decimate()


@pytest.fixture
def library(tmp_path):
    torus("linked")
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


def test_multi_user_mesh_is_refused_with_the_remedy():
    ob = torus()
    link(bpy.data.objects.new("twin", ob.data))
    activate(ob)
    before = stored(ob)
    refused("2 users share the mesh.*Make Single User")
    assert stored(ob) == before
    ob.data = ob.data.copy()
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}


def test_fake_user_is_no_second_user():
    ob = torus()
    ob.data.use_fake_user = True
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}


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


def test_what_the_module_refuses_is_said_in_the_panels_words():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    for operator in (bpy.ops.tolvol.decimate, bpy.ops.tolvol.smooth):
        with pytest.raises(
            RuntimeError,
            match=r"faces are .* take a larger tolerance, replace the reference, or choose Outside: Keep.* If a "
            "reference is set",
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


def kept_reasons():
    return [text for text, _ in notes.notes(bpy.context, bpy.context.object)[0] if " was refused at " in text]


def test_notes_keep_the_reason_until_the_next_operation(tmp_path):
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    beside = sheet("beside", bumps=0.0)
    activate(ob)
    assert not kept_reasons()
    refused("faces are not within")
    (said,) = kept_reasons()
    assert said.startswith("Decimate in Tolerance was refused at ") and "faces are not within the tolerance" in said
    assert refusals.of(beside) is None
    assert bpy.ops.tolvol.check() == {"FINISHED"}
    assert not kept_reasons()
    refused("faces are not within")
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    assert kept_reasons()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert not kept_reasons()


def test_outside_keep_is_a_setting_of_the_object():
    ob = moved_up()
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", 0.05
    refused("choose Outside: Keep")
    ob.tolvol.outside = "KEEP"
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    assert verdict.word(ob) == verdict.FAIL
