# SPDX-License-Identifier: GPL-3.0-or-later
"""Mean, root mean square and 95th percentile are measured on demand, kept, and let go after a change."""

import bpy
import numpy as np
import pytest

from addon.proof import statistics, verdict
from addon.reference import measurements
from scenes import sheet, torus

pytestmark = pytest.mark.usefixtures("measured_once")


def half_lifted(height=0.1):
    """A flat sheet of which one half was lifted after its reference was set, with a steep step between the halves."""
    ob = sheet(bumps=0.0, count=100)
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    for vertex in ob.data.vertices:
        vertex.co.z += height * (vertex.co.x > 0)
    ob.data.update()
    bpy.context.view_layer.update()
    return ob


def test_the_numbers_are_those_of_the_surface_and_come_with_a_verdict(tmp_path):
    ob = half_lifted()
    assert statistics.of(ob) is None and verdict.of(ob) is None
    assert bpy.ops.tolvol.measure_statistics() == {"FINISHED"}
    found = statistics.of(ob)
    # Beside the step the reference is nearer to the mesh than its height.
    assert found["backward"]["mean"] == pytest.approx(0.05, rel=0.06)
    assert found["backward"]["rms"] == pytest.approx(0.1 * np.sqrt(0.5), rel=0.06)
    assert found["forward"]["percentile"] == pytest.approx(0.1, rel=0.01) and found["forward"]["mean"] > 0.045
    assert verdict.word(ob) == verdict.FAIL
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert statistics.of(bpy.data.objects["sheet"]) == found


def test_they_go_with_the_state_that_was_measured():
    ob = half_lifted()
    assert bpy.ops.tolvol.measure_statistics() == {"FINISHED"} and statistics.of(ob)
    ob.data.vertices[0].co.z += 0.1
    ob.data.update()
    bpy.context.view_layer.update()
    assert statistics.of(ob) is None
    assert (
        bpy.ops.tolvol.check() == {"FINISHED"} and statistics.of(ob) is None
    )  # Check measures the largest distance alone.
    assert bpy.ops.tolvol.measure_statistics() == {"FINISHED"} and statistics.of(ob)
    measurements.forget_kept()  # as when the file is opened
    assert statistics.of(ob)
    ob.tolvol.measurement.statistics = '{"forward": 3}'
    assert statistics.of(ob) is None, "damaged"


def test_they_need_a_reference():
    torus()
    with pytest.raises(RuntimeError, match="Set the reference first"):
        bpy.ops.tolvol.measure_statistics()
