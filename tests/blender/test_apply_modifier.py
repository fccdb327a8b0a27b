# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply Modifier in Tolerance: the promise on the stored mesh, and what is applied."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.mesh.mesh_io import column
from addon.operators.motion import BENT
from addon.proof import kept_warnings, verdict
from addon.reference import snapshots
from addon.shared.surface import to_world
from modified import PLACED, coordinates, evaluated, modified, refused
from scenes import activate, plates_with_t_junctions, world_triangles

KEEPING = {
    "SMOOTH": {"iterations": 30},
    "CORRECTIVE_SMOOTH": {"rest_source": "ORCO", "use_only_smooth": True, "iterations": 30},
    "LAPLACIANSMOOTH": {"iterations": 5, "lambda_factor": 3.0},
    "LATTICE": None,
    "SHRINKWRAP": None,
    "DISPLACE": {"strength": 0.2},
    "CAST": {"factor": 0.3},
}


@pytest.mark.parametrize("matrix", [Matrix(), PLACED], ids=["local", "placed"])
@pytest.mark.parametrize("kind", KEEPING)
def test_keeps_the_tolerance_and_goes_as_far(kind, matrix):
    ob = modified(kind, matrix, KEEPING[kind])
    reference, before, wished = world_triangles(ob), coordinates(ob), evaluated(ob)
    tolerance = 0.01 * snapshots.surface_of(ob).size()
    beyond = native.module.directed_hausdorff(to_world(wished, np.array(ob.matrix_world)), reference[1], *reference)
    assert beyond.lower > 1.1 * tolerance
    assert bpy.ops.tolvol.apply_modifier(modifier=kind) == {"FINISHED"}
    stored = world_triangles(ob)
    judged = native.module.hausdorff(*stored, *reference, bound=tolerance)
    assert 0.9 * tolerance < judged.upper <= tolerance
    assert not ob.modifiers and verdict.of(ob).kind == verdict.WITHIN
    # Each vertex lies on its way.
    way, went = wished - before, coordinates(ob) - before
    share = (went * way).sum(1) / np.maximum((way * way).sum(1), 1e-20)
    assert np.abs(went - share[:, None] * way).max() < 1e-5 and share.min() > -1e-6 and share.max() < 1 + 1e-4


def test_what_stays_within_is_what_blender_shows_bit_for_bit():
    ob = modified("SMOOTH", settings={"iterations": 1, "factor": 0.3})
    ob.tolvol.tolerance_percent = 10
    wished = evaluated(ob)
    bpy.ops.tolvol.apply_modifier()
    assert np.array_equal(coordinates(ob), wished)


def test_what_holds_t_junctions_together_stays_and_the_panel_says_so():
    ob = plates_with_t_junctions()
    activate(ob)
    ob.modifiers.new("DISPLACE", "DISPLACE").strength = 0.1
    before = coordinates(ob)
    between = before[:, 0] == 0
    bpy.ops.tolvol.apply_modifier()
    moved = (coordinates(ob) != before).any(1)
    assert not moved[between].any() and moved[~between].any()
    warnings, _ = kept_warnings.of(ob)
    assert warnings == [f"{between.sum()} vertices hold T-junctions together and cannot move"]


def test_says_of_a_mesh_that_is_its_own_reference_only_that_its_bent_quads_stay():
    ob = modified("SMOOTH", settings={"iterations": 5})
    ob.tolvol.tolerance_percent = 0.2
    assert bpy.ops.tolvol.apply_modifier() == {"FINISHED"}
    assert verdict.word(ob) == verdict.PASS
    assert kept_warnings.of(ob)[0] == [BENT]


def test_acts_on_the_base_mesh_without_other_modifiers_keys_and_animation():
    ob = modified("DISPLACE", settings={"strength": 0.02})
    ob.tolvol.tolerance_percent = 10
    alone = evaluated(ob)
    ob.modifiers["DISPLACE"].keyframe_insert("strength", frame=1)
    ob.modifiers.new("first", "CAST").factor = 0.2
    bpy.ops.object.modifier_move_up(modifier="first")
    ob.modifiers.new("last", "SUBSURF")
    ob.modifiers["DISPLACE"].show_viewport = False
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="up")
    for point in key.data:
        point.co.z += 0.25
    key.value = 1.0
    bpy.ops.tolvol.apply_modifier(modifier="DISPLACE")
    assert np.abs(coordinates(ob) - alone).max() < 1e-6
    assert [modifier.name for modifier in ob.modifiers] == ["first", "last"]
    basis, up = (column(block.data, "co", 3) for block in ob.data.shape_keys.key_blocks)
    assert np.array_equal(basis, coordinates(ob)) and np.abs(up - basis - [0, 0, 0.25]).max() < 1e-6


