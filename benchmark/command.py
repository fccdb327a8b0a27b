# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how fast the command tolvol reads and writes files, and its time beside that of the script for Blender.

build/command/bin/python benchmark/command.py MESH [--tolerance 1%] [--runs 5]
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from machine import machine

ROOT = Path(__file__).resolve().parents[1]
MODULE = Path(os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build" / "release" / "python")))
sys.path.insert(0, str(MODULE))
from tolvol.command import mesh_files  # noqa: E402
from tolvol.shared.command.arguments import whole_number  # noqa: E402
from tolvol.shared.files import ply_file, stl_file  # noqa: E402

MEGA = 1e6
BLENDER = "blender", "--background", "--python", str(ROOT / "blender_scripts" / "decimate.py"), "--"
COMMAND = sys.executable, "-m", "tolvol", "decimate"


def best(runs, work):
    """Returns the least time of the processor that a call of work() took, in seconds, and what it returned."""
    least = float("inf")
    for _ in range(runs):
        began = time.process_time()
        found = work()
        least = min(least, time.process_time() - began)
    return least, found


def formats(mesh, folder, runs):
    """Prints a row for each format: the size of the mesh as a file, and the times of reading and writing it."""
    print(
        "| Format | MB | Read, s | MB/s | Of it parsed and checked, MB/s | Write, s |\n|---|---:|---:|---:|---:|---:|"
    )
    for extension in mesh_files.EXTENSIONS:
        path = folder / f"mesh{extension}"
        write, _ = best(1, lambda path=path: mesh_files.write(path, [mesh], folder))
        read, _ = best(runs, lambda path=path: mesh_files.read(path))
        size = path.stat().st_size / MEGA
        parsed = ""
        if parser := {".ply": ply_file, ".stl": stl_file}.get(extension):
            parsed = f"{size / best(runs, lambda path=path, parser=parser: parser.read(path.read_bytes()))[0]:.0f}"
        print(f"| {extension} | {size:.1f} | {read:.3f} | {size / read:.0f} | {parsed} | {write:.2f} |")


def timed(command):
    """Returns the seconds that a program took, the seconds of the processor in it, and its result line."""
    environment = os.environ | {"PYTHONPATH": str(MODULE)}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        sys.exit(f"command.py: {done.stderr}")
    took, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return took, processor, done.stdout.splitlines()[-1]


def whole(path, folder, tolerance, runs):
    """Prints the least time of each program, from its start to its end. They take turns, so that a drift is shared."""
    times, processors, lines = {}, {}, {}
    for _ in range(runs):
        for name, program in (("tolvol decimate", COMMAND), ("decimate.py in Blender", BLENDER)):
            took, processor, lines[name] = timed(
                [*program, str(path), str(folder / "out.ply"), "--tolerance", tolerance]
            )
            times[name] = min(took, times.get(name, took))
            processors[name] = min(processor, processors.get(name, processor))
    print("\n| Program | Whole, s | Of the processor, s | Its result line |\n|---|---:|---:|---|")
    for name, took in times.items():
        print(f"| {name} | {took:.2f} | {processors[name]:.2f} | {lines[name]} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", metavar="MESH")
    parser.add_argument("--tolerance", default="1%", metavar="T")
    parser.add_argument("--runs", type=whole_number(1), default=5, metavar="N")
    options = parser.parse_args()
    mesh = mesh_files.read(options.mesh).objects[0]
    print(f"{machine()}: {Path(options.mesh).name}, {len(mesh.triangles):,} triangles, the best of {options.runs}\n")
    with tempfile.TemporaryDirectory(prefix="tolvol-") as made:
        formats(mesh, Path(made), options.runs)
        whole(options.mesh, Path(made), options.tolerance, options.runs)


if __name__ == "__main__":
    main()
