# SPDX-License-Identifier: GPL-3.0-or-later
"""The scale of the colours of Show Deviation: its bands and range, and the shares of the surface that have each colour."""

import copy

import bpy
import numpy as np
import pytest

from addon import native
from addon.background import queue
from addon.mesh import mesh_io
from addon.overlay import coloured, draw, field, legend, shaders, shares, surface
from addon.overlay.scale import Scale, rounded_up
from addon.proof import verdict
from addon.reference import tolerances
from coloured_scenes import scale, with_reference
from scenes import sheet, torus, world_triangles


def folded(scale, distances):
    """Folds the shares of a surface that has equally many places at each of these distances."""
    ends = [-np.inf, *scale.edges(), np.inf]
    counts, _ = np.histogram(distances, ends)
    counts[-1] += counts[0]  # What is farther than all edges, on either side, is in the last share.
    counts[0] = 0
    return scale.fold(counts / len(distances))


def test_bands_of_the_legend():
    distances = [-1.5, -0.9, -0.6, -0.1, 0.0, 0.3, 0.6, 0.9, 0.95, 1.2]
    assert folded(scale(), distances) == pytest.approx([0.2, 0.1, 0.2, 0.3, 0.2])
    assert folded(scale(signed=False), distances) == pytest.approx([0.2, 0.1, 0.2, 0.3, 0.2])
    edges = scale().edges()
    assert {-1, -0.5, 0, 0.5, 1} <= {*edges} and (np.diff(edges) > 0).all()
    said = [legend.percent(share).replace("\u00a0", " ") for share in (0, 1e-5, 0.0123, 0.99999, 1)]
    assert said == ["0.0 %", "< 0.1 %", "1.2 %", "> 99.9 %", "100.0 %"]


def test_as_many_bands_are_counted_as_are_shown():
    distances = np.linspace(-0.99, 0.99, 1000)
    for bands in (2, 9, 20):
        *shown, outside = folded(scale(bands=bands), distances)
        assert len(shown) == bands and outside == 0 and shown == pytest.approx([1 / bands] * bands, abs=0.01)
        *shown, outside = folded(scale(signed=False, bands=bands), distances)
        assert len(shown) == bands and shown == pytest.approx([1 / bands] * bands, abs=0.01)
    assert len(folded(scale(bands=0), distances)) == 5


def test_a_range_beyond_the_tolerance_colours_what_is_outside_and_a_shorter_one_ends_in_its_last_colour():
    distances = [-30.0, -2.5, -0.9, 0.2, 0.9, 2.5]
    # Both parts that are beyond the tolerance have a band. What is very far away has none, but is outside.
    assert folded(scale(reach=3.0, bands=3), distances) == pytest.approx([1 / 6, 3 / 6, 1 / 6, 3 / 6])
    assert folded(scale(reach=0.5, bands=2), distances) == pytest.approx([1 / 6, 2 / 6, 3 / 6])
    assert folded(scale(reach=0.5, signed=False, bands=2), distances) == pytest.approx([1 / 6, 2 / 6, 3 / 6])


@pytest.mark.parametrize(
    ("distance", "up"), ((0.1, 0.1), (0.101, 0.12), (7.2, 8.0), (9.1, 10.0), (0.00034, 0.0004), (2, 2))
)
def test_an_automatic_range_ends_at_a_round_number(distance, up):
    assert rounded_up(distance) == pytest.approx(up, rel=1e-12)


def test_the_range_is_the_tolerance_a_fixed_length_or_the_largest_distance(monkeypatch):
    monkeypatch.setattr(queue, "later", lambda _about, _seconds, prepare, finish: finish(prepare()(None), None))
    ob = with_reference(torus())
    reference = world_triangles(ob)
    ob.data.vertices[0].co.z += 0.3
    ob.data.update()
    bpy.context.view_layer.update()
    shown = surface.Surface()
    shown.update(ob, bpy.context.evaluated_depsgraph_get())
    settings = ob.tolvol

    def present():
        for _ in range(3):  # The first call has the tree made, the second has the largest distance measured.
            what, _ = coloured.of(ob, shown)
            drawn = what and draw.with_scales(bpy.context, {ob: what})
        return drawn[ob].scale

    def farthest():
        (vertices, triangles), points = reference, mesh_io.column(ob.data.vertices, "co", 3)
        return native.module.ToleranceVolume(vertices, triangles, 0.1).distance(points).max()

    tolerance = tolerances.tolerance_length(settings, settings.snapshot_size)
    assert present() == Scale(tolerance, True, tolerance, 0)
    settings.use_bands, settings.band_count, settings.deviation_kind = True, 7, "MAGNITUDE"
    assert present() == Scale(tolerance, False, tolerance, 7)
    settings.deviation_range, settings.deviation_limit = "FIXED", 0.3
    assert present().reach == 0.3
    settings.deviation_limit = 1e-12
    assert present().reach == field.finest(field.at_hand(ob).tree) > 1e-9
    settings.deviation_range = "AUTOMATIC"
    assert present().reach == rounded_up(farthest()) and farthest() > 2 * tolerance
    ob.data.vertices[0].co.z += 1
    ob.data.update()
    bpy.context.view_layer.update()
    shown.touch(True)
    shown.update(ob, bpy.context.evaluated_depsgraph_get())
    assert present().reach == rounded_up(farthest()) and farthest() > 0.8
    shares.forget()
    bpy.ops.tolvol.set_reference(replace=True)
    assert present().reach == tolerances.tolerance_length(settings, settings.snapshot_size)  # Nothing deviates.
    shares.forget()


