# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders of the overlay, for Blender's gpu module: the surface, its edges and the legend.

They compute colours from distances by the same functions as the pictures of the compiled module. The text of these
functions is in the folder shaders/.
"""

import functools
from pathlib import Path

import gpu
import numpy as np

from .. import native
from . import scale

_ADDON = Path(__file__).resolve().parents[1]
# In the package the folder shaders/ is beside the add-on's files; in a checkout it is at the top.
_SHARED = next(folder for folder in (_ADDON / "shaders", _ADDON.parent / "shaders") if folder.is_dir())

# Blender sets srgbTarget to tell whether the target of the drawing expects linear colours.
_DISPLAYED = """
vec4 displayed(vec3 colour, float opacity) {
  vec3 linear = mix(colour / 12.92, pow((colour + 0.055) / 1.055, vec3(2.4)), step(0.04045, colour));
  return vec4(srgbTarget ? linear : colour, opacity);
}
"""

# The vertex shader computes the same two products as Blender's own shaders, so that the depths agree up to rounding. The
# surface is moved towards the eye by more than this: by NEARER, some steps of a depth buffer of 24 bits, and by four times
# the rounding of the products, which is large in a close view of an object that is far from the origin.
_SURFACE_VERTEX = """
void main() {
  place = framed;
  mat4 m = told.view_projection;
  vec3 world = (told.model * vec4(position, 1.0)).xyz;
  gl_Position = m * vec4(world, 1.0);
  vec4 summed = abs(m[0] * world.x) + abs(m[1] * world.y) + abs(m[2] * world.z) + abs(m[3]);
  gl_Position.z -= NEARER * gl_Position.w + ROUNDED * (summed.z + summed.w);
}
"""

# Takes a distance as a share of the range of the colours to the middle of its band.
_BANDED = """
float banded(float part, float lowest, float bands) {
  if (bands < 1.0) return part;
  float d = lowest < 0.0 ? part : abs(part);
  float band = clamp(floor((d - lowest) / (1.0 - lowest) * bands), 0.0, bands - 1.0);
  return mix(lowest, 1.0, (band + 0.5) / bands);
}
"""

_GEOMETRY_FRAGMENT = """
void main() {
  vec3 normal = cross(dFdx(place), dFdy(place));
  shown = vec4(place, head_light(normal, normalize(told.eye.xyz - told.eye.w * place)));
}
"""

_VIEW_VERTEX = """
void main() {
  part = position;
  gl_Position = vec4(2.0 * position - 1.0, 0.0, 1.0);
}
"""

_COLOURS_FRAGMENT = """
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 lit = texelFetch(places, pixel, 0);
  if (lit.w == 0.0) {
    shown = vec4(0.0);
    return;
  }
  // The search reaches a little beyond the tolerance, so that a distance just beyond it is told from one within. It reaches
  // farther if what is beyond has colours.
  float far = told.range > 1.0 ? FAR * told.range : 1.0;
  float reach = 1.001 * far * told.tolerance + 2.0 * ROUNDING;
  float d = surface_distance(nodes, corners, int(told.leaves), lit.xyz, reach, ROUNDING) / told.tolerance;
  vec3 colour = lit.w * distance_colour(transfer, banded(d / told.range, told.lowest, told.bands), told.lowest);
  if (abs(d) > far) {
    colour = outside_colour(gl_FragCoord.xy, told.period, OUTSIDE, STRIPE);
  } else if (abs(d) > 1.0) {
    colour = outside_colour(gl_FragCoord.xy, told.period, OUTSIDE, colour);
  }
  shown = vec4(colour, 1.0);
}
"""

_SURFACE_FRAGMENT = """
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 colour = texelFetch(colours, pixel, 0);
  if (colour.a == 0.0) discard;
  gl_FragDepth = texelFetch(depths, pixel, 0).r;
  shown = displayed(colour.rgb, told.opacity);
}
"""

_LINES_FRAGMENT = """
void main() { shown = displayed(flat_colour.rgb, flat_colour.a); }
"""

# The layout is that of std140: vectors of four come first, and the numbers are filled up to a multiple of sixteen bytes.
_SURFACE_TOLD = """
struct Told {
  mat4 view_projection, model;
  vec4 eye;
  float tolerance, lowest, period, opacity;
  float leaves, range, bands, unused;
};
"""

_LEGEND_VERTEX = """
void main() {
  part = position;
  gl_Position = vec4(mix(corners.xy, corners.zw, position), 0.0, 1.0);
}
"""

# fill: the kind of filling, the lowest distance as a share of the range, and the period of the stripes in pixels or the
# number of bands.
_LEGEND_FRAGMENT = """
void main() {
  if (fill.x == BAR) {
    shown = displayed(distance_colour(transfer, banded(mix(fill.y, 1.0, part.y), fill.y, fill.z), fill.y), 1.0);
  } else if (fill.x == STRIPES) {
    shown = displayed(outside_colour(gl_FragCoord.xy, fill.z, OUTSIDE, STRIPE), 1.0);
  } else {
    shown = displayed(flat_colour.rgb, flat_colour.a);
  }
}
"""

# Number of texels in a row of the textures that hold a tree.
ROW = 2048

# The kinds of filling of a rectangle in the legend.
FLAT, BAR, STRIPES = 0.0, 1.0, 2.0


# The attributes of a vertex: local, and in the frame of the tree.
_VERTEX = [("VEC3", "position"), ("VEC3", "framed")]


def _info(varying, attributes, vertex, fragment, shared=()):
    """Returns a GPUShaderCreateInfo.

    varying: (type, name) of the value that the vertex shader passes to the fragment shader.
    attributes: (type, name) of each attribute that the vertex shader reads.
    shared: files in shaders/ whose functions the fragment shader uses.
    """
    interface = gpu.types.GPUStageInterfaceInfo(f"tolvol_{varying[1]}")
    interface.smooth(*varying)
    info = gpu.types.GPUShaderCreateInfo()
    for i, attribute in enumerate(attributes):
        info.vertex_in(i, *attribute)
    info.vertex_out(interface)
    info.fragment_out(0, "VEC4", "shown")
    info.push_constant("BOOL", "srgbTarget")
    info.define("ROUNDED", "2.4e-7")  # four times 2^-24, the rounding of float32
    for name, colour in zip(("OUTSIDE", "STRIPE"), native.module.OUTSIDE_COLOURS):
        info.define(name, f"vec3({', '.join(f'{level / 255:.4f}' for level in colour)})")
    info.vertex_source(vertex)
    text = "".join((_SHARED / name).read_text(encoding="utf-8") for name in shared)
    info.fragment_source(text + _DISPLAYED + _BANDED + fragment)
    return info


def _add_told(info):
    """Adds the uniform block `told`, to which the result of told() has to be bound."""
    info.typedef_source(_SURFACE_TOLD)
    info.uniform_buf(0, "Told", "told")


@functools.cache
def geometry():
    """Returns the shader that draws the triangles of a surface into the places of a geometry buffer."""
    info = _info(("VEC3", "place"), _VERTEX, _SURFACE_VERTEX, _GEOMETRY_FRAGMENT, ("distance_colour.glsl",))
    _add_told(info)
    info.define("NEARER", "1e-6")
    return gpu.shader.create_from_info(info)


@functools.cache
def colours():
    """Returns the shader that fills the colours of a geometry buffer by the distances of its places from a tree.

    The samplers `nodes` and `corners` are the textures of the tree, and `places` is that of the geometry buffer.
    """
    shared = "surface_distance.glsl", "distance_colour.glsl"
    info = _info(("VEC2", "part"), [("VEC2", "position")], _VIEW_VERTEX, _COLOURS_FRAGMENT, shared)
    info.sampler(0, "FLOAT_1D", "transfer")
    for i, name in enumerate(("nodes", "corners", "places")):
        info.sampler(1 + i, "FLOAT_2D", name)
    _add_told(info)
    info.define("ROW", str(ROW))
    info.define("ROUNDING", str(native.module.DisplayTree.ROUNDING))
    info.define("FAR", str(scale.FAR))
    return gpu.shader.create_from_info(info)


@functools.cache
def surface():
    """Returns the shader that draws the pixels of a surface, which are in the textures `colours` and `depths` of a geometry
    buffer. To draw the triangles of a large mesh once more would take about as long as Blender's own drawing."""
    info = _info(("VEC2", "part"), [("VEC2", "position")], _VIEW_VERTEX, _SURFACE_FRAGMENT)
    for i, name in enumerate(("colours", "depths")):
        info.sampler(i, "FLOAT_2D", name)
    _add_told(info)
    if hasattr(info, "depth_write"):  # Newer versions of Blender have to be told that the shader writes depths.
        info.depth_write("ANY")
    return gpu.shader.create_from_info(info)


