# SPDX-License-Identifier: GPL-3.0-or-later
"""Make LOD Chain: each level is a decimation of the original, proved on the stored mesh, and all are made or none."""

import math
import types

import bpy
import numpy as np
import pytest
from mathutils import Matrix

import addon
from addon import native
from addon.job.run import Run
from addon.mesh import mesh_io
from addon.mesh.mesh_io import column
from addon.proof import verdict
from addon.reference import snapshots
from scenes import activate, torus, world_triangles
from test_attributes import KINDS, creases, dressed_torus

PLACED = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.7, 4, (1, 2, 3)) @ Matrix.Diagonal((1, 2, 0.5, 1))


def make(**options):
    assert bpy.ops.tolvol.make_lods(**options) == {"FINISHED"}
    return list(bpy.context.active_object.tolvol.lods.objects)


def padded(*values):
    """The values of a vector property, which has a number for each of the most levels."""
    return (*values, *[values[-1]] * (6 - len(values)))


def datablocks():
    return [len(blocks) for blocks in (bpy.data.objects, bpy.data.meshes, bpy.data.collections)]


def deviation(level, reference):
    """Judges a level by the native measure, and returns the upper end of the larger direction."""
    return native.module.hausdorff(*world_triangles(level), *reference).upper


def fresh_count(**options):
    """Returns the number of triangles that Decimate leaves of the active object, and takes it back."""
    ob = bpy.context.active_object
    mesh = ob.data.copy()
    bpy.ops.tolvol.decimate(**options)
    count, ob.data = len(ob.data.polygons), mesh
    return count


def data_of(mesh):
    """All that a mesh holds at its vertices, edges, faces and corners, by name."""
    held = {
        name: column(each.data, *KINDS[each.data_type])
        for name, each in mesh.attributes.items()
        if each.data_type in KINDS
    }
    held |= {f"key {key.name}": column(key.data, "co", 3) for key in mesh.shape_keys.key_blocks}
    held |= {f"UV map {layer.name}": column(layer.data, "uv", 2) for layer in mesh.uv_layers}
    held["groups"] = np.array([(i, g.group, g.weight) for i, v in enumerate(mesh.vertices) for g in v.groups])
    held["materials"] = column(mesh.polygons, "material_index", 1, np.int32)
    return held | {"creases": creases(mesh), "corners": column(mesh.loops, "vertex_index", 1, np.int32)}


def test_a_level_has_all_data_that_decimate_keeps():
    ob = dressed_torus()
    level = make(levels=2, percentages=padded(1, 3))[0]
    assert bpy.ops.tolvol.decimate(tolerance_percent=1) == {"FINISHED"}
    wanted, found = data_of(ob.data), data_of(level.data)
    assert wanted.keys() == found.keys() and len(wanted) > 20
    assert [name for name in wanted if not np.array_equal(wanted[name], found[name])] == []


@pytest.mark.parametrize("matrix", [Matrix(), PLACED], ids=["local", "placed"])
def test_each_level_is_proved_against_the_original_and_is_what_decimate_leaves(matrix, capfd):
    ob = torus(matrix=matrix)
    reference, before = world_triangles(ob), column(ob.data.vertices, "co", 3).tobytes()
    size = snapshots.surface_of(ob).size()
    levels = make(levels=3, percentages=padded(0.3, 1, 3))
    assert [level.name for level in levels] == ["torus_LOD1", "torus_LOD2", "torus_LOD3"]
    assert [collection.name for collection in bpy.context.scene.collection.children] == ["torus_LODs"]
    assert bpy.context.selected_objects == [ob]
    assert column(ob.data.vertices, "co", 3).tobytes() == before and ob.tolvol.snapshot is not None
    for level, percent in zip(levels, (0.3, 1, 3)):
        error = level["geometricError"]
        found = native.module.hausdorff(*world_triangles(level), *reference, bound=percent / 100 * size)
        assert found.upper <= percent / 100 * size
        # The property is an upper bound of the true deviation, and narrow.
        assert found.lower <= error <= percent / 100 * size and error <= 1.01 * found.lower
        assert verdict.of(level).kind == verdict.WITHIN and level.tolvol.tolerance_percent == pytest.approx(percent)
    counts = [len(level.data.polygons) for level in levels]
    assert counts == sorted(counts, reverse=True) and counts[0] > 3 * counts[2]
    left = ", ".join(f"{count:,}" for count in counts)
    assert f"Info: 3 levels of torus: 2,304 -> {left} triangles, 3 of 3 PASS, " in capfd.readouterr().out
    activate(ob)
    assert counts == [fresh_count(tolerance_percent=percent) for percent in (0.3, 1, 3)]


