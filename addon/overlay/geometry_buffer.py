# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the geometry buffers of the views: textures into which a surface is drawn before its pixels are coloured.

The distance of a place takes long to find. For a triangle that is smaller than a pixel the GPU would find it for a whole block of
pixels, and keep one of them. So the triangles are drawn without distances, and then each pixel gets its colour once. At last the
triangles are drawn with these colours, where Blender's depths show them. This is deferred shading [M. Deering et al., "The
Triangle Processor and Normal Vector Shader", 1988].
"""

import functools
from dataclasses import dataclass

import gpu


@dataclass(frozen=True)
class GeometryBuffer:
    """Holds for each pixel of a view the place on the surface (`places`), its brightness (`light`), which is 0 where there is no
    surface, and its colour (`colours`)."""

    places: gpu.types.GPUTexture
    light: gpu.types.GPUTexture
    depths: gpu.types.GPUTexture  # A framebuffer does not keep its textures.
    colours: gpu.types.GPUTexture
    of_places: gpu.types.GPUFrameBuffer
    of_colours: gpu.types.GPUFrameBuffer


@functools.lru_cache(maxsize=4)  # Few views have different sizes at once.
def of_size(width, height):
    """Returns the GeometryBuffer of views of this size. It may be called only while a 3D view is drawn."""
    formats = "RGBA32F", "R16F", "DEPTH_COMPONENT32F", "RGBA16F"
    places, light, depths, colours = (gpu.types.GPUTexture((width, height), format=name) for name in formats)
    of_places = gpu.types.GPUFrameBuffer(depth_slot=depths, color_slots=(places, light))
    return GeometryBuffer(places, light, depths, colours, of_places, gpu.types.GPUFrameBuffer(color_slots=(colours,)))


def free():
    of_size.cache_clear()
