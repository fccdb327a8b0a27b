# SPDX-License-Identifier: GPL-3.0-or-later
"""The warnings of the last operation stay with the object until the next, and the vertices that they are about are found."""

import bpy
import numpy as np
import pytest

from addon.mesh import mesh_io
from addon.operators import staying
from addon.proof import kept_warnings
from addon.shared.decimation import ISLANDS
from scenes import activate, sheet, torus


def islands(ob, count):
    """Gives the first `count` faces of `ob` a UV island each, and all other faces one island together."""
    mesh = ob.data
    corners = mesh_io.column(mesh.loops, "vertex_index", 1, np.int32)
    uvs = mesh_io.column(mesh.vertices, "co", 3)[corners, :2]
    faces = np.repeat(np.arange(len(mesh.polygons)), mesh_io.column(mesh.polygons, "loop_total", 1, np.int32))
    uvs += np.where(faces < count, 10 + faces, 0)[:, None]
    mesh.uv_layers.new(name="map").data.foreach_set("uv", uvs.astype(np.float32).ravel())
    return ob


def selected(mesh):
    return mesh_io.column(mesh.vertices, "select", 1, bool)


def test_the_vertices_where_islands_meet_are_selected_exactly():
    ob = islands(sheet(count=20), 60)  # the faces of three rows
    before = mesh_io.column(ob.data.vertices, "co", 3)
    # Of the 4 x 21 vertices of three rows, those between two faces of one's own and a third one see three islands or more.
    meets = np.zeros(len(before), bool)
    for vertex in range(len(before)):
        around = [face.index for face in ob.data.polygons if vertex in face.vertices]
        meets[vertex] = len({index if index < 60 else 60 for index in around}) > 2
    assert 40 < meets.sum() < 100
    assert bpy.ops.tolvol.decimate(tolerance_percent=2) == {"FINISHED"}
    _, counts = kept_warnings.of(ob)
    assert counts[ISLANDS] == meets.sum() and len(ob.data.vertices) < len(before)
    assert bpy.ops.tolvol.select_staying("EXEC_DEFAULT", True) == {"FINISHED"}
    assert ob.mode == "EDIT" and tuple(bpy.context.tool_settings.mesh_select_mode) == (True, False, False)
    bpy.ops.object.mode_set(mode="OBJECT")
    places = {place.tobytes() for place in mesh_io.column(ob.data.vertices, "co", 3)[selected(ob.data)]}
    assert places == {place.tobytes() for place in before[meets]}


def test_warnings_stay_through_edits_until_the_next_operation():
    ob = islands(torus(), 48 * 24)
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    (warning,), counts = kept_warnings.of(ob)
    assert warning.startswith("1,152 of 1,152 vertices have to stay") and counts[ISLANDS] == 1152
    ob.data.vertices[0].co.z += 1e-4
    ob.data.update()
    assert kept_warnings.of(ob)[0] == [warning]
    ob.tolvol.snapshot = None
    assert bpy.ops.tolvol.smooth() == {"FINISHED"}
    assert kept_warnings.of(ob) == ([], {})
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and kept_warnings.of(ob)[0]
    ob.data.uv_layers.remove(ob.data.uv_layers[0])
    assert bpy.ops.tolvol.decimate() == {"FINISHED"}
    assert kept_warnings.of(ob) == ([], {})


def test_restoring_the_original_ends_the_warnings():
    ob = islands(torus(), 48 * 24)
    assert bpy.ops.tolvol.decimate() == {"FINISHED"} and kept_warnings.of(ob)[0]
    assert bpy.ops.tolvol.restore_original() == {"FINISHED"}
    assert kept_warnings.of(ob) == ([], {})


@pytest.mark.parametrize(
    "text",
    ("{", "[]", '{"operation": "decimate"}', '{"operation": "decimate", "warnings": 3}', "[" * 9999),
    ids=range(5),
)
def test_damaged_warnings_are_none(text):
    ob = torus()
    ob.tolvol.warnings = text
    assert kept_warnings.of(ob) == ([], {})


def test_without_uv_maps_there_is_nothing_to_select():
    ob = torus()
    with pytest.raises(RuntimeError, match="has no UV maps"):
        bpy.ops.tolvol.select_staying()
    ob.data.uv_layers.new(name="map")
    ob.data.uv_layers[0].data.foreach_set("uv", np.zeros(2 * len(ob.data.loops), np.float32))
    assert bpy.ops.tolvol.select_staying() == {"CANCELLED"} and ob.mode == "OBJECT"
    activate(ob)
    assert staying.TOLVOL_OT_select_staying.poll(bpy.context)
