# SPDX-License-Identifier: GPL-3.0-or-later
"""The guards, with Blender's own tools in a real window."""

import contextlib
from unittest import mock

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Euler

import scenes
from addon import guard, native
from addon.mesh import mesh_io
from addon.panels.guard import TOLVOL_PT_guard
from addon.shared.surface import to_world
from panels_open import alone
from window import (
    at_rest,
    centre,
    find_setting,
    finished,
    key,
    on_screen,
    open_tab,
    region,
    reset,
    screenshot,
    view,
    window_context,
    xdotool,
)

TOLERANCE = 0.02
# Where brushes are at work the sheet is seen from afar: the colours on it are computed for each of its pixels.
FAR, BRUSH = 7.5, 20  # the distance of the view, and pixels


def sheet(count=60, z=0.0):
    """Makes a flat square that is its own reference, seen from above."""
    ob = scenes.sheet(count=count, bumps=z)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", TOLERANCE
    bpy.ops.tolvol.set_reference()


def ob():
    return bpy.data.objects["sheet"]


def look(tilt=0.0, distance=3.0):
    camera = view()[1].spaces[0].region_3d
    camera.view_perspective, camera.view_distance = "ORTHO", distance
    camera.view_location, camera.view_rotation = (0, 0, 0), Euler((tilt, 0, 0)).to_quaternion()


def mode(name):
    with window_context():
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=name)


def coordinates():
    if ob().mode == "EDIT":
        ob().update_from_editmode()
    return mesh_io.column(ob().data.vertices, "co", 3)


def forward(reference):
    """Returns the certified largest distance from the reference, in tolerances."""
    return (
        native.module.directed_hausdorff(*scenes.world_triangles(ob()), *reference, bound=TOLERANCE).upper / TOLERANCE
    )


@contextlib.contextmanager
def small_brush():
    """Has brushes the size that belongs to the view from afar."""
    settings = bpy.context.tool_settings.unified_paint_settings
    usual, settings.size = settings.size, BRUSH
    try:
        yield
    finally:
        settings.size = usual


def stroke(*points):
    """Drags the mouse with the left button along these places."""
    xdotool("mousemove", *points[0])
    yield
    xdotool("mousedown", 1)
    for point in points[1:]:
        yield
        xdotool("mousemove", *point)
    yield
    xdotool("mouseup", 1)
    yield


