# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the geometry buffers of the views: textures into which a surface is drawn before its pixels are coloured.

The distance of a place takes long to find. For a triangle that is smaller than a pixel the GPU would find it for a whole block of
pixels, and keep one of them. So the triangles of an object are drawn without distances, and then each of its pixels gets its
colour once. At last the pixels are drawn where Blender's depths show them. This is deferred shading
[M. Deering et al., "The Triangle Processor and Normal Vector Shader", 1988].
"""

from dataclasses import dataclass

import bpy
import gpu

_buffers = {}  # (width, height) -> GeometryBuffer


@dataclass(frozen=True)
class GeometryBuffer:
    """Holds for each pixel of a view the place on the surface with its brightness, which is 0 where there is no surface
    (`places`), and its colour (`colours`). 28 bytes a pixel."""

    places: gpu.types.GPUTexture
    depths: gpu.types.GPUTexture
    colours: gpu.types.GPUTexture
    of_places: gpu.types.GPUFrameBuffer
    of_colours: gpu.types.GPUFrameBuffer


def of_size(size):
    """Returns the GeometryBuffer of views of this size, (width, height). It may be called only while a 3D view is drawn."""
    if size not in _buffers:
        for other in _buffers.keys() - _sizes_of_views():
            del _buffers[other]
        formats = "RGBA32F", "DEPTH_COMPONENT32F", "RGBA16F"
        places, depths, colours = (gpu.types.GPUTexture(size, format=name) for name in formats)
        of_places, of_colours = (
            gpu.types.GPUFrameBuffer(depth_slot=depths, color_slots=(places,)),
            gpu.types.GPUFrameBuffer(color_slots=(colours,)),
        )
        _buffers[size] = GeometryBuffer(places, depths, colours, of_places, of_colours)
    return _buffers[size]


def _sizes_of_views():
    areas = (area for window in bpy.context.window_manager.windows for area in window.screen.areas)
    regions = (region for area in areas if area.type == "VIEW_3D" for region in area.regions)
    return {(region.width, region.height) for region in regions if region.type == "WINDOW"}


def free():
    """Frees all textures. It may be called at any time."""
    _buffers.clear()
