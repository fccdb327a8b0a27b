# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of Show Deviation share."""

import bpy

from addon.overlay.scale import Scale


def with_reference(ob):
    assert bpy.ops.tolvol.set_reference() == {"FINISHED"}
    return ob


def scale(tolerance=1.0, signed=True, reach=None, bands=0):
    return Scale(tolerance, signed, tolerance if reach is None else reach, bands)
