# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit Modifier to Tolerance: the promise on the stored mesh, and the best setting."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.job.run import Run
from addon.mesh import mesh_io
from addon.mesh.evaluation import Evaluation
from addon.operators import fit, fit_modifier
from addon.proof import kept_warnings, verdict
from addon.reference import snapshots
from addon.shared.errors import NotProved
from modified import PLACED, coordinates, modified, refused
from scenes import add_object, torus, world_triangles


@pytest.mark.parametrize("matrix", [Matrix(), PLACED], ids=["local", "placed"])
@pytest.mark.parametrize(("kind", "settings"), [("DECIMATE", None), ("REMESH", {"mode": "VOXEL"}), ("WELD", None)])
def test_fitted_is_within_both_ways_and_much_smaller(kind, settings, matrix):
    ob = modified(kind, matrix, settings)
    mesh, reference = ob.data.name, world_triangles(ob)
    tolerance = 0.02 * snapshots.surface_of(ob).size()
    ob.tolvol.tolerance_percent = 2
    assert bpy.ops.tolvol.fit_modifier() == {"FINISHED"}
    stored = world_triangles(ob)
    for pair in ((stored, reference), (reference, stored)):
        assert native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance).upper <= tolerance
    assert len(stored[1]) < 0.85 * len(reference[1])
    assert verdict.of(ob).kind == verdict.WITHIN
    assert not ob.modifiers and ob.data.name == mesh and len(bpy.data.scenes) == 1


def test_within_3_percent_of_the_best_of_200_certified_settings():
    ob = modified("DECIMATE")
    reference, tolerance = world_triangles(ob), 0.01 * snapshots.surface_of(ob).size()
    best = len(reference[1])
    with Evaluation(ob, "DECIMATE") as evaluation:
        for ratio in np.geomspace(4 / best, 1, 200):
            evaluation.modifier.ratio = ratio
            arrays = mesh_io.read_mesh(evaluation.mesh())
            pair = arrays.vertices.astype(np.float64), arrays.triangles
            ways = ((reference, pair), (pair, reference))
            if all(
                native.module.directed_hausdorff(*one, *other, bound=tolerance).upper <= tolerance
                for one, other in ways
            ):
                best = min(best, len(arrays.triangles))
    bpy.ops.tolvol.fit_modifier()
    assert len(world_triangles(ob)[1]) <= 1.03 * best < 500


def test_the_search_finds_lone_values_before_the_others():
    rng, worse = np.random.default_rng(5), 0
    for _ in range(100):
        place, noise = rng.uniform(0.01, 0.5), rng.uniform(0, 0.3)
        phase = rng.uniform(0, 100)

        def deviation(value, place=place, noise=noise, phase=phase):
            return place / value * (1 + noise * np.sin(60 * np.log(value) + phase))

        search, sent, tries = fit.search(0.001, 1.0), None, 0
        while True:
            try:
                value = search.send(sent)
            except StopIteration as end:
                found = end.value
                break
            sent, tries = deviation(value), tries + 1
        samples = np.geomspace(0.001, 1.0, 200)
        best = samples[deviation(samples) <= 1].min()
        assert deviation(found) <= 1 and tries < 100
        worse += found > 1.03 * best
    assert worse <= 1  # The search may miss values in a range of less than half a step.


def searched(deviation, most, near=None):
    """Returns (the value that a search finds, how many values it tries)."""
    search, sent, tries = fit.search(0.0001, 1.0, most, near), None, 0
    while True:
        try:
            value = search.send(sent)
        except StopIteration as end:
            return end.value, tries
        sent, tries = deviation(value), tries + 1


@pytest.mark.parametrize("place", [0.002, 0.02, 0.11, 0.7])
def test_a_large_mesh_needs_few_values_and_comes_near_to_the_best(place):
    most = fit.most_values(70_000)
    assert most == 6 and fit.most_values(1_000) == 99
    for slope in (0.6, 0.75, 1.1):
        for near, tried in ((None, 8), (0.7 * place, most), (place, most), (1.4 * place, most)):
            found, tries = searched(lambda value, slope=slope: (place / value) ** slope, tried, near)
            assert tries <= tried and place <= found <= 1.08 * place


