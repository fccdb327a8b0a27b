# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the decimation of large meshes, whole and cell by cell: time, memory, triangles.

build/command/bin/python benchmark/large.py [--triangles 1 4] [--tolerance 0.1% 1%] [--memory 500MB] [--no-whole]
                                           [--folder DIR] [--write FILE.md]
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import planet
import tables
from machine import machine

ROOT = Path(__file__).resolve().parents[1]
MODULE = Path(os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build" / "release" / "python")))
MILLION = 1_000_000
RESULT = re.compile(r"result within (\S+) %, reference within (\S+) %")


def run(source, folder, tolerance, extra):
    """Runs `tolvol decimate`. Returns the cells of a row from the column "s" on."""
    out, report = folder / "out.ply", folder / "report.json"
    words = [
        sys.executable,
        "-m",
        "tolvol",
        "decimate",
        source,
        out,
        "--tolerance",
        tolerance,
        "--report",
        report,
        *extra,
    ]
    began = time.perf_counter()
    process = subprocess.Popen(
        list(map(str, words)), stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": str(MODULE)}
    )
    text = process.stdout.read()
    _, status, used = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"large.py: {text}")
    took = time.perf_counter() - began
    found = json.loads(report.read_text())
    ends = RESULT.search(text.splitlines()[-1])
    rounds = " ".join(f"{one['cells']}:{one['triangles']:,}" for one in found.get("rounds", ()))
    return (
        f"{took:.0f}",
        f"{used.ru_utime + used.ru_stime:.0f}",
        f"{used.ru_maxrss * 1024 / 1e6:,.0f}",
        f"{found['output']['triangles']:,}",
        f"{ends[1]} / {ends[2]}",
        rounds,
    )


HEADS = [
    "Triangles",
    "Tolerance",
    "Memory",
    "s",
    "Of the processor, s",
    "Peak, MB",
    "Left",
    "Within, %",
    "Cells: left, round by round",
]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=float, nargs="+", default=[1, 4], help="millions")
    parser.add_argument("--tolerance", nargs="+", default=["0.1%"])
    parser.add_argument("--memory", default="500MB")
    parser.add_argument("--no-whole", action="store_true", help="leave out the runs without --memory")
    parser.add_argument("--folder", help="for the files (default: a temporary folder)")
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        for millions in options.triangles:
            source = Path(folder) / "planet.ply"
            count = planet.write(source, planet.rows_of(millions * MILLION))
            for tolerance in options.tolerance:
                for memory in (options.memory,) if options.no_whole else ("", options.memory):
                    extra = ("--memory", memory) if memory else ()
                    row = run(source, Path(folder), tolerance, extra)
                    rows.append([f"{count:,}", tolerance, memory or "whole", *row])
                    print(*rows[-1], sep=" | ", flush=True)
    tables.publish(options.write, "large meshes", f"{machine()}.\n\n{tables.table(HEADS, rows, 'rllrrrrll')}")


if __name__ == "__main__":
    main()