def across(length=80, steps=6):
    """Returns places along a line that begins near the edge of the sheet and ends near its middle."""
    middle = region("WINDOW")
    x, y = on_screen(middle, middle.width // 2 - 70, middle.height // 2)
    return [(x - length // 2 + i * length // steps, y + i % 2) for i in range(steps + 1)]


def switch(setting):
    """Clicks a switch in the sidebar."""
    if (yield from find_setting(f"tolvol.guard.{setting}")) is None:
        screenshot(f"guard without {setting}")
        raise AssertionError(f"no switch {setting}")
    xdotool("click", 1)
    yield


def undone_and_redone(read, *steps):
    """Takes pairs (keys, coordinates). Presses the keys and compares the coordinates bit for bit."""
    for keys, expected in steps:
        key(keys)
        yield from finished(lambda: np.array_equal(read(), expected))  # noqa: B023


def test_guard_sculpting_by_mouse():
    yield from reset(lambda: sheet(30))
    look(distance=FAR)
    reference, before = scenes.world_triangles(ob()), coordinates()
    with alone(TOLVOL_PT_guard), small_brush():
        yield from open_tab()
        yield from switch("sculpting")
        mode("SCULPT")
        yield
        assert np.array_equal(coordinates(), before)
        bpy.context.tool_settings.sculpt.brush.strength = 1.0
        yield from stroke(*across())
        screenshot("guard 1 stroke")
    after = coordinates()
    assert 0.95 < forward(reference) <= 1
    touched = (after != before).any(1)
    held = guard.sculpt.watches.shown(ob()).held_back
    assert 0 < held <= touched.sum() < len(before) / 2
    assert [*guard.states(ob())] == [("sculpting", f"Held back {held:,} vertices", True)]
    with small_brush():
        yield from stroke(*across())
    again = coordinates()
    assert forward(reference) <= 1
    undo, redo = "ctrl+z", "ctrl+shift+z"
    yield from undone_and_redone(coordinates, (undo, after), (undo, before), (redo, after), (redo, again))
    mode("OBJECT")
    yield
    assert guard.sculpt.watches.shown(ob()) is None


def test_guard_other_brushes():
    yield from reset(lambda: sheet(z=0.1))
    look(1.0, FAR)
    reference = scenes.world_triangles(ob())
    ob().tolvol.guard.sculpting = True
    mode("SCULPT")
    yield
    with small_brush():
        for name in ("Grab", "Snake Hook", "Pose", "Cloth", "Inflate/Deflate", "Smooth"):
            bpy.context.tool_settings.sculpt.brush = bpy.data.brushes[name]
            before = coordinates()
            # A brush begins where a ray meets the surface.
            way = [ob().data.vertices[60 * 31 + 10 + 4 * i].co[:] for i in range(10)]
            with window_context():
                bpy.ops.sculpt.brush_stroke("EXEC_DEFAULT", True, stroke=[_sample(i, at) for i, at in enumerate(way)])
            yield
            assert not np.array_equal(coordinates(), before), name
            assert forward(reference) <= 1, name
    assert forward(reference) > 0.95
    mode("OBJECT")


def _sample(i, at):
    place = location_3d_to_region_2d(region("WINDOW"), view()[1].spaces[0].region_3d, at)
    sample = {
        "name": "",
        "location": at,
        "mouse": place,
        "mouse_event": place,
        "pressure": 1,
        "size": BRUSH,
        "time": i / 50,
    }
    return sample | {"is_start": i == 0, "pen_flip": False, "x_tilt": 0, "y_tilt": 0}


def grab(far, slowly=False):
    """Presses G, moves the mouse up the screen by so many pixels, and clicks."""
    x, y = centre()
    xdotool("mousemove", x, y)
    yield
    key("g")
    yield
    for share in (0.2, 0.5, 0.8, 1) if slowly else (1,):
        xdotool("mousemove", x + int(share * far / 8), y - int(share * far))
        if slowly:
            yield
    xdotool("mousemove", x + far // 8, y - far, "click", 1)
    yield


def test_guard_editing_by_keys():
    yield from reset(lambda: sheet(20))
    look(np.pi / 2)
    reference = scenes.world_triangles(ob())
    ob().tolvol.guard.editing = True
    mode("EDIT")
    with window_context():
        bpy.ops.mesh.select_all("EXEC_DEFAULT", True, action="SELECT")
    yield
    states = [coordinates()]
    for far, slowly in ((60, True), (-60, False)):
        yield from grab(far, slowly)
        yield from finished(lambda: 0.95 < forward(reference) <= 1)
        states.append(coordinates())
        assert not np.array_equal(states[-1], states[-2])
    screenshot("guard 2 grabbed")
    undo, redo = "ctrl+z", "ctrl+shift+z"
    steps = (undo, states[1]), (undo, states[0]), (redo, states[1]), (redo, states[2])
    yield from undone_and_redone(coordinates, *steps)
    # New faces that leave the tolerance are removed again, also after a redo, but not while an operator runs.
    with window_context():
        bpy.ops.mesh.solidify("EXEC_DEFAULT", True, thickness=0.5)
        bpy.ops.transform.translate("INVOKE_DEFAULT", True)
    with mock.patch.object(guard.undo, "_send_move", wraps=guard.undo._send_move) as send:
        yield from finished(lambda: send.called)
    xdotool("mousemove_relative", 0, -30)
    yield
    assert len(coordinates()) > len(states[2])
    xdotool("click", 1)
    yield
    for _ in range(2):
        for step in (5, -5):
            xdotool("mousemove_relative", "--", step, 0)
            yield
        yield from finished(lambda: np.array_equal(coordinates(), states[2]))
        screenshot("guard 3 solidify undone")
        key("ctrl+shift+z")
        yield from at_rest()
    xdotool("mousemove_relative", 5, 0)
    yield from finished(lambda: np.array_equal(coordinates(), states[2]))
    # The faces of an extrusion are inside at first, and then move as far as the tolerance permits.
    key("e")
    yield
    xdotool("mousemove_relative", 0, 100)
    yield
    xdotool("click", 1)
    yield from finished(lambda: len(coordinates()) == 2 * len(states[0]) and forward(reference) <= 1)
    mode("OBJECT")


def test_guard_undoes_an_edit_of_the_faces_while_the_mouse_rests():
    yield from reset(lambda: sheet(20))
    look(np.pi / 2)
    ob().tolvol.guard.editing = True
    mode("EDIT")
    with window_context():
        bpy.ops.mesh.select_all("EXEC_DEFAULT", True, action="SELECT")
    yield from at_rest()
    before = coordinates()
    with window_context():
        bpy.ops.mesh.solidify("EXEC_DEFAULT", True, thickness=0.5)
    assert len(coordinates()) > len(before)
    yield from finished(lambda: np.array_equal(coordinates(), before))
    # The edit is not undone while an operator runs, but once that has ended.
    with window_context():
        bpy.ops.mesh.solidify("EXEC_DEFAULT", True, thickness=0.5)
        bpy.ops.transform.translate("INVOKE_DEFAULT", True)
    with mock.patch.object(guard.undo, "_send_move", wraps=guard.undo._send_move) as send:
        yield from finished(lambda: send.called)
    yield  # The operator takes the mouse move that would undo the edit.
    assert len(coordinates()) > len(before)
    key("Return")
    yield from finished(lambda: np.array_equal(coordinates(), before))
    mode("OBJECT")


def cage():
    """Adds a lattice around the sheet, and its modifier to the sheet."""
    data = bpy.data.lattices.new("cage")
    data.points_u = data.points_v = 4
    lattice = bpy.data.objects.new("cage", data)
    bpy.context.collection.objects.link(lattice)
    lattice.scale = 0.8, 0.8, 1
    ob().modifiers.new("lattice", "LATTICE").object = lattice
    scenes.activate(lattice)


def points():
    return mesh_io.column(bpy.data.lattices["cage"].points, "co_deform", 3)


def deformed(reference):
    """Returns the same as forward(), for the mesh that the viewport shows."""
    arrays = mesh_io.read_mesh(ob().evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh())
    vertices = to_world(arrays.vertices, mesh_io.matrix_array(ob().matrix_world))
    return native.module.directed_hausdorff(vertices, arrays.triangles, *reference, bound=TOLERANCE).upper / TOLERANCE


def test_guard_lattice_by_keys():
    yield from reset(lambda: (sheet(40), cage()))
    look(np.pi / 2)
    reference = scenes.world_triangles(ob())
    ob().tolvol.guard.lattice = True
    mode("EDIT")
    with window_context():
        bpy.ops.lattice.select_all("EXEC_DEFAULT", True, action="SELECT")
    yield
    states = [points()]
    for far, slowly in ((60, True), (-80, False)):
        yield from grab(far, slowly)
        states.append(points())
        assert not np.array_equal(states[-1], states[-2])
        assert 0.9 < deformed(reference) <= 1
    screenshot("guard 4 lattice")
    undo, redo = "ctrl+z", "ctrl+shift+z"
    yield from undone_and_redone(points, (undo, states[1]), (undo, states[0]), (redo, states[1]), (redo, states[2]))
    assert deformed(reference) <= 1
    mode("OBJECT")