@pytest.mark.parametrize("near", [0.0001, 0.0003, 0.003, 0.2, 1.0])
def test_a_search_that_begins_far_from_the_limit_finds_it_all_the_same(near):
    found, tries = searched(lambda value: (0.01 / value) ** 0.75, 12, near)
    assert tries <= 12 and 0.01 <= found <= 1.08 * 0.01


def test_a_search_ends_where_nothing_is_within():
    assert searched(lambda value: 2 + 1 / value, 8)[0] is None
    assert searched(lambda value: 0.5, 8) == (0.0001, 1)


def test_a_mesh_of_which_only_the_proof_shows_that_it_is_beyond_is_passed_over(monkeypatch):
    ob = modified("DECIMATE")
    reference, tolerance = world_triangles(ob), 0.01 * snapshots.surface_of(ob).size()
    tried, certified = [], fit_modifier._Trial.certified

    def beyond(_progress):
        raise NotProved("beyond")

    def first_is_beyond(trial, arrays):
        tried.append(len(arrays.triangles))
        return beyond if len(tried) == 1 else certified(trial, arrays)

    monkeypatch.setattr(fit_modifier._Trial, "certified", first_is_beyond)
    bpy.ops.tolvol.fit_modifier()
    assert tried[0] <= tried[1] <= tried[-1] == len(world_triangles(ob)[1]) < len(reference[1])
    for pair in ((world_triangles(ob), reference), (reference, world_triangles(ob))):
        assert native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance).upper <= tolerance


def nothing_is_proved(monkeypatch):
    def beyond(_progress):
        raise NotProved("beyond")

    monkeypatch.setattr(fit_modifier._Trial, "certified", lambda *_: beyond)


def test_a_fit_of_which_no_value_is_proved_changes_nothing(monkeypatch):
    ob = modified("DECIMATE")
    nothing_is_proved(monkeypatch)
    none = "No Ratio of DECIMATE leaves fewer than the 1,024 triangles of DECIMATE within the tolerance"
    remedy = "Take a larger tolerance, or press Decimate, which leaves 166$"
    refused(f"{none}. {remedy}", bpy.ops.tolvol.fit_modifier)
    # With these samples the search finds values at which the modifier removes no triangle.
    monkeypatch.setattr(fit_modifier.measure, "sampled_distance", lambda points, *_: 0.0 if len(points) > 500 else 9.0)
    refused(f"{none}. {remedy}", bpy.ops.tolvol.fit_modifier)
    # With these it finds none, not even the end of the range.
    monkeypatch.setattr(fit_modifier.measure, "sampled_distance", lambda *_: 9.0)
    cut = "the modifier may cut bent quads along the other diagonal, which takes them beyond the tolerance"
    refused(f"{none}: {cut}. {remedy}", bpy.ops.tolvol.fit_modifier)
    assert ob.tolvol.snapshot is None


def test_a_value_is_found_if_samples_miss_the_largest_deviation_of_all_that_the_search_has_found(monkeypatch):
    ob = modified("DECIMATE")
    reference, tolerance = world_triangles(ob), 0.01 * snapshots.surface_of(ob).size()
    proofs, measured, certified = [], fit_modifier._Trial.measured, fit_modifier._Trial.certified

    def half_of_it(trial, arrays):
        work = measured(trial, arrays)
        return lambda progress: work(progress) / 2

    def noted(trial, arrays):
        proofs.append(len(arrays.triangles))
        return certified(trial, arrays)

    monkeypatch.setattr(fit_modifier._Trial, "measured", half_of_it)
    monkeypatch.setattr(fit_modifier._Trial, "certified", noted)
    assert bpy.ops.tolvol.fit_modifier() == {"FINISHED"}
    now = world_triangles(ob)
    assert len(proofs) > 2 and len(now[1]) == max(proofs) < len(reference[1])
    for pair in ((now, reference), (reference, now)):
        assert native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance).upper <= tolerance


