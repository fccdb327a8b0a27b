# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a reference and its result side by side, with their edges, by Cycles on the CPU.

blender --background --python blender_scripts/comparison_picture.py -- REFERENCE RESULT PICTURE.png [--report REPORT.json]

REPORT.json is a report that decimate.py wrote. With it the picture states the proved distances.
"""

import json
import math
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

sys.path.insert(0, str(Path(__file__).resolve().parent))
import command_line as cli  # noqa: E402
import models  # noqa: E402
from addon.files import file_io  # noqa: E402
from addon.mesh import mesh_io  # noqa: E402
from addon.shared.proof import report  # noqa: E402

WIDTH, HEIGHT = 1280, 640
SAMPLES = 40  # Debian's Blender has no denoiser. One large light and an even sky make little noise without one.
BACKGROUND = (0.90, 0.91, 0.93)
REFERENCE_COLOUR = (0.20, 0.36, 0.55)
RESULT_COLOUR = (0.83, 0.36, 0.10)
TEXT_COLOUR = (0.03, 0.035, 0.05)
LENS, SENSOR = 85, 36  # mm; with a long lens both models are seen from nearly the same side
TURN = math.radians(25)  # the rotation of both models about the vertical
ELEVATION = math.radians(9)  # the elevation of the camera
# Lengths in the scene, where the larger of the reference's width and height is 1.
GAP = 0.10  # the gap between the models
MARGIN = 0.16  # the space beside the models
CAPTION = 0.38  # the space below and above the models


def new_material(name, build):
    """Returns a material whose surface is the socket that build(node_tree) returns."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(build(tree), output.inputs["Surface"])
    return material


def clay(colour, wire_pixels, wire_strength):
    """Returns a dull material that draws every edge. All edges have the same width in the picture, at any distance."""

    def build(tree):
        surface = tree.nodes.new("ShaderNodeBsdfPrincipled")
        surface.inputs["Base Color"].default_value = (*colour, 1)
        surface.inputs["Roughness"].default_value = 0.6
        edge = tree.nodes.new("ShaderNodeBsdfDiffuse")
        edge.inputs["Color"].default_value = (*(0.12 * c for c in colour), 1)
        wire = tree.nodes.new("ShaderNodeWireframe")
        wire.use_pixel_size = True
        wire.inputs["Size"].default_value = wire_pixels
        strength = tree.nodes.new("ShaderNodeMath")
        strength.operation = "MULTIPLY"
        strength.inputs[1].default_value = wire_strength
        tree.links.new(wire.outputs["Fac"], strength.inputs[0])
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(strength.outputs["Value"], mix.inputs["Fac"])
        tree.links.new(surface.outputs["BSDF"], mix.inputs[1])
        tree.links.new(edge.outputs["BSDF"], mix.inputs[2])
        return mix.outputs["Shader"]

    return new_material("clay", build)


def ink():
    def build(tree):
        node = tree.nodes.new("ShaderNodeEmission")
        node.inputs["Color"].default_value = (*TEXT_COLOUR, 1)
        return node.outputs["Emission"]

    return new_material("ink", build)


def add(name, data, matrix=None):
    ob = bpy.data.objects.new(name, data)
    ob.matrix_world = matrix or Matrix()
    bpy.context.scene.collection.objects.link(ob)
    return ob


def look_at(position, target):
    direction = Vector(target) - Vector(position)
    return Matrix.Translation(position) @ direction.to_track_quat("-Z", "Y").to_matrix().to_4x4()


def add_light(position, target, size, power):
    data = bpy.data.lights.new("light", "AREA")
    data.shape, data.size, data.energy = "DISK", size, power
    add("light", data, look_at(position, target))


def add_floor():
    """Adds a floor of which only the shadows on it are visible."""
    mesh = bpy.data.meshes.new("floor")
    mesh.from_pydata([(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)], [], [(0, 1, 2, 3)])
    add("floor", mesh).is_shadow_catcher = True


def add_caption(camera, x, y, size, text, material):
    """Adds text in the plane of the picture. x, y and size are in units of the picture's width; (0, 0) is its centre."""
    width = SENSOR / LENS  # the width of the picture at distance 1
    curve = bpy.data.curves.new("caption", "FONT")
    curve.body, curve.align_x, curve.size = text, "CENTER", size * width
    curve.materials.append(material)
    add("caption", curve, camera.matrix_world @ Matrix.Translation((x * width, y * width, -1)))


