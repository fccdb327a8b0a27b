# SPDX-License-Identifier: GPL-3.0-or-later
"""Holds the square from (0, 0) to (1, 1), which shaders take to where it is drawn."""

import functools

import gpu


@functools.cache
def unit():
    """Returns the square as a GPUBatch with the attribute `position`. It may be called only while a 3D view is drawn."""
    layout = gpu.types.GPUVertFormat()
    layout.attr_add(id="position", comp_type="F32", len=2, fetch_mode="FLOAT")
    buffer = gpu.types.GPUVertBuf(layout, 4)
    buffer.attr_fill("position", [(0, 0), (1, 0), (0, 1), (1, 1)])
    return gpu.types.GPUBatch(type="TRI_STRIP", buf=buffer)


def free():
    """Frees the square on the GPU."""
    unit.cache_clear()