def test_the_levels_of_a_decimated_object_are_made_from_its_original():
    ob = torus()
    reference = world_triangles(ob)
    bpy.ops.tolvol.decimate(tolerance_percent=4)
    left = len(ob.data.polygons)
    levels = make(levels=2, percentages=padded(0.2, 1))
    assert all(len(level.data.polygons) > left for level in levels)
    for level, percent in zip(levels, (0.2, 1)):
        assert deviation(level, reference) <= percent / 100 * snapshots.snapshot_size(ob) * 1.001
    assert len(ob.data.polygons) == left


def test_the_reference_may_be_another_object():
    reference = torus("reference", around=96, across=48)
    ob = torus("ob", noise=0)
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", reference
    for level in make(levels=2, percentages=padded(2, 4)):
        assert (
            level["geometricError"]
            >= native.module.hausdorff(*world_triangles(level), *world_triangles(reference)).lower
        )
        assert verdict.of(level).passed


def test_by_count():
    ob = torus()
    reference = world_triangles(ob)
    levels = make(by="COUNT", levels=2, counts=padded(500, 120))
    assert [len(level.data.polygons) for level in levels] == [500, 120]
    for level in levels:
        assert deviation(level, reference) <= level["geometricError"] * 1.001 < 0.1 * snapshots.snapshot_size(ob)
    activate(ob)
    assert fresh_count(tolerance_percent=10, target_triangles=500) == 500


def test_by_pixels_from_a_distance():
    ob = torus()
    make(by="PIXELS", levels=2, pixels=padded(2, 8), distance=5, fov=math.radians(60), height=500)
    across = 2 * 5 * math.tan(math.radians(30))  # what the picture shows from top to bottom
    for level, pixels in zip(ob.tolvol.lods.objects, (2, 8)):
        limit = pixels / 500 * across
        assert level.tolvol.tolerance_mode == "LENGTH"
        assert verdict.of(level).tolerance == pytest.approx(limit, rel=1e-12)
        assert 0.5 * limit < level["geometricError"] <= limit


def test_by_lengths_and_the_settings_of_decimate():
    ob = torus()
    ob.tolvol.placement = "SUBSET"
    ob.tolvol.keep = "ONE"
    ob.tolvol.use_target, ob.tolvol.target_triangles = True, 900
    levels = make(levels=2, in_length=True, lengths=padded(0.02, 0.05))
    before = {tuple(row) for row in column(ob.data.vertices, "co", 3).tolist()}
    for level, limit in zip(levels, (0.02, 0.05)):
        assert {tuple(row) for row in column(level.data.vertices, "co", 3).tolist()} <= before
        assert verdict.of(level).tolerance == limit and verdict.of(level).two_sided
        assert len(level.data.polygons) < 900


def test_another_unit_of_the_levels_keeps_their_tolerances():
    ob = torus()
    lod, size = ob.tolvol.lod, snapshots.surface_of(ob).size()
    percentages = list(lod.percentages)
    lod.in_length = True
    assert list(lod.lengths) == pytest.approx([percent / 100 * size for percent in percentages], rel=1e-6)
    lod.lengths[0] = 0.002 * size
    lod.in_length = True  # It is no change.
    assert lod.lengths[0] == pytest.approx(0.002 * size, rel=1e-6)
    lod.in_length = False
    assert [f"{percent:.6g}" for percent in lod.percentages] == [
        "0.2",
        *(f"{percent:g}" for percent in percentages[1:]),
    ]
    # Adjust Last Operation finds both in the properties of the operator, and the panel in those of the object.
    assert bpy.ops.tolvol.make_lods("EXEC_DEFAULT", True, levels=2, percentages=padded(1, 3)) == {"FINISHED"}
    lod = bpy.context.active_object.tolvol.lod
    for settings in (bpy.context.window_manager.operators[-1].properties, lod):
        assert list(settings.lengths)[:2] == pytest.approx([0.01 * size, 0.03 * size], rel=1e-6)
    make(levels=2, in_length=True, lengths=padded(0.02 * size, 0.04 * size))
    assert list(lod.percentages)[:2] == pytest.approx([2, 4], rel=1e-6) and lod.in_length


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"percentages": padded(1, 0.5)}, "Level 2: 0.5 %, which is not more than the 1 % of level 1"),
        ({"percentages": padded(0.5, 1, 1), "levels": 3}, "Level 3: 1 %, which is not more than the 1 % of level 2"),
        (
            {"in_length": True, "lengths": padded(0.1, 0.05)},
            "Level 2: 5 cm, which is not more than the 10 cm of level 1",
        ),
        ({"in_length": True, "lengths": padded(0.1, 50)}, "Level 2: a tolerance of .* leaves nothing of it"),
        ({"by": "PIXELS", "pixels": padded(2, 2)}, "Level 2: 2 pixels, which is not more than the 2 pixels of level 1"),
        (
            {"by": "COUNT", "counts": padded(100, 200)},
            "Level 2: 200 triangles, which is not fewer than the 100 triangles",
        ),
        ({"by": "COUNT", "counts": padded(9999, 200)}, "Level 1: 9,999 triangles, but torus has 2,304"),
    ],
)
def test_levels_out_of_order_are_refused_by_name(options, said):
    torus()
    before = datablocks()
    with pytest.raises(RuntimeError, match=said.replace(" cm", "\u00a0cm")):
        bpy.ops.tolvol.make_lods(**{"levels": 2, **options})
    assert datablocks() == before


