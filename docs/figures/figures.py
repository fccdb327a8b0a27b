# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the pictures of docs/pictures that show the tolerance volume and distances from it, of any mesh.

blender --background --python docs/figures/figures.py -- [MESH] [--output FOLDER] [--tolerance 1%]

volume.png shows the tolerance volume around MESH, half of it cut away. distance.png shows MESH decimated within the
tolerance, and decimated to as many triangles by Blender's own Decimate modifier, both coloured by the distance to MESH.
Without MESH the script takes Blender's monkey and also makes error.png, the error of distance fields against their spacing.
error.png takes minutes and needs `sh setup.sh --tests`.

Other scripts make the other pictures of docs/pictures:

    demo.png                          blender_scripts/demo.sh, as out/picture.png
    panel.png, overlay.png, guard.png TOLVOL_ALL_TESTS=1 sh tests/ui/run.sh test_pictures_for_the_documentation, in build/ui
    other_tools.png, tolerances.png   benchmark/other_tools.py with --picture and with --curves
    deformation.png, smoothing.png    the scripts of these names in this folder
"""

import importlib.util
import sys
from pathlib import Path

import bpy

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parents[1] / "blender_scripts")]
import command_line as cli  # noqa: E402
import error_plot  # noqa: E402
import models  # noqa: E402
from addon.mesh import mesh_io  # noqa: E402
from addon.native import module as tolvol  # noqa: E402
from addon.shared.command import pictures  # noqa: E402

PICTURES = Path(__file__).resolve().parents[2] / "docs" / "pictures"
VOLUME_TOLERANCE = 0.04  # share of the size; it is large enough to be seen
VOLUME_SIZE = (760, 640)
PANEL = (372, 324)
HEADING = 64
LEGEND = 190


def by_modifier(vertices, triangles, count):
    """Returns a mesh decimated by Blender's Decimate modifier to at most `count` triangles."""
    ob = bpy.data.objects.new("modifier", mesh_io.new_mesh("modifier", vertices, triangles))
    bpy.context.scene.collection.objects.link(ob)
    modifier = ob.modifiers.new("decimate", "DECIMATE")
    modifier.ratio = count / len(triangles)
    evaluated = ob.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return models.arrays(bpy.data.objects.new("decimated", bpy.data.meshes.new_from_object(evaluated)))


def draw_volume(path, mesh, like):
    vertices, triangles = mesh
    volume = tolvol.ToleranceVolume(*mesh, VOLUME_TOLERANCE * tolvol.diagonal(*mesh))
    view = pictures.camera(*mesh, VOLUME_SIZE, like, volume.tolerance)
    middle = (vertices[triangles].max((0, 1)) + vertices[triangles].min((0, 1))) / 2
    page = pictures.Page(VOLUME_SIZE[0] + LEGEND, VOLUME_SIZE[1])
    page.image(0, 0, tolvol.render_volume(volume, camera=view, size=VOLUME_SIZE, cut=(middle, (1, 0, 0)), samples=3))
    page.text(VOLUME_SIZE[0], pictures.MARGIN, "All points within ε\nof the reference", 12)
    # The section shows only points outside the mesh, so the legend begins at distance 0.
    bar = VOLUME_SIZE[0], 90, VOLUME_SIZE[1] - 110
    page.legend(*bar, "signed", volume.tolerance, volume.diagonal, lowest=0, outside=False)
    page.save(path, step=3)


def draw_distances(path, mesh, tolerance, like):
    volume = tolvol.ToleranceVolume(*mesh, tolerance)
    result = tolvol.decimate(*mesh, volume)
    within = result.vertices, result.triangles
    regardless = by_modifier(*mesh, len(result.triangles))
    view = pictures.camera(*mesh, PANEL, like)
    page = pictures.Page(2 * PANEL[0] + LEGEND, HEADING + 2 * PANEL[1])
    for column, (surface, name) in enumerate(
        ((within, "within the tolerance"), (regardless, "Blender's Decimate modifier"))
    ):
        x = column * PANEL[0]
        farthest = tolvol.directed_hausdorff(*surface, *mesh).upper / volume.tolerance
        page.text(x + PANEL[0] / 2, 14, f"{len(surface[1]):,} triangles, {name}", 12, ha="center")
        page.text(
            x + PANEL[0] / 2,
            38,
            f"every point within {farthest:.2f} ε of the reference",
            9,
            pictures.FAINT,
            ha="center",
        )
        for row, transfer in enumerate(("signed", "magnitude")):
            pixels = tolvol.render_distance(
                *surface, volume, camera=view, size=PANEL, transfer=transfer, edges=True, samples=3
            )
            page.image(x, HEADING + row * PANEL[1], pixels)
    for row, transfer in enumerate(("signed", "magnitude")):
        page.legend(
            2 * PANEL[0], HEADING + 20 + row * PANEL[1], PANEL[1] - 40, transfer, volume.tolerance, volume.diagonal
        )
    page.save(path, step=3)


def arguments():
    parser = cli.Parser(
        "docs/figures/figures.py", description="Makes the pictures of the tolerance volume and of distances."
    )
    parser.add_argument("mesh", nargs="?", metavar="MESH", help=".obj, .ply or .stl")
    parser.add_argument(
        "--output", default=PICTURES, metavar="FOLDER", help="the folder for the pictures (default: docs/pictures)"
    )
    parser.add_argument(
        "--tolerance", default=(1.0, True), type=cli.length, metavar="T", help="N%% of size, or a length"
    )
    return parser.parse(may_be_empty=True)


def main(options):
    volume, distance, error = (Path(options.output) / name for name in ("volume.png", "distance.png", "error.png"))
    pictures.require("--output", volume)
    if not options.mesh and not importlib.util.find_spec("tolvol_baselines"):
        raise cli.Stop("error.png needs tolvol_baselines: sh setup.sh --tests builds it; or name a MESH")
    mesh = models.read(options.mesh) if options.mesh else models.arrays(models.build("suzanne"))
    like = options.mesh or ""
    draw_volume(volume, mesh, like)
    draw_distances(distance, mesh, cli.in_units(options.tolerance, tolvol.diagonal(*mesh)), like)
    if not options.mesh:
        error_plot.draw(error)
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