def test_the_range_ends_at_the_largest_distance_although_all_vertices_lie_on_the_reference(monkeypatch):
    monkeypatch.setattr(queue, "later", lambda _about, _seconds, prepare, finish: finish(prepare()(None), None))
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6)
    ob = with_reference(bpy.context.object)
    assert bpy.ops.tolvol.decimate(placement="SUBSET") == {"FINISHED"}
    ob.tolvol.deviation_range, ob.tolvol.tolerance_percent = "AUTOMATIC", 2
    shown = surface.Surface()
    shown.update(ob, bpy.context.evaluated_depsgraph_get())
    for _ in range(3):
        what, _ = coloured.of(ob, shown)
        drawn = what and draw.with_scales(bpy.context, {ob: what})
    largest = verdict.of(ob).forward
    assert 0.98 * largest.lower <= drawn[ob].scale.reach <= 1.3 * largest.upper
    shares.forget()


def test_selected_objects_have_one_scale_as_the_active_one_demands(monkeypatch):
    monkeypatch.setattr(queue, "later", lambda _about, _seconds, prepare, finish: finish(prepare()(None), None))
    objects, found = [sheet(bumps=0.0), torus()], {}
    for ob, percent, height in zip(objects, (1, 2), (0.38, 0.0)):
        bpy.ops.object.select_all(action="DESELECT")
        bpy.context.view_layer.objects.active = ob
        ob.select_set(True)
        ob.tolvol.tolerance_percent = percent
        with_reference(ob).data.vertices[0].co.z += height
        ob.data.update()
    bpy.context.view_layer.update()
    for ob in objects:
        shown = surface.Surface()
        shown.update(ob, bpy.context.evaluated_depsgraph_get())
        found[ob] = [coloured.of(ob, shown) for _ in range(2)][1][0]
    plane, ring = objects

    def scales():
        for _ in range(2):
            drawn = draw.with_scales(bpy.context, found)
        return [drawn[ob].scale for ob in objects]

    each = [coloured.tolerance_of(ob) for ob in objects]
    alone = scales()
    assert [scale.reach for scale in alone] == each and [scale.signed for scale in alone] == [False, True]
    plane.select_set(True)
    together = scales()
    assert {scale.reach for scale in together} == {max(each)} and [scale.tolerance for scale in together] == each
    assert not any(scale.signed for scale in together), "the sheet has no sides"
    ring.tolvol.deviation_range, ring.tolvol.use_bands, ring.tolvol.band_count = "AUTOMATIC", True, 6
    ring.tolvol.deviation_palette = "NOMINAL"
    assert [(scale.reach, scale.bands) for scale in scales()] == [(0.4, 6)] * 2
    assert {drawn.palette for drawn in draw.with_scales(bpy.context, found).values()} == {"NOMINAL"}
    shares.forget()


def test_shares_of_several_objects_count_by_their_areas():
    small, large = (shares.Shares([part, 1 - part], 0.0, [part], area) for part, area in ((1.0, 1.0), (0.2, 3.0)))
    both = shares.together([small, large])
    assert both.bands == pytest.approx([0.4, 0.6]) and both.area == 4 and both.histogram == pytest.approx([0.4])
    assert shares.together([small, None]) is None


def test_colours_from_green_to_red():
    for signed, first in ((False, (60, 190, 90)), (True, (40, 60, 200))):
        table = shaders.colours_of(signed, "NOMINAL")
        assert tuple(table[0]) == first and tuple(table[-1]) == (215, 40, 40)
    assert tuple(table[len(table) // 2]) == (60, 190, 90), "nothing is green"


def test_shares_of_another_tolerance_or_mesh_are_left_blank(monkeypatch):
    ob = with_reference(torus())
    found = surface.Surface()
    found.update(ob, bpy.context.evaluated_depsgraph_get())
    waiting = []
    monkeypatch.setattr(queue, "later", lambda _about, _seconds, prepare, finish: waiting.append((prepare, finish)))
    field._fields[field.key_of(ob)] = field._prepare(ob.name, 0.05)(None)

    def known(tolerance):
        return shares.known(ob.name, coloured.of(ob, found)[0], scale(tolerance))

    def count():
        prepare, finish = waiting.pop()
        finish(prepare()(None), None)

    assert known(0.05) is None
    count()
    counted = known(0.05)
    assert sum(counted.bands) + counted.outside == pytest.approx(1) and not waiting
    assert sum(counted.histogram) == pytest.approx(sum(counted.bands)) and len(counted.histogram) == 48
    assert known(0.04) is None
    count()
    assert known(0.04) is not None and known(0.05) is None
    count()
    ob.data.vertices[0].co.z += 1
    ob.data.update()
    bpy.context.view_layer.update()
    found.touch(True)
    found.update(ob, bpy.context.evaluated_depsgraph_get())
    assert known(0.05) is None
    shares.forget()


def test_the_count_of_shares_is_cancelled_in_its_middle():
    ob = with_reference(torus())
    found = surface.Surface()
    found.update(ob, bpy.context.evaluated_depsgraph_get())
    made = field._prepare(ob.name, 0.05)(None)
    began, outcomes = [], []

    class LongTree:
        """Counts again and again, as long as it takes with a large mesh."""

        def shares(self, *mesh, progress, **place):
            try:
                while True:
                    made.tree.shares(*mesh, progress=progress, **place)
                    began.append(1)
            except Exception as error:
                outcomes.append(error)
                raise

    slow = copy.copy(made)
    slow.tree = LongTree()
    what = coloured.Coloured(found, np.eye(4), np.eye(4), slow, True, True)
    assert shares.known(ob.name, what, scale(0.05)) is None
    queue._tick()
    while not began:
        native.module.pause(0.01)
    assert not outcomes
    queue.stop()  # waits for the thread
    assert len(outcomes) == 1 and isinstance(outcomes[0], native.module.Cancelled)
    shares.forget()