def test_new_object_leaves_this_one_alone():
    ob = modified("SMOOTH", PLACED, {"iterations": 30})
    before, reference, tolerance = coordinates(ob), world_triangles(ob), 0.01 * snapshots.surface_of(ob).size()
    bpy.ops.tolvol.apply_modifier(result="OBJECT")
    new = bpy.context.active_object
    assert new != ob and new.select_get() and not ob.select_get() and new.data != ob.data
    assert np.array_equal(coordinates(ob), before) and len(ob.modifiers) == 1 and not new.modifiers
    assert native.module.directed_hausdorff(*world_triangles(new), *reference, bound=tolerance).upper <= tolerance
    assert not np.array_equal(coordinates(new), before)
    assert verdict.of(new).kind == verdict.WITHIN and ob.tolvol.snapshot is None
    assert np.array_equal(column(new.tolvol.snapshot.vertices, "co", 3), before)


def test_shape_key_holds_the_result_and_the_base_stays():
    ob = modified("SMOOTH", settings={"iterations": 30})
    before, reference, tolerance = coordinates(ob), world_triangles(ob), 0.01 * snapshots.surface_of(ob).size()
    bpy.ops.tolvol.apply_modifier(result="SHAPE_KEY")
    assert np.array_equal(coordinates(ob), before) and not ob.modifiers
    basis, key = ob.data.shape_keys.key_blocks
    assert np.array_equal(column(basis.data, "co", 3), before) and (key.name, key.value) == ("SMOOTH", 1.0)
    assert ob.tolvol.modifiers.result == "SHAPE_KEY"
    stored = column(key.data, "co", 3).astype(np.float64)
    judged = native.module.directed_hausdorff(stored, reference[1], *reference, bound=tolerance)
    assert 0.9 * tolerance < judged.upper <= tolerance
    assert np.abs(evaluated(ob) - column(key.data, "co", 3)).max() < 1e-6


def test_one_undo_step_brings_mesh_and_modifier_back():
    for operator, kind in (("apply_modifier", "SMOOTH"), ("fit_modifier", "WELD")):
        ob = modified(kind)
        before = coordinates(ob)
        bpy.ops.ed.undo_push(message="start")
        getattr(bpy.ops.tolvol, operator)("EXEC_DEFAULT", True)
        assert not np.array_equal(coordinates(bpy.data.objects[kind]), before)
        bpy.ops.ed.undo()
        ob = bpy.data.objects[kind]
        assert np.array_equal(coordinates(ob), before) and ob.modifiers[0].type == kind
        assert ob.tolvol.snapshot is None and len(bpy.data.scenes) == 1


def test_what_cannot_be_applied_is_refused():
    ob = modified("SUBSURF")
    refused("SUBSURF of SUBSURF: This modifier changes the faces and has no setting to fit", modifier="SUBSURF")
    refused("SUBSURF has no modifier that can be used here")
    refused("SUBSURF has no modifier else", modifier="else")
    ob.modifiers.clear()
    refused("SUBSURF has no modifiers")
    for kind, match in (("LATTICE", "does not move"), ("DECIMATE", "use Fit instead"), ("CLOTH", "A simulation")):
        modifier = ob.modifiers.new(kind, kind)
        refused(match, modifier=kind)
        ob.modifiers.remove(modifier)
    group = bpy.data.node_groups.new("cut", "GeometryNodeTree")
    if bpy.app.version < (4, 0):
        group.inputs.new("NodeSocketGeometry", "Geometry")
        group.outputs.new("NodeSocketGeometry", "Geometry")
    else:
        for way in ("INPUT", "OUTPUT"):
            group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, cut, end = (group.nodes.new(n) for n in ("NodeGroupInput", "GeometryNodeTriangulate", "NodeGroupOutput"))
    group.links.new(start.outputs[0], cut.inputs[0])
    group.links.new(cut.outputs[0], end.inputs[0])
    ob.modifiers.new("nodes", "NODES").node_group = group
    refused("nodes changes the faces of SUBSURF", modifier="nodes")
