# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how fast binary PLY and STL files are read and written on one core, beside trimesh, and read in Blender.

build/command/bin/python benchmark/files.py [--triangles 1] [--runs 3] [--write docs/benchmark.md]
"""

import argparse
import collections
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh

import planet
import tables
from machine import machine

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build" / "release" / "python")))
from tolvol.command import mesh_files  # noqa: E402
from tolvol.command.mesh import Attribute, Mesh  # noqa: E402
from tolvol.shared.files import ply_file, stl_file  # noqa: E402

MEGA = 1e6
MIXED = ".ply of triangles and quads"
# Reads each file by the add-on as it is, and by Blender's own reader.
IN_BLENDER = """
import sys, time
sys.path.insert(0, {root!r})
import addon
from addon.files import file_io, plain_files
own = plain_files.read
for path in {paths!r}:
    for name, read in (("own", own), ("blender", lambda *_: False)):
        plain_files.read = read
        for _ in range({runs}):
            began = time.process_time()
            file_io.read_file(path)
            print("seconds", name, path, time.process_time() - began)
"""


def medians(runs, *works):
    """Returns the median seconds of the processor of a call of each work. They take turns, so that a drift is shared."""
    seconds = [[] for _ in works]
    for _ in range(runs):
        for taken, work in zip(seconds, works):
            began = time.process_time()
            work()
            taken.append(time.process_time() - began)
    return list(map(statistics.median, seconds))


def quads_and_triangles(path, mesh):
    """Writes a file in which every other pair of triangles is a quad, as the lists of a remeshed scan are of two lengths.

    Every fourth triangle is left out."""
    triangles = mesh.triangles[: len(mesh.triangles) // 4 * 4].reshape(-1, 4, 3)
    rows = np.empty(len(triangles), [("4", "u1"), ("quad", "<i4", 4), ("3", "u1"), ("triangle", "<i4", 3)])
    rows["4"], rows["3"] = 4, 3
    rows["quad"] = np.concatenate([triangles[:, 0], triangles[:, 1, 2:]], 1)
    rows["triangle"] = triangles[:, 2]
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {2 * len(rows)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(head.encode() + mesh.vertices.tobytes() + rows.tobytes())


def made(folder, triangles):
    """Returns ({words for a file: its path}, {words: the Mesh that is written, where one is})."""
    planet.write(folder / "plain.ply", planet.rows_of(triangles))
    (mesh,) = mesh_files.read(folder / "plain.ply").objects
    random, count = np.random.default_rng(1), len(mesh.vertices)
    values = {
        "normals": random.normal(size=(count, 3)).astype("f4"),
        "colours": random.integers(0, 256, (count, 4)).astype("u1"),
        "UVs": random.random((count, 2)).astype("f4"),
    }
    rich = Mesh("rich", mesh.vertices, mesh.triangles, {k: Attribute(v, mesh.triangles) for k, v in values.items()})
    files = {
        ".ply": folder / "plain.ply",
        ".ply with normals, colours, UVs": folder / "rich.ply",
        MIXED: folder / "mixed.ply",
        ".stl": folder / "plain.stl",
    }
    mesh_files.write(folder / "rich.ply", [rich], folder)
    quads_and_triangles(folder / "mixed.ply", mesh)
    mesh_files.write(folder / "plain.stl", [mesh], folder)
    return files, {".ply": mesh, ".ply with normals, colours, UVs": rich, ".stl": mesh}


def in_command(files, meshes, folder, runs):
    rows = []
    for name, path in files.items():
        megabytes = path.stat().st_size / MEGA
        module = stl_file if path.suffix == ".stl" else ply_file
        works = [
            lambda path=path, module=module: module.read(path.read_bytes()),
            lambda path=path: mesh_files.read(path),
            lambda path=path: trimesh.load_mesh(path, process=False),
        ]
        is_known = name != MIXED  # trimesh says of such a file that its length is unexpected.
        parsed, whole, *others = medians(runs, *works[: 2 + is_known])
        row = [
            name,
            f"{megabytes:.1f}",
            f"{megabytes / parsed:,.0f}",
            f"{megabytes / whole:,.0f}",
            f"{others[0] / whole:.1f}" if others else "cannot",
        ]
        if name in meshes:
            target, mesh = folder / f"out{path.suffix}", meshes[name]
            ready = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
            own, other = medians(
                runs,
                lambda target=target, mesh=mesh: mesh_files.write(target, [mesh], folder),
                lambda target=target, ready=ready: ready.export(target),
            )
            plain = not mesh.attributes
            row += [f"{megabytes / own:,.0f}", f"{other / own:.1f}" if plain else ""]
        else:
            row += ["", ""]
        rows.append(row)
    heads = ["File", "MB", "Parsed, MB/s", "Read, MB/s", "trimesh takes", "Written, MB/s", "trimesh takes"]
    return tables.table(heads, rows, "lrrrrrr")


def in_blender(files, runs):
    """Returns the table for those of the files that the scripts in Blender read themselves."""
    files = {name: str(path) for name, path in files.items() if path.suffix == ".ply"}
    code = IN_BLENDER.format(root=str(ROOT), paths=list(files.values()), runs=runs)
    done = subprocess.run(
        ["blender", "--background", "--factory-startup", "--python-expr", code], capture_output=True, text=True
    )
    seconds = collections.defaultdict(list)
    for reader, path, value in re.findall(r"seconds (\w+) (\S+) (\S+)", done.stdout):
        seconds[reader, path].append(float(value))
    rows = []
    for name, path in files.items():
        own, other = (statistics.median(seconds[reader, path]) for reader in ("own", "blender"))
        rows.append([name, f"{own:.2f}", f"{other:.2f}", f"{other / own:.1f}"])
    return tables.table(["File", "The scripts, s", "By Blender's reader, s", "Times as fast"], rows, "lrrr")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=float, default=1, help="millions")
    parser.add_argument("--runs", type=int, default=3, help="the median counts")
    parser.add_argument("--write", metavar="FILE.md", help="put the tables into this file")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        files, meshes = made(folder, options.triangles * MEGA)
        count = len(meshes[".stl"].triangles)
        text = f"{machine()}, {count:,} triangles.\n\n{in_command(files, meshes, folder, options.runs)}"
        tables.publish(options.write, "files", text)
        files, meshes = made(folder, MEGA / 4)
        text = f"{len(meshes['.stl'].triangles):,} triangles.\n\n{in_blender(files, options.runs)}"
        tables.publish(options.write, "files in Blender", text)


if __name__ == "__main__":
    main()
