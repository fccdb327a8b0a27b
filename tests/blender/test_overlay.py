# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Deviation without a window: its computations, and the reasons why it draws nothing. tests/ui tests the drawing."""

import copy
import threading

import bpy
import numpy as np
import pytest

import addon
from addon import native, overlay, preferences
from addon.mesh import mesh_io
from addon.overlay import draw, field, legend, reasons, shares, surface, work
from addon.overlay.scale import Scale, rounded_up
from addon.reference import snapshots, tolerances
from scenes import add_object, sheet, torus, world_triangles


def with_reference(ob):
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    return ob


def test_on_after_set_reference_and_without_a_window_neither_drawn_nor_a_crash():
    ob = with_reference(torus())
    assert ob.tolvol.show_deviation and ob.tolvol.deviation_kind == "SIGNED"
    handlers = len(bpy.app.handlers.depsgraph_update_post)
    for value in (False, True):
        ob.tolvol.show_deviation = value
        ob.tolvol.deviation_opacity = 0.3
    assert not overlay.shows(ob) and len(bpy.app.handlers.depsgraph_update_post) == handlers
    assert reasons.hidden(ob) == "Blender runs without a window"


def test_every_change_of_a_reference_is_told_and_the_listener_leaves_with_the_addon():
    told = []
    snapshots.listeners.append(lambda: told.append(True))
    try:

        def tells(change):
            told.clear()
            change()
            return bool(told)

        ob = torus()
        bpy.ops.ed.undo_push(message="start")
        assert tells(bpy.ops.tolvol.set_reference)
        bpy.ops.ed.undo_push(message="set")
        assert tells(lambda: setattr(ob.tolvol, "tolerance_percent", 2))
        assert tells(lambda: setattr(ob.tolvol, "show_deviation", False))
        assert tells(bpy.ops.ed.undo) and tells(bpy.ops.ed.redo)
        assert tells(bpy.ops.tolvol.clear_reference)
        assert tells(lambda: bpy.ops.wm.read_factory_settings(use_empty=True))
    finally:
        snapshots.listeners.pop()
    assert overlay.refresh in snapshots.listeners
    addon.unregister()
    try:
        assert overlay.refresh not in snapshots.listeners
    finally:
        addon.register()


def test_reasons_follow_preference_reference_and_mode(monkeypatch):
    monkeypatch.setattr(reasons, "off", lambda: None)
    ob = torus()
    assert "Set the reference" in reasons.hidden(ob)
    with_reference(ob)
    assert reasons.hidden(ob) is None
    ob.tolvol.reference_kind = "OBJECT"
    assert "out of date: another kind of reference was chosen" in reasons.hidden(ob)
    ob.tolvol.reference_kind = "SELF"
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    assert "Sculpt Mode" in reasons.hidden(ob)
    bpy.ops.object.mode_set(mode="SCULPT")
    assert reasons.hidden(ob) is None
    bpy.ops.sculpt.dynamic_topology_toggle()
    assert "Dyntopo" in reasons.hidden(ob)


def test_a_preference_turns_drawing_off(monkeypatch):
    monkeypatch.setattr(reasons.bpy, "app", type("app", (), {"background": False}))
    assert reasons.off() is None
    monkeypatch.setattr(preferences, "use_gl", lambda _context: False)
    assert "turned off in the add-on's preferences" in reasons.off()