def told(view_projection, model, eye, tolerance, leaves, colours, period, opacity):
    """Returns the uniform buffer for geometry(), colours(), surface() and lines().

    eye: in the frame of the tree, (x, y, z, 1) for an eye and (x, y, z, 0) for a direction.
    tolerance: in this frame. leaves: how many the tree has. colours: the Scale.
    """
    matrices = [np.array(matrix, np.float32).T.ravel() for matrix in (view_projection, model)]
    parts = colours.reach / colours.tolerance, colours.bands
    numbers = tolerance, lowest(colours.signed), period, opacity, leaves, *parts, 0
    values = np.concatenate([*matrices, eye, numbers]).astype(np.float32)
    return gpu.types.GPUUniformBuf(gpu.types.Buffer("FLOAT", values.size, values))


@functools.cache
def lines():
    """Returns the shader that draws edges over the surface, in the colour `flat_colour`."""
    info = _info(("VEC3", "place"), _VERTEX, _SURFACE_VERTEX, _LINES_FRAGMENT)
    info.push_constant("VEC4", "flat_colour")
    _add_told(info)
    info.define("NEARER", "1e-5")
    return gpu.shader.create_from_info(info)


@functools.cache
def legend():
    """Returns the shader that fills rectangles. Their corners are in clip space."""
    info = _info(("VEC2", "part"), [("VEC2", "position")], _LEGEND_VERTEX, _LEGEND_FRAGMENT, ("distance_colour.glsl",))
    info.sampler(0, "FLOAT_1D", "transfer")
    for constant in (("VEC4", "corners"), ("VEC4", "flat_colour"), ("VEC3", "fill")):
        info.push_constant(*constant)
    info.define("BAR", str(BAR))
    info.define("STRIPES", str(STRIPES))
    return gpu.shader.create_from_info(info)


