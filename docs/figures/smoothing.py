# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws Fig. 3 of the paper: a model with noise, smoothed without and within the tolerance, with distances as colours.

blender --background --python docs/figures/smoothing.py -- PICTURE.png [--model MESH] [--tolerance 0.4%]
"""

import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parents[1] / "blender_scripts")]
import command_line as cli  # noqa: E402
import models  # noqa: E402
from addon.native import module as tolvol  # noqa: E402
from addon.shared.command import pictures  # noqa: E402

NOISE = 0.4  # tolerances; the standard deviation of the noise along the normals
ITERATIONS = 100
PANEL = (372, 330)
HEADING = 64
LEGEND = 190


def with_noise(vertices, triangles, deviation):
    """Returns the vertices with noise along their normals, float32."""
    normals = np.zeros_like(vertices, np.float64)
    a, b, c = (vertices[triangles[:, k]].astype(np.float64) for k in range(3))
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], np.cross(b - a, c - a))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-30
    way = deviation * np.random.default_rng(1).standard_normal(len(vertices))
    return (vertices + way[:, None] * normals).astype(np.float32)


def draw(path, mesh, tolerance, like):
    triangles = mesh[1]
    reference = with_noise(*mesh, NOISE * tolerance)
    volume = tolvol.ToleranceVolume(reference, triangles, tolerance)

    def smoothed(bound):
        return tolvol.smooth(reference, triangles, bound, iterations=ITERATIONS, operator="laplacian").vertices

    states = ((reference, "with noise: the reference"), (smoothed(None), "smoothed"))
    states += ((smoothed(volume), "smoothed within the tolerance"),)
    view = pictures.camera(reference, triangles, PANEL, like)
    page = pictures.Page(3 * PANEL[0] + LEGEND, HEADING + PANEL[1])
    for column, (vertices, name) in enumerate(states):
        x = column * PANEL[0]
        farthest = tolvol.directed_hausdorff(vertices, triangles, reference, triangles).upper / tolerance
        page.text(x + PANEL[0] / 2, 14, name, 12, ha="center")
        text = f"every point within {farthest:.2f} ε of the reference" if column else f"{len(triangles):,} triangles"
        page.text(x + PANEL[0] / 2, 38, text, 9, pictures.FAINT, ha="center")
        page.image(x, HEADING, tolvol.render_distance(vertices, triangles, volume, camera=view, size=PANEL, samples=3))
    page.legend(3 * PANEL[0], HEADING + 10, PANEL[1] - 30, "signed", tolerance, volume.diagonal)
    page.save(path, step=3)


def arguments():
    parser = cli.Parser("docs/figures/smoothing.py", description=__doc__.splitlines()[0])
    parser.add_argument("picture", metavar="PICTURE.png")
    parser.add_argument("--model", metavar="MESH", help=".obj, .ply or .stl (default: Blender's monkey, subdivided)")
    parser.add_argument(
        "--tolerance", type=cli.length, default="0.4%", help="a length, or N%% of size (default: 0.4%%)"
    )
    return parser.parse()


def main(options):
    pictures.require("PICTURE", options.picture)
    mesh = models.read(options.model) if options.model else models.arrays(models.build("suzanne"))
    draw(options.picture, mesh, cli.in_units(options.tolerance, tolvol.diagonal(*mesh)), options.model or "")
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
