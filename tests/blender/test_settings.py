# SPDX-License-Identifier: GPL-3.0-or-later
"""The tolerance, its units and presets, and the other settings of an object."""

import bpy
import numpy as np
import pytest

import addon
from addon import preferences, units
from addon.operators import presets
from addon.proof import verdict
from addon.reference import measurements, tolerances
from scenes import add_object, link, stored, torus


def offered(ob):
    """Returns {title: [(unit, value, text)]} of the presets, with plain spaces."""
    groups = presets.offered(bpy.context, measurements.shown_size(ob) if ob else None)
    return {title: [(*choice, text.replace("\u00a0", " ")) for *choice, text in choices] for title, choices in groups}


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


def test_adjusting_the_unit_of_a_preset_converts_its_value():
    ob = torus()
    size = measurements.shown_size(ob)
    assert bpy.ops.tolvol.set_tolerance(mode="PERCENT", value=0.2) == {"FINISHED"}
    # Adjust Last Operation keeps what the operator has stored in its properties, and changes the unit.
    assert bpy.ops.tolvol.set_tolerance(mode="LENGTH", value=0.2, mode_before="PERCENT") == {"FINISHED"}
    assert ob.tolvol.tolerance_mode == "LENGTH"
    length = ob.tolvol.tolerance_length
    assert length == pytest.approx(0.002 * size, rel=1e-6)
    assert bpy.ops.tolvol.set_tolerance(mode="PERCENT", value=length, mode_before="LENGTH") == {"FINISHED"}
    assert tolerances.tolerance_length(ob.tolvol, size) == 0.002 * size, "the number that was typed"
    assert bpy.ops.tolvol.set_tolerance(mode="PERCENT", value=0.3, mode_before="PERCENT") == {"FINISHED"}
    assert ob.tolvol.tolerance_percent == pytest.approx(0.3)


def test_every_setting_has_a_tooltip():
    groups = [cls for cls in bpy.types.PropertyGroup.__subclasses__() if cls.__name__.startswith("TOLVOL_PG")]
    assert len(groups) >= 5
    for group in (*groups, preferences.TOLVOL_AP_preferences):
        for name in group.__annotations__:
            rna = group.bl_rna.properties[name]
            if rna.type != "POINTER" or rna.fixed_type.bl_rna.identifier[:9] != "TOLVOL_PG":
                assert rna.description and not rna.description.endswith("."), (group, name)


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
