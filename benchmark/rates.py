# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how many triangles per second each method of checking decides, on candidates made from a mesh by small moves.

blender --background --python benchmark/rates.py -- [MESH...] --tolerance 1% --json FILE [--precision 2] [--write FILE.md]

Without MESH the script takes Blender's monkey with 251,904 triangles and with noise. *One query* decides the whole mesh as one
group. *Groups* have six faces each, like the ring of a collapse. *Faces* gives a verdict for each of a million faces. Times
are the best of several turns and include the call from Python. Beside each rate stands the share of the candidates that was
proved inside. A *picture* sends the mesh to the GPU and colours it by distance, with one sample per pixel.
"""

import json
import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parent / "blender_scripts")]
import command_line as cli  # noqa: E402
import decimation  # noqa: E402
import models  # noqa: E402
import tables  # noqa: E402
from addon.native import module as tolvol  # noqa: E402
from machine import machine  # noqa: E402

REPEATS = 5
MOVE = 0.1  # the largest move of a vertex along each axis, in tolerances
RING = 6
BATCH = 1_000_000
PICTURE = (1024, 1024)
TABLE_1 = 1.1  # the precision of [Botsch04, Table 1]
METHODS = ("gl_certificate", "occlusion_query", "paper", "paper_half_h")
FIELDS = ("scatter", "gl", "fast_marching")


def measure(name, vertices, triangles, options):
    tolerance = cli.in_units(options.tolerance, tolvol.diagonal(vertices, triangles))
    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, precision=options.precision)
    rng = np.random.default_rng(1)
    points = (vertices + MOVE * tolerance * rng.uniform(-1, 1, vertices.shape)).astype(np.float32)
    batch = np.resize(triangles, (BATCH, 3))
    whole = np.zeros(len(triangles), np.int32)
    rings = np.arange(len(triangles), dtype=np.int32) // RING

    def build(field):
        return tolvol.ToleranceVolume(vertices, triangles, tolerance, precision=TABLE_1, field=field, threads=1)

    runs = {("certificate", "one thread"): lambda: volume.check(points, triangles, threads=1)}
    runs["certificate", "faces, one thread"] = lambda: volume.check(points, batch, threads=1)
    for method in METHODS:
        runs[method, "faces"] = lambda method=method: volume.check(points, batch, method=method)
    for method in METHODS[1:]:
        runs[method, "one query"] = lambda method=method: volume.check(points, triangles, groups=whole, method=method)
        runs[method, "groups"] = lambda method=method: volume.check(points, triangles, groups=rings, method=method)

    timed, results = decimation.Stopwatch(), {}
    for _ in range(REPEATS):
        for key, call in runs.items():
            results[key] = timed(key, call)
    entries = []
    # The first picture is not timed: it prepares the volume's grid and the GL context.
    tolvol.render_distance(points, triangles, volume, size=PICTURE, samples=1)
    for _ in range(REPEATS):
        timed(("picture", "drawn"), lambda: tolvol.render_distance(points, triangles, volume, size=PICTURE, samples=1))
        for field in FIELDS:
            timed((field, "field"), lambda field=field: build(field))
    drawn = timed.seconds.pop(("picture", "drawn"))
    fields = {field: timed.seconds.pop((field, "field")) for field in FIELDS}
    for (method, what), seconds in timed.seconds.items():
        verdict = results[method, what].verdicts
        entries.append(
            {
                "method": results[method, what].method,
                "what": what,
                "seconds": seconds,
                "triangles_per_second": len(verdict) / seconds,
                "groups_per_second": len(verdict) / RING / seconds if what == "groups" else None,
                "inside_share": float((verdict == 2).mean()),
            }
        )
    return {
        "file": name,
        "triangles": len(triangles),
        "precision": volume.precision,
        "rates": entries,
        "picture_triangles_per_second": len(triangles) / drawn,
        "field_seconds": fields,
    }


def line(entry):
    groups = f", {entry['groups_per_second']:,.0f} groups/s" if entry["groups_per_second"] else ""
    return (
        f"  {entry['method']}, {entry['what']}: {entry['triangles_per_second'] / 1e6:.2f} M triangles/s{groups}, "
        f"{100 * entry['inside_share']:.1f} % inside"
    )


def table(meshes):
    rows = []
    for mesh in meshes:
        rows.append(
            [f"***{Path(mesh['file']).name}, {mesh['triangles']:,} triangles, ρ = {mesh['precision']:g}***", *4 * [""]]
        )
        for e in mesh["rates"]:
            groups = f"{e['groups_per_second']:,.0f}" if e["groups_per_second"] else ""
            speed, inside = f"{e['triangles_per_second'] / 1e6:.2f}", f"{100 * e['inside_share']:.1f} %"
            rows.append([e["method"], e["what"], speed, groups, inside])
        rows.append(["picture, 1024 x 1024", "", f"{mesh['picture_triangles_per_second'] / 1e6:.2f}", "", ""])
        for field, seconds in mesh["field_seconds"].items():
            where = "in GL" if field == "gl" else "one thread"
            rows.append([f"field, {field.replace('_', ' ')}", f"ρ = {TABLE_1}, {where}: {seconds:.3f} s", "", "", ""])
    return tables.table(["Method", "Setting", "M triangles/s", "Groups/s", "Inside"], rows, "llrrr")


def arguments():
    parser = cli.Parser("benchmark/rates.py", description=__doc__.split("\n\n")[0], epilog=__doc__.split("\n\n")[2])
    parser.add_argument("mesh", nargs="*", metavar="MESH", help=".obj, .ply or .stl")
    parser.add_argument("--tolerance", required=True, type=cli.length, metavar="T", help="N%% of size, or a length")
    parser.add_argument("--precision", type=float, default=2, metavar="P", help="grid nodes per tolerance (default 2)")
    parser.add_argument("--json", metavar="FILE", help="write the figures to this file")
    parser.add_argument("--write", metavar="FILE.md", help="put the figures into this file as a table")
    return parser.parse()


def main(options):
    for option in ("json", "write"):
        if getattr(options, option):
            cli.require_folder(getattr(options, option), f"--{option}")
    figures = {
        "version": tolvol.__version__,
        "machine": machine(),
        "renderer": tolvol.renderer(),
        "meshes": [],
    }
    print(f"{figures['machine']}; {figures['renderer']}")
    meshes = [(path, *models.read(path)) for path in options.mesh]
    for mesh in meshes or [("suzanne-4", *models.arrays(models.build("suzanne-4")))]:
        entry = measure(*mesh, options)
        figures["meshes"].append(entry)
        print(f"{entry['file']}: {entry['triangles']:,} triangles, precision {entry['precision']:g}")
        for rate in entry["rates"]:
            print(line(rate), flush=True)
        print(f"  picture of 1024 x 1024: {entry['picture_triangles_per_second'] / 1e6:.2f} M triangles/s")
        fields = (f"{field} {seconds:.3f} s" for field, seconds in entry["field_seconds"].items())
        print(f"  field at precision {TABLE_1}, on one thread or in GL: {', '.join(fields)}", flush=True)
    if options.write:
        where = f"{figures['machine']}; {figures['renderer']}; version {figures['version']}."
        tables.write(options.write, "rates", f"{where}\n\n{table(figures['meshes'])}")
    if options.json:
        Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    cli.run(__file__, arguments, main)
