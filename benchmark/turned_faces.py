# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the faces that a decimation turns over, with the angle kept at 90 degrees and with any angle permitted.

blender --background --python benchmark/turned_faces.py -- [MESH...] [--tolerance 1%] [--write FILE.md]

The meshes are made here, and each MESH. A face counts as turned if at one of 28 of its points all triangles of the
reference within the tolerance look against it. The script fails if there is one with the angle kept, on a mesh whose
neighbours are oriented alike.
"""

import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parent
sys.path[:0] = [str(FOLDER), str(ROOT / "blender_scripts"), str(ROOT / "tests" / "python")]
import command_line as cli  # noqa: E402
from addon.native import module as tolvol  # noqa: E402

sys.modules["tolvol"] = tolvol  # The judge imports it by this name.
import judge  # noqa: E402
import meshes as shapes  # noqa: E402
import models  # noqa: E402
import scan  # noqa: E402
import tables  # noqa: E402
from machine import machine  # noqa: E402

ROUNDING = 1e-3  # degrees
CHUNK = 8  # faces that are judged at once
ANGLES = (180, 90)


def meshes(paths):
    """Yields the name and the arrays of each mesh."""
    for name, (vertices, triangles) in {
        "rough torus": shapes.torus(192, 96, noise=0.004),
        "rough plates that meet in edges": shapes.non_manifold(),
        "rods of a thousandth": shapes.rod(0.001),
        "scan full of pinholes": scan.scan(),
    }.items():
        yield name, vertices.astype(np.float32), triangles
    for path in paths:
        yield (Path(path).name, *models.read(path))


def turned(reference, faces, tolerance):
    """Returns the number of faces that are turned over. Faces and triangles without an area are left out."""
    reference, faces = (_with_area(corners.astype(np.float64)) for corners in (reference, faces))
    parts = (faces[first : first + CHUNK] for first in range(0, len(faces), CHUNK))
    return sum(int((judge.angles_of(reference, part, tolerance) > 90 + ROUNDING).sum()) for part in parts)


def _with_area(corners):
    a, b, c = corners.transpose(1, 0, 2)
    return corners[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0]


def arguments():
    parser = cli.Parser(
        "benchmark/turned_faces.py", description=__doc__.split("\n\n")[0], epilog=__doc__.split("\n\n")[2]
    )
    parser.add_argument("meshes", metavar="MESH", nargs="*", help="a file that is decimated as well")
    parser.add_argument(
        "--tolerance", type=cli.length, default=cli.length("1%"), metavar="T", help="N%% of size, or a length (1%%)"
    )
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    return parser.parse()


def main(options):
    rows, failed = [], []
    for name, vertices, triangles in meshes(options.meshes):
        tolerance = cli.in_units(options.tolerance, tolvol.diagonal(vertices, triangles))
        volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
        counts, left = [], []
        for angle in ANGLES:
            result = tolvol.decimate(vertices, triangles, volume, max_normal_angle=angle)
            counts.append(turned(vertices[triangles], result.vertices[result.triangles], tolerance))
            left.append(len(result.triangles))
        facts = tolvol.solidity(vertices, triangles)
        normals = result.report["normals"]
        excused = 0 if normals is None else normals["exceeded_after"] + normals["unsure"]
        if counts[-1] > excused and facts["manifold"] and facts["oriented"]:
            failed.append(name)
        rows.append([name, *(f"{count:,}" for count in (len(triangles), *counts, *left))])
        print(*rows[-1], sep="\t", flush=True)
    heads = ["Mesh", "Triangles", "Turned, 180\N{DEGREE SIGN}", "90\N{DEGREE SIGN}"]
    heads += ["Triangles left, 180\N{DEGREE SIGN}", "90\N{DEGREE SIGN}"]
    if options.write:
        tables.write(options.write, "turned faces", f"{machine()}\n\n{tables.table(heads, rows, 'lrrrrr')}")
    if failed:
        print("faces are turned over:", ", ".join(failed))
    return 1 if failed else 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
