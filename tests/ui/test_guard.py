# SPDX-License-Identifier: GPL-3.0-or-later
"""The guards, with Blender's own tools in a real window."""

import subprocess

import bpy
import numpy as np
from mathutils import Euler

import scenes
from addon import guard, mesh_io, native
from window import centre, key, region, reset, screenshot, view, xdotool

TOLERANCE = 0.02


def sheet(count=120, z=0.0):
    """A flat square that is its own reference, seen from above."""
    ob = scenes.sheet(count=count, bumps=z)
    ob.tolvol.tolerance_mode, ob.tolvol.tolerance_length = "LENGTH", TOLERANCE
    bpy.ops.tolvol.set_reference()


def ob():
    return bpy.data.objects["sheet"]


def look(tilt=0.0):
    camera = view()[1].spaces[0].region_3d
    camera.view_perspective, camera.view_distance = "ORTHO", 3.0
    camera.view_location, camera.view_rotation = (0, 0, 0), Euler((tilt, 0, 0)).to_quaternion()


def mode(name):
    with window_context():
        bpy.ops.object.mode_set("EXEC_DEFAULT", True, mode=name)


def window_context():
    return bpy.context.temp_override(window=view()[0], area=view()[1], region=region("WINDOW"))


def coordinates():
    if ob().mode == "EDIT":
        ob().update_from_editmode()
    return mesh_io.column(ob().data.vertices, "co", 3)


def forward(reference):
    """The largest distance from the reference, certified, in tolerances."""
    return native.module.hausdorff(*scenes.world_triangles(ob()), *reference, bound=TOLERANCE).upper / TOLERANCE


def stroke(*points):
    """The left mouse button down along these places."""
    steps = ["mousemove", *points[0], "sleep", 0.2, "mousedown", 1]
    for point in points[1:]:
        steps += ["mousemove", *point, "sleep", 0.05]
    hand = subprocess.Popen(["xdotool", *map(str, steps), "mouseup", "1"])
    while hand.poll() is None:
        yield 0.1
    yield 0.5


def across(length=200, steps=12):
    x, y = centre()
    return [(x - length // 2 + i * length // steps, y + 3 * (i % 2)) for i in range(steps + 1)]


def test_guard_sculpting_by_mouse():
    yield from reset(sheet)
    look()
    reference, before = scenes.world_triangles(ob()), coordinates()
    ob().tolvol.guard.sculpting = True
    yield 0.3
    mode("SCULPT")
    yield 0.5
    assert guard.sculpt.watches.shown(ob()).on
    sculpting = bpy.context.tool_settings.sculpt
    sculpting.brush.strength = 1.0
    start = coordinates()
    yield from stroke(*across())
    yield 0.5
    screenshot("guard 1 stroke")
    after = coordinates()
    print("forward", forward(reference), [*guard.states(ob())])
    assert 0.95 < forward(reference) <= 1
    assert np.array_equal(start, before)
    touched = (after != before).any(1)
    assert 0 < touched.sum() < len(before) / 2
    held = guard.sculpt.watches.shown(ob()).held_back
    assert 0 < held <= touched.sum()
    assert [*guard.states(ob())] == [("sculpting", f"Held back {held:,} vertices", True)]
    yield from stroke(*across())
    again = coordinates()
    assert forward(reference) <= 1
    for keys, expected in (("ctrl+z", after), ("ctrl+z", before), ("ctrl+shift+z", after), ("ctrl+shift+z", again)):
        key(keys)
        yield 0.8
        assert np.array_equal(coordinates(), expected), keys
    mode("OBJECT")
    yield 0.3
    assert guard.sculpt.watches.shown(ob()) is None


def test_guard_editing_by_keys():
    yield from reset(lambda: sheet(20))
    look(np.pi / 2)
    reference = scenes.world_triangles(ob())
    ob().tolvol.guard.editing = True
    mode("EDIT")
    with window_context():
        bpy.ops.mesh.select_all("EXEC_DEFAULT", True, action="SELECT")
    yield 0.5
    states = [coordinates()]
    x, y = centre()

    def grab(far, slowly):
        xdotool("mousemove", x, y)
        yield 0.3
        key("g")
        yield 0.3
        for share in (0.2, 0.5, 0.8, 1) if slowly else (1,):
            xdotool("mousemove", x + int(share * far / 8), y - int(share * far))
            yield 0.1 if slowly else 0.0
        xdotool("click", 1)
        yield 0.6
        states.append(coordinates())
        print(forward(reference), [*guard.states(ob())])
        assert not np.array_equal(states[-1], states[-2])
        assert 0.95 < forward(reference) <= 1

    yield from grab(60, True)
    yield from grab(-60, False)
    screenshot("guard 2 grabbed")
    for keys, state in (("ctrl+z", 1), ("ctrl+z", 0), ("ctrl+shift+z", 1), ("ctrl+shift+z", 2)):
        key(keys)
        yield 0.8
        print(keys, coordinates()[:,2].max(), coordinates()[:,2].min(), np.abs(coordinates()-states[state]).max())
        assert np.array_equal(coordinates(), states[state]), keys
    mode("OBJECT")


def cage():
    """A lattice around the sheet, its modifier on it."""
    data = bpy.data.lattices.new("cage")
    data.points_u = data.points_v = 4
    lattice = bpy.data.objects.new("cage", data)
    bpy.context.collection.objects.link(lattice)
    lattice.scale = 0.8, 0.8, 1
    ob().modifiers.new("lattice", "LATTICE").object = lattice
    return lattice


def evaluated():
    """The deformed mesh in the world."""
    surface = ob().evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    arrays = mesh_io.read_mesh(surface)
    return mesh_io.to_world(arrays.vertices, mesh_io.matrix_array(ob().matrix_world)), arrays.triangles


def test_guard_lattice_by_keys():
    yield from reset(lambda: (sheet(40), cage()))
    look(np.pi / 2)
    reference = scenes.world_triangles(ob())
    ob().tolvol.guard.lattice = True
    lattice = bpy.data.objects["cage"]
    scenes.activate(lattice)
    mode("EDIT")
    yield 0.5
    x, y = centre()
    print([*guard.states(ob())])
    with window_context():
        bpy.ops.lattice.select_all("EXEC_DEFAULT", True, action="SELECT")
    yield 0.5
    states = [mesh_io.column(lattice.data.points, "co_deform", 3)]
    for far, slowly in ((60, True), (-80, False)):
        xdotool("mousemove", x, y)
        yield 0.3
        key("g")
        yield 0.3
        for share in (0.2, 0.5, 0.8, 1) if slowly else (1,):
            xdotool("mousemove", x + int(share * far / 8), y - int(share * far))
            yield 0.1 if slowly else 0.0
        xdotool("click", 1)
        yield 0.6
        far = native.module.hausdorff(*evaluated(), *reference, bound=TOLERANCE)
        states.append(mesh_io.column(lattice.data.points, "co_deform", 3))
        print(far.upper / TOLERANCE, [*guard.states(ob())], states[-1][:, 2].max())
        screenshot("guard 3 lattice")
    for keys, state in (("ctrl+z", 1), ("ctrl+z", 0), ("ctrl+shift+z", 1), ("ctrl+shift+z", 2)):
        key(keys)
        yield 0.8
        now = mesh_io.column(bpy.data.lattices["cage"].points, "co_deform", 3)
        far = native.module.hausdorff(*evaluated(), *reference, bound=TOLERANCE)
        print(keys, np.abs(now - states[state]).max(), far.upper / TOLERANCE)
