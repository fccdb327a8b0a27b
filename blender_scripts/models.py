# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes models for the other scripts: from files, or Blender's monkey, subdivided, with noise like that of a scanner.

blender --background --python blender_scripts/models.py -- suzanne OUT.ply
"""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import command_line as cli  # noqa: E402
from addon.files import file_io  # noqa: E402
from addon.mesh import mesh_io  # noqa: E402
from addon.shared.surface import to_world

LEVELS = {"suzanne": 3, "suzanne-4": 4}  # levels of subdivision, which make 62,976 and 251,904 triangles
NOISE = 0.0005  # standard deviation of the noise along the normal, as a share of the bounding box's diagonal
SEED = 2004


def build(name):
    """Returns a new object in the scene. It has the same coordinates in every run."""
    bpy.ops.mesh.primitive_monkey_add(calc_uvs=False)  # A scan has no UVs.
    ob = bpy.context.object
    ob.name = name
    ob.modifiers.new("subdivision", "SUBSURF").levels = LEVELS[name]
    bpy.ops.object.modifier_apply(modifier="subdivision")
    mesh = ob.data
    count = len(mesh.vertices)
    points, normals = np.empty((2, count * 3), np.float32)
    mesh.vertices.foreach_get("co", points)
    mesh.vertices.foreach_get("normal", normals)
    points, normals = points.reshape(-1, 3), normals.reshape(-1, 3)
    deviation = NOISE * np.linalg.norm(np.ptp(points, axis=0))
    points += normals * np.random.default_rng(SEED).normal(0, deviation, (count, 1)).astype(np.float32)
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.update()
    return ob


def arrays(ob):
    """Returns (vertices, triangles): (n, 3) float32 in the world and (m, 3) int32."""
    mesh, matrix = mesh_io.read_mesh(ob.data), mesh_io.matrix_array(ob.matrix_world)
    return to_world(mesh.vertices, matrix).astype(np.float32), mesh.triangles


def read(path):
    """Returns all objects of a file as one mesh, (vertices, triangles)."""
    parts = [arrays(ob) for ob in file_io.read_file(path).objects]
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    triangles = [triangles + start for (_, triangles), start in zip(parts, first)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(triangles).astype(np.int32)


def arguments():
    parser = cli.Parser("blender_scripts/models.py", description="Writes a model to a file.")
    parser.add_argument("model", choices=LEVELS)
    parser.add_argument("output", metavar="OUT", help=".ply, .obj or .stl")
    return parser.parse()


def main(options):
    cli.require_folder(options.output, "OUT")
    file_io.extension_of(options.output)
    file_io.write_file(options.output, [build(options.model)], Path(options.output).parent)
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