def test_a_search_that_is_ended_keeps_the_best_so_far(monkeypatch):
    ob = modified("DECIMATE")
    asked, advance, measured = [], Run.advance, fit_modifier._Trial.measured

    def until_one_is_within(run):
        if run._job is not None and run.operator.improving():
            run.progress.finish()
        return advance(run)

    def noted(trial, arrays):
        asked.append(len(arrays.triangles))
        return measured(trial, arrays)

    monkeypatch.setattr(Run, "advance", until_one_is_within)
    monkeypatch.setattr(fit_modifier._Trial, "measured", noted)
    bpy.ops.tolvol.fit_modifier()
    assert len(asked) < 8 and len(world_triangles(ob)[1]) in asked and verdict.of(ob).passed
    assert any("Decimate leaves" in warning for warning in kept_warnings.of(ob)[0])


def test_a_search_that_is_ended_before_a_value_is_proved_says_that_nothing_was_changed(monkeypatch):
    ob = modified("DECIMATE")
    before, advance = world_triangles(ob), Run.advance

    def until_one_is_within(run):
        if run._job is not None and run.operator.improving():
            run.progress.finish()
        return advance(run)

    monkeypatch.setattr(Run, "advance", until_one_is_within)
    nothing_is_proved(monkeypatch)
    proved = "and no Ratio of DECIMATE was proved to keep DECIMATE within the tolerance both ways"
    refused(f"The search was ended, {proved}. Nothing was changed: take a larger", bpy.ops.tolvol.fit_modifier)
    assert ob.tolvol.snapshot is None and ob.modifiers and (world_triangles(ob)[1] == before[1]).all()


def test_a_search_says_how_many_of_its_values_are_tried(monkeypatch):
    modified("DECIMATE")
    told, work = [], Run._next_work

    def next_work(self):
        found = work(self)
        told.append((self.operator.part, self.operator.share))
        return found

    monkeypatch.setattr(Run, "_next_work", next_work)
    assert bpy.ops.tolvol.fit_modifier() == {"FINISHED"}
    most = fit.most_values(1024)
    searching = [share for part, share in told if part == "Fitting DECIMATE"]
    # The second search, which measures exactly, begins anew.
    first, second = np.split(searching, np.flatnonzero(np.array(searching) == 0)[1:])
    for each in (first, second):
        assert list(each) == [i / most for i in range(len(each))] and len(each) > 5
    assert {share for part, share in told if part != "Fitting DECIMATE"} == {0.0}


def test_says_if_decimate_would_leave_fewer_triangles():
    ob = modified("DECIMATE")
    before = ob.data.copy()
    bpy.ops.tolvol.fit_modifier()
    fitted, (warning, *_) = len(world_triangles(ob)[1]), kept_warnings.of(ob)[0]
    ob.data = before
    bpy.ops.tolvol.decimate()
    plain = len(world_triangles(ob)[1])
    said = "The button Decimate leaves fewer triangles within this tolerance"
    assert warning == f"{said}: {plain:,}, and the modifier DECIMATE {fitted:,}"
    assert plain < fitted


def test_a_fit_that_leaves_more_triangles_says_so_while_it_searches_and_afterwards(monkeypatch):
    bpy.ops.mesh.primitive_cube_add()
    ob = bpy.context.object
    ob.modifiers.new("Boxes", "REMESH")
    ob.tolvol.tolerance_percent = 2
    told, each = [], Run._next_work
    monkeypatch.setattr(Run, "_next_work", lambda self: (each(self), told.append(self.operator.count))[0])
    assert bpy.ops.tolvol.fit_modifier() == {"FINISHED"}
    left = len(world_triangles(ob)[1])
    assert left > 100 and f"{left:,} triangles, unproved, 12 before" in told
    more = f"Boxes leaves {left:,} triangles, more than the 12 that there were: undo it unless its new faces are wanted"
    fewer = f"The button Decimate leaves fewer triangles within this tolerance: 12, and the modifier Boxes {left:,}"
    assert kept_warnings.of(ob)[0] == [more, fewer]