@pytest.mark.parametrize("fails", [0, 1])
def test_a_level_that_fails_leaves_nothing(monkeypatch, fails):
    ob = torus()
    before, calls = datablocks(), []
    decimate = native.module.decimate

    def failing(*arguments, **options):
        calls.append(arguments)
        if len(calls) > fails:
            raise native.module.Cancelled("cancelled") if fails else native.module.TolvolError("broken", "internal")
        return decimate(*arguments, **options)

    monkeypatch.setattr(native.module, "decimate", failing)
    if fails:
        assert bpy.ops.tolvol.make_lods(levels=2) == {"CANCELLED"}
    else:
        with pytest.raises(RuntimeError, match="Level 1: "):
            bpy.ops.tolvol.make_lods(levels=2)
    assert datablocks() == before and ob.tolvol.snapshot is None and ob.tolvol.lods is None


def test_a_mesh_that_blender_cannot_hold_leaves_nothing(monkeypatch):
    from addon.mesh import transfer

    ob = torus()
    before, calls = datablocks(), []
    compare = transfer._compare

    def failing(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise transfer.MeshMismatch("no")
        return compare(*arguments)

    monkeypatch.setattr(transfer, "_compare", failing)
    with pytest.raises(RuntimeError, match="cannot hold"):
        bpy.ops.tolvol.make_lods(levels=2)
    assert datablocks() == before and ob.tolvol.snapshot is None


def test_progress_names_the_level(monkeypatch):
    torus()
    parts = []
    each = Run._next_work
    monkeypatch.setattr(Run, "_next_work", lambda self: (each(self), parts.append(self.operator.part))[0])
    make(levels=3, percentages=padded(1, 2, 3))
    assert parts == ["Level 1 of 3", "Level 2 of 3", "Level 3 of 3"]


def test_uv_maps_materials_and_modifiers_are_kept():
    ob = torus()
    ob.data.uv_layers.new(name="map")
    ob.data.materials.append(bpy.data.materials.new("red"))
    ob.modifiers.new("bevel", "BEVEL")
    for level in make(levels=2, percentages=padded(1, 2)):
        assert level.data.uv_layers.keys() == ["map"] and level.data.materials.keys() == ["red"]
        assert level.modifiers.keys() == ["bevel"] and not level.tolvol.labels


def test_blenders_gltf_exporter_is_told_the_deviation():
    ob = torus()
    level = make(levels=2, percentages=padded(1, 2))[0]
    hook = addon.glTF2ExportUserExtension()
    for extras in (None, {"mine": 1, "tolvol": {"keep": 0}}):
        node = types.SimpleNamespace(extras=extras)
        hook.gather_node_hook(node, level, {})
        assert node.extras == {**({"mine": 1} if extras else {}), "geometricError": level["geometricError"]}
    for other in (ob, None):
        node = types.SimpleNamespace(extras={"mine": 1})
        hook.gather_node_hook(node, other, {})
        assert node.extras == {"mine": 1}


def test_the_original_may_be_shared():
    """Other objects with the same mesh are no obstacle: the mesh stays as it is."""
    ob = torus()
    other = ob.copy()
    bpy.context.collection.objects.link(other)
    levels = make(levels=2, percentages=padded(1, 2))
    assert len(levels) == 2 and ob.data == other.data and len(mesh_io.read_mesh(ob.data).triangles) == 2304
    assert not np.array_equal(mesh_io.read_mesh(levels[0].data).triangles, mesh_io.read_mesh(ob.data).triangles)


def seen():
    return [ob.name for ob in bpy.context.view_layer.objects if ob.visible_get()]


def test_one_of_the_object_and_its_levels_is_shown():
    ob = torus()
    levels = make(levels=3, percentages=padded(0.3, 1, 3))
    assert seen() == ["torus"] and bpy.context.selected_objects == [ob]
    assert not any(level.tolvol.show_deviation for level in levels)
    chain = [ob, *levels]
    for number in (1, 3, 2, 0):
        assert bpy.ops.tolvol.show_level(level=number) == {"FINISHED"}
        assert seen() == [chain[number].name] and bpy.context.selected_objects == [chain[number]]
        assert bpy.context.active_object == chain[number]
        assert [each.hide_render for each in chain] == [i != number for i in range(4)]


def test_levels_are_made_again_of_the_object_while_a_level_is_shown():
    ob = torus()
    make(levels=2, percentages=padded(0.3, 1))
    bpy.ops.tolvol.show_level(level=1)
    ob.tolvol.lod.levels, ob.tolvol.lod.percentages = 3, padded(0.3, 1, 2)
    assert bpy.ops.tolvol.make_lods() == {"FINISHED"}
    levels = list(ob.tolvol.lods.objects)
    assert [level.name for level in levels] == ["torus_LOD1", "torus_LOD2", "torus_LOD3"]
    assert seen() == ["torus"] and bpy.context.active_object == ob


def test_a_chain_leaves_the_object_as_it_is_in_renders():
    ob = torus()
    ob.hide_render = True
    make(levels=2, percentages=padded(0.3, 1))
    assert ob.hide_render and all(level.hide_render for level in ob.tolvol.lods.objects)
    assert bpy.ops.tolvol.make_lods() == {"FINISHED"}
    assert ob.hide_render and seen() == ["torus"]


def test_a_chain_leaves_a_hidden_object_hidden():
    ob = torus()
    ob.hide_render = True
    ob.hide_set(True)
    for _ in range(2):
        make(levels=2, percentages=padded(0.3, 1))
        assert ob.hide_render and ob.hide_get() and seen() == []


def test_levels_whose_object_was_deleted_are_objects_of_their_own():
    ob = torus()
    levels = make(levels=2, percentages=padded(0.3, 1))
    bpy.ops.tolvol.show_level(level=1)
    with bpy.context.temp_override(selected_objects=[ob]):
        bpy.ops.object.delete()
    assert "torus" not in bpy.context.scene.objects
    assert bpy.context.active_object == levels[0] and not bpy.ops.tolvol.show_level.poll()
    assert bpy.ops.tolvol.make_lods() == {"FINISHED"}
    assert seen() == [levels[0].name] and levels[0].tolvol.lods is not None


def test_the_levels_of_a_second_chain_have_the_names_and_the_collection():
    ob = torus()
    earlier = make(levels=2, percentages=padded(0.3, 1))
    levels = make(levels=2, percentages=padded(1, 3))
    assert [level.name for level in levels] == ["torus_LOD1", "torus_LOD2"]
    assert set(bpy.data.collections["torus_LODs"].objects) == set(levels) and ob.tolvol.lods.name == "torus_LODs"
    assert set(bpy.data.collections["torus_LODs_earlier"].objects) == set(earlier)


@pytest.mark.parametrize("how", ["exclude", "hide_viewport"])
def test_a_level_in_a_hidden_collection_is_not_shown_and_nothing_is_hidden(how):
    torus()
    make(levels=2, percentages=padded(0.3, 1))
    layer = bpy.context.view_layer.layer_collection.children["torus_LODs"]
    setattr(layer, how, True)
    with pytest.raises(RuntimeError, match="show the collection first"):
        bpy.ops.tolvol.show_level(level=1)
    assert seen() == ["torus"]
    setattr(layer, how, False)
    assert bpy.ops.tolvol.show_level(level=1) == {"FINISHED"} and seen() == ["torus_LOD1"]


def test_a_copy_of_the_object_has_no_levels():
    ob = torus()
    make(levels=2, percentages=padded(0.3, 1))
    copy = ob.copy()
    bpy.context.collection.objects.link(copy)
    bpy.context.view_layer.objects.active = copy
    assert not bpy.ops.tolvol.show_level.poll()


def test_a_level_of_an_earlier_chain_is_hidden_like_the_others():
    ob = torus()
    earlier = make(levels=2, percentages=padded(0.3, 1))
    assert bpy.ops.tolvol.make_lods() == {"FINISHED"}
    earlier[0].hide_set(False)
    bpy.context.view_layer.objects.active = earlier[0]
    assert bpy.ops.tolvol.show_level(level=2) == {"FINISHED"}
    assert seen() == [ob.tolvol.lods.objects[1].name]


def test_without_levels_there_is_none_to_show():
    torus()
    assert not bpy.ops.tolvol.show_level.poll()