def lowest(signed):
    """Returns the distance at which the colours begin, as a share of the distance at which they end."""
    return -1.0 if signed else 0.0


# Colours of the palette NOMINAL, evenly spaced, sRGB: from inside over nothing to outside, and from nothing to the limit.
_NOMINAL = {
    True: ((40, 60, 200), (40, 160, 230), (60, 190, 90), (245, 220, 60), (215, 40, 40)),
    False: ((60, 190, 90), (245, 220, 60), (215, 40, 40)),
}
_NOMINAL_TEXELS = 257


def colours_of(signed, palette):
    """Returns (k, 3): a table of colours, sRGB from 0 to 255. It is the module's own, or that of the palette NOMINAL."""
    if palette == "SAFE":
        return native.module.transfer_colours("signed" if signed else "magnitude")
    stops = np.array(_NOMINAL[signed], np.float32)
    at = np.linspace(0, len(stops) - 1, _NOMINAL_TEXELS)
    return np.stack([np.interp(at, range(len(stops)), channel) for channel in stops.T], axis=1)


@functools.cache
def transfer(signed, palette="SAFE"):
    """Returns a table of colours as a texture."""
    colours = colours_of(signed, palette)
    texels = np.ones((len(colours), 4), np.float32)
    texels[:, :3] = colours / np.float32(255)
    return gpu.types.GPUTexture(
        len(texels), format="RGBA16F", data=gpu.types.Buffer("FLOAT", texels.size, texels.ravel())
    )


def free():
    """Frees all shaders and textures on the GPU."""
    for function in (geometry, colours, surface, lines, legend, transfer):
        function.cache_clear()