def test_a_fit_that_leaves_no_triangle_fewer_changes_nothing_and_says_why():
    ob = torus()
    ob.modifiers.new("fewer", "DECIMATE")
    ob.tolvol.tolerance_percent = 1e-3
    none = "No Ratio of fewer leaves fewer than the 2,304 triangles of torus within the tolerance"
    quads = ": the modifier may cut bent quads along the other diagonal, which takes them beyond the tolerance"
    refused(f"{none}{quads}. Take a larger tolerance$", bpy.ops.tolvol.fit_modifier)
    ob.tolvol.tolerance_percent = 0.2
    refused(
        f"{none}{quads}. Take a larger tolerance, or press Decimate, which leaves 840$", bpy.ops.tolvol.fit_modifier
    )
    ob.modifiers.new("triangles", "TRIANGULATE").quad_method = "FIXED"
    bpy.ops.object.modifier_apply(modifier="triangles")
    ob.tolvol.tolerance_percent = 1e-3
    refused(f"{none}. Take a larger tolerance$", bpy.ops.tolvol.fit_modifier)
    ob.tolvol.tolerance_percent = 0.2
    assert bpy.ops.tolvol.fit_modifier() == {"FINISHED"}, "no quad is cut any more"
    assert len(ob.data.polygons) < 2304 and not ob.modifiers


def test_the_fewest_triangles_are_told_until_the_fit_ends(monkeypatch):
    told, advance = [], Run.advance

    def noted(run):
        told.append((run.operator.doing, run.operator.count))
        return advance(run)

    monkeypatch.setattr(Run, "advance", noted)
    ob = modified("DECIMATE")
    bpy.ops.tolvol.fit_modifier()
    count = f"{len(world_triangles(ob)[1]):,} triangles"
    first = next(i for i, (_, said) in enumerate(told) if said)
    assert "Comparing with Decimate" in [doing for doing, _ in told[:first]]
    searching = [said for _, said in told[first:]]
    assert all(searching) and searching[0].endswith(" triangles, unproved") and searching[-1] == count


def test_a_value_that_is_given_is_certified_and_not_searched_for():
    ob = modified("DECIMATE")
    before = len(world_triangles(ob)[1])
    refused("Not proved", bpy.ops.tolvol.fit_modifier, value=0.05)
    ob.modifiers[0].keyframe_insert("ratio", frame=1)
    ob.modifiers[0].keyframe_insert("ratio", frame=20)
    bpy.ops.tolvol.fit_modifier(value=0.75)
    assert len(world_triangles(ob)[1]) == pytest.approx(0.75 * before, abs=2)
    assert verdict.of(ob).kind == verdict.WITHIN


def test_no_setting_and_no_range_of_settings():
    ob = modified("REMESH", settings={"mode": "BLOCKS"})
    fit_modifier = bpy.ops.tolvol.fit_modifier
    refused("REMESH of REMESH: Set the modifier to Voxel", fit_modifier, modifier="REMESH")
    ob.modifiers[0].mode = "VOXEL"
    refused("choose Replace or New Object", fit_modifier, result="SHAPE_KEY")
    ob.shape_key_add(name="Basis")
    refused("remove the shape keys first", fit_modifier, modifier="REMESH")
    ob = add_object("needle", [(0, 0, 0), (1, 0, 0), (0, 1e-3, 0)], [(0, 1, 2)])
    ob.modifiers.new("Remesh", "REMESH")
    ob.tolvol.tolerance_percent = 1e-3
    refused("No Voxel Size of Remesh keeps needle within the tolerance", fit_modifier)


def test_new_object_of_a_fit_keeps_materials_and_uvs():
    ob = modified("DECIMATE")
    ob.data.materials.append(bpy.data.materials.new("steel"))
    ob.data.uv_layers.new(name="map")
    ob.vertex_groups.new(name="all").add(range(len(ob.data.vertices)), 1.0, "REPLACE")
    ob.data["made by"] = "hand"
    before = coordinates(ob)
    bpy.ops.tolvol.fit_modifier(result="OBJECT", value=0.45)
    new = bpy.context.active_object
    assert np.array_equal(coordinates(ob), before) and len(ob.modifiers) == 1 and not new.modifiers
    assert new.data.materials[0].name == "steel" and new.data.uv_layers[0].name == "map"
    assert new.data.vertices[0].groups[0].weight == 1.0 and new.data["made by"] == "hand"
    assert len(new.data.polygons) < 500 and verdict.of(new).backward_within
    assert ob.tolvol.modifiers.result == "OBJECT"