def test_the_surface_is_what_the_view_shows():
    def read(ob):
        found = surface.Surface()
        found.update(ob, bpy.context.evaluated_depsgraph_get())
        return found

    ob = sheet(count=4)
    assert (len(read(ob).vertices), len(read(ob).triangles)) == (25, 32)
    ob.modifiers.new("subdivision", "SUBSURF").levels = 1
    assert len(read(ob).triangles) == 128
    ob.modifiers.clear()
    ob.shape_key_add(name="Basis")
    key = ob.shape_key_add(name="up")
    key.data.foreach_set("co", (np.ones(75, np.float32)))
    key.value = 1
    assert np.allclose(read(ob).vertices, 1)
    ob.active_shape_key_index = 1
    bpy.ops.object.mode_set(mode="SCULPT")
    assert np.allclose(read(ob).vertices, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.shape_key_clear()
    ob.data.polygons[3].hide = True
    assert len(read(ob).triangles) == 32
    bpy.ops.object.mode_set(mode="EDIT")
    assert len(read(ob).triangles) == 30


def test_a_surface_is_read_again_only_after_a_change():
    ob = sheet(count=4)
    found, depsgraph = surface.Surface(), bpy.context.evaluated_depsgraph_get()
    found.update(ob, depsgraph)
    ob.data.vertices[7].co.z += 1
    ob.data.update()
    bpy.context.view_layer.update()
    found.update(ob, depsgraph)
    assert found.changes == 1
    found.touch(False)
    found.update(ob, depsgraph)
    assert found.changes == 2 and found.vertices[7, 2] > 0.9
    found.touch(False)
    found.update(ob, depsgraph)
    assert found.changes == 2, "it was the same"


def scale(tolerance=1.0, signed=True, reach=None, bands=0):
    return Scale(tolerance, signed, tolerance if reach is None else reach, bands)


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
    assert len(scale().edges()) == 5 and len(scale(signed=False).edges()) == 9
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
    monkeypatch.setattr(work, "later", lambda _about, _seconds, prepare, finish: finish(prepare()(None), None))
    ob = with_reference(torus())
    reference = world_triangles(ob)
    ob.data.vertices[0].co.z += 0.3
    ob.data.update()
    bpy.context.view_layer.update()
    shown = surface.Surface()
    shown.update(ob, bpy.context.evaluated_depsgraph_get())
    found, settings = field._prepare(ob.name, 0.05)(None), ob.tolvol

    def present():
        draw._shares(ob, shown, found, draw.scale_of(bpy.context, ob, found.tree))
        return draw.scale_of(bpy.context, ob, found.tree)

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
    assert present().reach == field.finest(found.tree) > 1e-9
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
    found = field._prepare(ob.name, 0.05)(None)
    assert present().reach == tolerances.tolerance_length(settings, settings.snapshot_size)  # Nothing deviates.
    shares.forget()


def test_shares_of_another_tolerance_or_mesh_are_left_blank(monkeypatch):
    ob = with_reference(torus())
    found = surface.Surface()
    found.update(ob, bpy.context.evaluated_depsgraph_get())
    waiting = []
    monkeypatch.setattr(work, "later", lambda _about, _seconds, prepare, finish: waiting.append((prepare, finish)))
    made = field._prepare(ob.name, 0.05)(None)

    def known(tolerance):
        return shares.known(ob, found, made, scale(tolerance), False, lambda: None)

    def count():
        prepare, finish = waiting.pop()
        finish(prepare()(None), None)

    assert known(0.05) is None
    count()
    assert sum(known(0.05)) == pytest.approx(1) and not waiting
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
    began, outcomes = threading.Event(), []

    class LongTree:
        """Counts again and again, as long as it takes with a large mesh."""

        def shares(self, *mesh, progress, **place):
            try:
                while True:
                    made.tree.shares(*mesh, progress=progress, **place)
                    began.set()
            except Exception as error:
                outcomes.append(error)
                raise

    slow = copy.copy(made)
    slow.tree = LongTree()
    assert shares.known(ob, found, slow, scale(0.05), False, lambda: None) is None
    work._tick()
    assert began.wait(60) and not outcomes
    work.stop()  # waits for the thread
    assert len(outcomes) == 1 and isinstance(outcomes[0], native.module.Cancelled)
    shares.forget()


def test_an_object_of_edges_alone_has_no_surface():
    ob = add_object("edge", [(0, 0, 0), (1, 0, 0)], [])
    found = surface.Surface()
    found.update(ob, bpy.context.evaluated_depsgraph_get())
    assert len(found.triangles) == 0