def compose(reference, result, looks, captions, up, gap=GAP, margin=MARGIN):
    """Puts two models on a floor, with light and a camera. Returns the two objects and the camera.

    reference, result: pairs (vertices, triangles); looks: two materials; captions: two pairs of texts (large, small);
    up: "Y" or "Z"; gap: the space between the models; margin: the space beside them.
    """
    turn = Matrix.Rotation(TURN, 4, "Z") @ Matrix.Rotation(math.pi / 2 if up == "Y" else 0, 4, "X")
    turned = reference[0][np.unique(reference[1])] @ np.array(turn.to_3x3()).T
    lower, upper = turned.min(0), turned.max(0)
    scale = 1 / float(max(upper[0] - lower[0], upper[2] - lower[2]))
    width, depth, height = (scale * (upper - lower)).tolist()
    foot = Vector((*(lower + upper)[:2] / 2, lower[2]))
    shift = (width + gap) / 2
    to_scene = Matrix.Scale(scale, 4) @ Matrix.Translation(-foot) @ turn
    objects = []
    for arrays, look, x in zip((reference, result), looks, (-shift, shift)):
        mesh = mesh_io.new_mesh("model", *arrays)
        mesh.materials.append(look)
        objects.append(add("model", mesh, Matrix.Translation((x, 0, 0)) @ to_scene))
    add_floor()

    target = Vector((0, 0, 0.4 * height))
    span = max(2 * width + gap + margin, (height + CAPTION) * WIDTH / HEIGHT)
    distance = span * LENS / SENSOR + depth / 2
    view = Vector((0, -math.cos(ELEVATION), math.sin(ELEVATION)))
    data = bpy.data.cameras.new("camera")
    data.lens, data.sensor_width = LENS, SENSOR
    camera = add("camera", data, look_at(target + distance * view, target))
    bpy.context.scene.camera = camera
    add_light((-2.5, -2.5, 3.5), target, 1.5, 120)
    material, bottom = ink(), -HEIGHT / WIDTH / 2
    for x, (large, small) in zip((-shift, shift), captions):
        add_caption(camera, x / span, bottom + 0.052, 0.026, large, material)
        add_caption(camera, x / span, bottom + 0.024, 0.015, small, material)
    return objects, camera


def render(picture):
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    sky = scene.world.node_tree.nodes["Background"]
    sky.inputs["Color"].default_value = (*BACKGROUND, 1)
    sky.inputs["Strength"].default_value = 0.6

    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 1
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100

    # The background has to be even behind the shadows. Light would change any background in the scene, so the compositor
    # adds it.
    scene.render.film_transparent = True
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    layers = tree.nodes.new("CompositorNodeRLayers")
    over = tree.nodes.new("CompositorNodeAlphaOver")
    over.inputs[1].default_value = (*BACKGROUND, 1)
    output = tree.nodes.new("CompositorNodeComposite")
    tree.links.new(layers.outputs["Image"], over.inputs[2])
    tree.links.new(over.outputs["Image"], output.inputs["Image"])

    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.compression = 100
    scene.render.filepath = str(picture.resolve())
    bpy.ops.render.render(write_still=True)


def captions(reference, result, numbers):
    """Returns the captions of both models. They state proved distances only if a report gives them in `numbers`."""
    large = [f"{len(triangles):,} triangles" for _, triangles in (reference, result)]
    if numbers is None:
        return [(large[0], "reference"), (large[1], "result")]
    size = 100 * numbers["tolerance"]["absolute"] / numbers["tolerance"]["percent"]
    forward, backward = (report.percent(numbers[direction][1], size) for direction in ("forward", "backward"))
    return [
        (large[0], "reference"),
        (large[1], f"result within {forward} of the reference, reference within {backward}"),
    ]


def arguments():
    parser = cli.Parser(
        "blender_scripts/comparison_picture.py",
        description="Makes a picture of two meshes side by side, with their edges.",
    )
    parser.add_argument("reference", metavar="REFERENCE")
    parser.add_argument("result", metavar="RESULT")
    parser.add_argument("picture", metavar="PICTURE.png")
    parser.add_argument(
        "--report", metavar="REPORT.json", help="a report by decimate.py; the picture states the distances proved there"
    )
    return parser.parse()


def main(options):
    cli.require_folder(options.picture, "PICTURE")
    numbers = None
    if options.report:
        try:
            numbers = json.loads(Path(options.report).read_text())
        except (OSError, ValueError) as error:
            raise cli.Stop(f"--report {options.report}: {error}") from None
    reference, result = models.read(options.reference), models.read(options.result)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    # The files do not say which axis is up. By convention it is Y in .obj files and Z in the others.
    up = "Y" if Path(options.reference).suffix.lower() == ".obj" else "Z"
    # The reference has so many edges that at full strength they would hide its surface.
    looks = clay(REFERENCE_COLOUR, 0.55, 0.55), clay(RESULT_COLOUR, 1.1, 0.9)
    compose(reference, result, looks, captions(reference, result, numbers), up)
    with file_io.quiet():
        render(Path(options.picture))
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
