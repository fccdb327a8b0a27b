# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Deviation without a window: its computations, and the reasons why it draws nothing. tests/ui tests the drawing."""

import bmesh
import bpy
import numpy as np
import pytest

import addon
from addon import overlay, preferences
from addon.background import queue
from addon.overlay import coloured, field, reasons, shares, surface
from addon.reference import snapshots
from coloured_scenes import scale, with_reference
from scenes import add_object, sheet, sheet_arrays, torus


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
    found.touch(True)
    found.update(ob, depsgraph)
    assert found.changes == 2, "so were its triangles"


def reference_shown(ob):
    """Returns what is coloured of `ob` if that is its reference, once the tree of the mesh has been made."""
    ob.tolvol.deviation_surface = "REFERENCE"
    shown = surface.Surface()
    shown.update(ob, bpy.context.evaluated_depsgraph_get())
    return [coloured.of(ob, shown) for _ in range(2)][1][0]


@pytest.mark.parametrize("own", (True, False))
def test_the_reference_is_coloured_by_its_distance_from_the_present_mesh(monkeypatch, own):
    monkeypatch.setattr(queue, "later", lambda _about, _seconds, prepare, finish: finish(prepare()(None), None))
    ob = sheet(count=20, bumps=0.0)
    if not own:
        ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", sheet("other", count=20, bumps=0.0)
        bpy.context.view_layer.objects.active = ob
    with_reference(ob)
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(ob.data)
    lost = [face for face in edited.faces if face.calc_center_median().length < 0.5]
    share = len(lost) / len(edited.faces)
    bmesh.ops.delete(edited, geom=lost, context="FACES")
    next(face for face in edited.faces).hide = True  # What is hidden is still there.
    bmesh.update_edit_mesh(ob.data)
    bpy.ops.object.mode_set(mode="OBJECT")
    ob.location.x += 0.5
    bpy.context.view_layer.update()
    what = reference_shown(ob)
    corners = what.triangles.vertices
    assert len(what.triangles.triangles) == 800 and not what.signed and what.present
    # A reference of its own moves along with the object, another object's stays.
    expected = 0 if own else 0.5
    distance = what.tree.signed_distance(corners, to_world=what.to_world)
    at_the_edge = np.abs(corners[:, 0] + 1) < 1e-6
    assert np.abs(distance[at_the_edge]) == pytest.approx(expected, abs=1e-5)
    middle = np.linalg.norm(corners, axis=1) < 1e-6
    if own:
        assert np.abs(distance[middle]).min() > 0.4
        counted = shares.known(ob.name, what, scale(0.01, False)) or shares.known(ob.name, what, scale(0.01, False))
        assert counted.outside == pytest.approx(share, abs=0.02) and counted.area == pytest.approx(4)
    shares.forget()
    field.keep_only_meshes(set())


def test_a_tree_of_the_mesh_before_its_last_change_is_known_as_such(monkeypatch):
    monkeypatch.setattr(queue, "later", lambda _about, _seconds, prepare, finish: finish(prepare()(None), None))
    ob = with_reference(sheet(count=10, bumps=0.0))
    ob.tolvol.deviation_surface = "REFERENCE"
    shown = surface.Surface()
    shown.update(ob, bpy.context.evaluated_depsgraph_get())
    what = [coloured.of(ob, shown) for _ in range(2)][1][0]
    assert what.present
    for change in (lambda: setattr(ob.data.vertices[0].co, "z", 1), lambda: setattr(ob, "scale", (2, 1, 1))):
        change()
        ob.data.update()
        bpy.context.view_layer.update()
        shown.touch(False)
        shown.update(ob, bpy.context.evaluated_depsgraph_get())
        # The views show it, but no shares of it are counted, until the next tree is there.
        old, _ = coloured.of(ob, shown)
        assert not old.present and shares.known(ob.name, old, scale(0.01, False)) is None
        assert coloured.of(ob, shown)[0].present
    field.keep_only_meshes(set())
    shares.forget()


def test_far_from_its_origin_an_untouched_mesh_does_not_deviate():
    """A shader has float32 alone: the places in the frame are computed in double precision."""
    far = np.array([1e5, -2e5, 3e4])
    vertices, faces = sheet_arrays(count=20)
    ob = with_reference(add_object("far", (vertices + far).astype(np.float32), faces))
    shown = surface.Surface()
    shown.update(ob, bpy.context.evaluated_depsgraph_get())
    made = field._prepare(ob.name, 0.01)(None)
    framed = surface.framed(shown.vertices, field.vertex_to_frame(made, ob))
    corners = made.tree.corners[:, :3]
    nearest = np.array([np.abs(corners - place).sum(1).min() for place in framed[:: len(framed) // 20]])
    assert nearest.max() < made.tree.ROUNDING


def test_the_end_of_the_overlay_leaves_the_other_tasks_in_the_queue():
    ended = []
    for kind in (*field.TASKS, *shares.TASKS, "measuring"):
        queue.later((kind, "it"), 0, lambda kind=kind: lambda _progress: kind, lambda kind, _error: ended.append(kind))
    queue.stop(*field.TASKS, *shares.TASKS)
    while queue._waiting or queue._running is not None:
        queue._tick()
    assert ended == ["measuring"] and bpy.app.timers.is_registered(queue._tick)
    queue.stop()
    assert not bpy.app.timers.is_registered(queue._tick)


def test_an_object_of_edges_alone_has_no_surface():
    ob = add_object("edge", [(0, 0, 0), (1, 0, 0)], [])
    found = surface.Surface()
    found.update(ob, bpy.context.evaluated_depsgraph_get())
    assert len(found.triangles) == 0
