# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws Fig. 4 of the paper: a model deformed by a lattice, freely and within the tolerance, with distances as colours.

blender --background --python docs/figures/deformation.py -- PICTURE.png [--model MESH] [--tolerance 2%]
"""

import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parents[1] / "blender_scripts")]
import command_line as cli  # noqa: E402
import comparison_picture as comparison  # noqa: E402
import models  # noqa: E402
from addon import native  # noqa: E402
from addon.files import file_io  # noqa: E402
from addon.shared.proof import measure, report  # noqa: E402

POINTS = 4  # control points of the lattice along each axis
ROOM = 0.06  # space between the model and the lattice, as a share of the model's box
PULL = 5.0  # tolerances by which control points move; vertices follow about half as far
GAP, MARGIN = 0.34, 0.5  # spaces between and beside the models, which leave room for the lattices
# Distance over tolerance (0 to 1) -> colour. The colours also differ in grey. BEYOND is not among them.
RAMP = ((0.0, (0.93, 0.93, 0.88)), (0.35, (0.95, 0.75, 0.35)), (0.7, (0.45, 0.55, 0.75)), (1.0, (0.05, 0.12, 0.35)))
BEYOND = (0.85, 0.0, 0.45)
CAGE_COLOUR = (0.25, 0.27, 0.3)
CAGE_RADIUS = 0.0016
BAR = (0.2, 0.011)  # width and height of the legend, as shares of the picture's width


def deviation_material(lit):
    """Returns a material that colours a mesh by its attribute `deviation`, a distance over the tolerance."""

    def build(tree):
        attribute = tree.nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = "deviation"
        ramp = tree.nodes.new("ShaderNodeValToRGB")
        elements = ramp.color_ramp.elements
        for _ in RAMP[2:]:
            elements.new(1.0)
        for element, (place, colour) in zip(elements, RAMP):
            element.position, element.color = place, (*colour, 1)
        beyond = tree.nodes.new("ShaderNodeMath")
        beyond.operation, beyond.inputs[1].default_value = "GREATER_THAN", 1.0
        mix = tree.nodes.new("ShaderNodeMixRGB")
        mix.inputs["Color2"].default_value = (*BEYOND, 1)
        surface = tree.nodes.new("ShaderNodeBsdfPrincipled" if lit else "ShaderNodeEmission")
        if lit:
            surface.inputs["Roughness"].default_value = 0.6
        tree.links.new(attribute.outputs["Fac"], ramp.inputs["Fac"])
        tree.links.new(attribute.outputs["Fac"], beyond.inputs[0])
        tree.links.new(beyond.outputs["Value"], mix.inputs["Fac"])
        tree.links.new(ramp.outputs["Color"], mix.inputs["Color1"])
        tree.links.new(mix.outputs["Color"], surface.inputs["Base Color" if lit else "Color"])
        return surface.outputs[0]

    return comparison.new_material("deviation", build)


def set_deviation(mesh, values):
    mesh.attributes.new("deviation", "FLOAT", "POINT").data.foreach_set("value", values.astype(np.float32))


def wished_lattice(vertices, length):
    """Returns (points, domain) of a lattice that draws the upper front of the box forward by about `length` and presses
    one side in."""
    lower, upper = vertices.min(0), vertices.max(0)
    room = ROOM * (upper - lower)
    domain = np.diag([*(upper - lower + 2 * room), 1.0])
    domain[:3, 3] = lower - room
    rest = native.module.lattice_points(POINTS, domain)
    points = rest.copy()
    points[1:3, 0, 2] += [0, -length, 0.3 * length]
    points[3, 0:3, 1:3] += [-0.7 * length, 0, 0]
    return points, domain


def add_cage(points, model):
    """Adds the lines of a lattice at the place of the object `model`."""
    curve = bpy.data.curves.new("cage", "CURVE")
    curve.dimensions = "3D"
    curve.bevel_depth = CAGE_RADIUS / model.matrix_world.to_scale().x
    lines = [line for axis in range(3) for line in np.moveaxis(points, axis, 2).reshape(-1, points.shape[axis], 3)]
    for line in lines:
        spline = curve.splines.new("POLY")
        spline.points.add(len(line) - 1)
        spline.points.foreach_set("co", np.hstack([line, np.ones((len(line), 1))]).ravel())

    def build(tree):
        node = tree.nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (*CAGE_COLOUR, 1)
        return node.outputs["BSDF"]

    curve.materials.append(comparison.new_material("cage", build))
    cage = comparison.add("cage", curve, model.matrix_world)
    cage.visible_shadow = False


def add_legend(camera, tolerance_text):
    """Adds a bar of the colours at the top of the picture: from 0 to the tolerance, and beyond the tolerance."""
    width, (long, high) = comparison.SENSOR / comparison.LENS, BAR
    top = comparison.HEIGHT / comparison.WIDTH / 2 - 0.015
    x = np.array([-0.5, 0.5, 0.5, 0.9]) * long
    vertices = np.array([(a, b * high + top, 0) for a in x for b in (0, -1)]) * width
    mesh = bpy.data.meshes.new("legend")
    mesh.from_pydata(vertices.tolist(), [], [(0, 1, 3, 2), (4, 5, 7, 6)])
    set_deviation(mesh, np.array([0, 0, 1, 1, 2, 2, 2, 2]))
    mesh.materials.append(deviation_material(lit=False))
    comparison.add("legend", mesh, camera.matrix_world @ Matrix.Translation((0, 0, -1)))
    ink = comparison.ink()
    for place, text in ((-0.5, "0"), (0.5, tolerance_text), (0.75, "beyond")):
        comparison.add_caption(camera, place * long, top - high - 0.018, 0.013, text, ink)


def arguments():
    parser = cli.Parser("docs/figures/deformation.py", description=__doc__.splitlines()[0])
    parser.add_argument("picture", metavar="PICTURE.png")
    parser.add_argument("--model", metavar="MESH", help="a file with Z up (default: Blender's monkey, subdivided)")
    parser.add_argument("--tolerance", type=cli.length, default="2%", help="a length, or N%% of size (default: 2%%)")
    return parser.parse()


def main(options):
    cli.require_folder(options.picture, "PICTURE")
    if options.model:
        vertices, triangles = models.read(options.model)
    else:
        vertices, triangles = models.arrays(models.build("suzanne"))
    size = native.module.diagonal(vertices, triangles)
    tolerance = cli.in_units(options.tolerance, size)
    volume = native.module.ToleranceVolume(vertices, triangles, tolerance)
    points, domain = wished_lattice(vertices, PULL * tolerance)
    lattice = native.module.Lattice(points, domain)
    wish = native.module.deform(vertices, lattice)
    bounded = native.module.deform(vertices, lattice, triangles, volume, mode="pull_back")

    captions = []
    for result, text in ((wish, "as wished"), (bounded, "held within the tolerance")):
        judged = measure.largest_distance((result.vertices, triangles), (vertices, triangles), tolerance)
        within = f"within {report.percent(judged.upper, size)} of the original (certified)"
        captions.append((text, within))
    outside = bounded.report["leaving"]["faces"]
    captions[0] = (captions[0][0], f"{captions[0][1]}, {outside:,} triangles outside")
    captions[1] = (captions[1][0], f"{captions[1][1]}, {bounded.report['held_back']:,} vertices held back")

    bpy.ops.wm.read_factory_settings(use_empty=True)
    look = deviation_material(lit=True)
    states = [(result.vertices, triangles) for result in (wish, bounded)]
    objects, camera = comparison.compose(*states, (look, look), captions, "Z", GAP, MARGIN)
    for ob, result in zip(objects, (wish, bounded)):
        ob.data.polygons.foreach_set("use_smooth", np.ones(len(triangles), bool))
        set_deviation(ob.data, volume.distance(result.vertices) / tolerance)
        add_cage(points, ob)
    add_legend(camera, report.percent(tolerance, size))
    with file_io.quiet():
        comparison.render(Path(options.picture))
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
