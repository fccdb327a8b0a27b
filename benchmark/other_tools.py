#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares decimation by other tools: same meshes, same tolerance, judged by the same certified distances.

/usr/bin/python3 benchmark/other_tools.py MESH... [--tolerance 1% --tolerance 0.1%] [--only NAME...] [--again]
    [--write FILE.md] [--table NAME] [--picture FILE.png] [--curves FILE.png] [--json FILE]

MESH is an .obj, .ply or .stl file, or the name of a mesh that benchmark/generated.py makes: `scan`, with the noise of a range
camera, or `sphere`. The calls of the tools are in benchmark/tool_calls.py, with quotations from their documentation. The tools
are installed from PyPI into build/other_tools/venv, in the versions of benchmark/other_tools.txt; CGAL's is built where
libcgal-dev is installed. Each tool runs in a process of its own. Seconds are processor seconds of the tool's call alone, on all
cores together, the least of three if one takes less than 5 s. Then the tool's parameter is searched for the fewest triangles
that keep both directions, unless one call takes more than 5 s. Results are kept in build/other_tools/results and used the next
time; --again measures them anew.
"""

import argparse
import hashlib
import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import solid
import tables
import tool_server
from generated import GENERATED
from machine import machine
from tool_calls import ROOT, TOOLS
from tool_curves import draw_curves
from tool_page import draw, row, text, title
from tool_worker import Worker

sys.path.insert(0, os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build" / "release" / "python")))
try:
    import tolvol
    from tolvol.shared.command.arguments import USAGE, Stop, in_units, length, require_folder, whole_number
except ImportError as error:
    sys.exit(f"other_tools.py: the module tolvol does not load ({error}): run sh setup.sh --tests")
from tool_setup import BUILD, PYTHON, set_up, versions  # noqa: E402 (it needs the package)

REPEATS, QUICK = 3, 5  # number of calls of a tool whose call takes less than so many processor seconds
SEARCH_CALLS = 16  # number of calls of a tool while its parameter is searched
SEARCH_QUICK = 5  # processor seconds; the parameter is not searched if one call takes longer
SEARCH_LIMIT = 60  # seconds; a call in the search that takes longer counts as not kept
FIRST_RATIO = 100  # of the triangles of the input over those of the result, if a search has nothing to start from
FIRST_ANGLE = math.radians(5)  # which is the default of Blender's Decimate, planar
NEAR = 1.01  # ratio of the ends of a bracket that is not bisected any more

FORMATS = (".obj", ".ply", ".stl")


@dataclass
class Mesh:
    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    size: float

    def digest(self):
        return digest(self.vertices.tobytes() + self.triangles.tobytes())


def digest(data):
    return hashlib.sha256(data).hexdigest()[:8]


def read_mesh(path, folder):
    if path in GENERATED:
        vertices, triangles = GENERATED[path]()
        return Mesh(path, vertices, triangles, tolvol.diagonal(vertices, triangles))
    arrays = folder / "vertices.npy", folder / "triangles.npy"
    done = subprocess.run([PYTHON, tool_server.__file__, "read", path, *arrays], capture_output=True, text=True)
    if done.returncode:
        raise Stop(f"{path}: {done.stderr.strip().splitlines()[-1]}")
    vertices, triangles = (np.load(file) for file in arrays)
    if not len(triangles):
        raise Stop(f"{path}: the file has no triangles")
    return Mesh(Path(path).stem, vertices, triangles, tolvol.diagonal(vertices, triangles))


# ---- judging and searching


def interval(a, b, tolerance):
    """Returns [lower, upper] of the largest distance of a point of a to b, in tolerances.

    The interval decides whether the distance is within the tolerance, and it is narrow if the distance is beyond.
    """
    found = tolvol.directed_hausdorff(*a, *b, bound=tolerance)
    if found.upper > tolerance:
        found = tolvol.directed_hausdorff(*a, *b)
    return [found.lower / tolerance, found.upper / tolerance]


def directions(mesh, answer):
    """Returns {"forward": (a, b), "backward": (a, b)} for the result of a tool and the mesh. Distances are from a to b."""
    reference = mesh.vertices.astype(np.float64), mesh.triangles
    result = answer["vertices"], answer["triangles"]
    return {"forward": (result, reference), "backward": (reference, result)}


def judge(mesh, tolerance, answer):
    """Returns {"forward": interval, "backward": interval}: the certified distances of the result of a tool."""
    return {way: interval(*pair, tolerance) for way, pair in directions(mesh, answer).items()}


def keeps_both(mesh, tolerance, answer):
    pairs = directions(mesh, answer).values()
    return all(tolvol.directed_hausdorff(*a, *b, bound=tolerance).upper <= tolerance for a, b in pairs)


def search(start, count, calls=SEARCH_CALLS):
    """Returns (parameter, triangles) with the fewest triangles, or None.

    count(parameter) returns the number of triangles, or None if the result does not keep both directions. From `start` on the
    parameter changes in growing steps until one is kept and a larger one is not. Then the bracket is bisected on a logarithmic
    scale. A larger parameter does not always leave a worse result, so the remaining calls try some larger ones.
    """
    found = {}

    def ask(parameter):
        found[parameter] = count(parameter)
        return found[parameter] is not None

    low = high = None
    parameter, step = start, 2.0
    while len(found) < calls and (low is None or high is None):
        if ask(parameter):
            low, parameter = parameter, parameter * step
        else:
            high, parameter = parameter, parameter / step
        step *= step
        if not 1e-300 < parameter < 1e300:
            break
    while low and high and len(found) < calls and high / low > NEAR:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if ask(middle) else (low, middle)
    above = 1.0
    while low and len(found) < calls:
        above += 0.05
        ask(low * above)
    return min(((n, x) for x, n in found.items() if n is not None), default=(None, None))[::-1] if low else None


def measure(name, mesh, tolerance, threads, limit):
    """Returns the entry of a tool: its result for the tolerance, and the fewest triangles found by the search."""
    tool = TOOLS[name]
    entry = {}
    with tempfile.TemporaryDirectory() as folder:
        worker = Worker(PYTHON, name, mesh, threads, folder)
        try:
            if tool.run:
                entry = result_for(worker, mesh, tolerance, limit)
            if (
                tool.search
                and "failure" not in entry
                and (tool.search is not tool.run or entry["seconds"] <= SEARCH_QUICK)
            ):
                entry["search"] = fewest(tool, worker, mesh, tolerance, entry, min(limit, SEARCH_LIMIT))
        finally:
            worker.end()
    return entry


def result_for(worker, mesh, tolerance, limit):
    """Returns the part of an entry that is about the result for the tolerance."""
    answer = worker.ask("run", tolerance, limit)
    if "failure" in answer:
        return {"failure": answer["failure"]}
    entry = {"seconds": answer["seconds"], "triangles": len(answer["triangles"])}
    for _ in range(REPEATS - 1):
        if entry["seconds"] < QUICK:
            again = worker.ask("run", tolerance, limit)
            entry["seconds"] = min(entry["seconds"], again.get("seconds", math.inf))
    if entry["triangles"]:
        try:
            entry |= judge(mesh, tolerance, answer)
        except tolvol.TolvolError as error:
            return {**entry, "failure": f"no mesh: {error}"}
        entry["solid"] = solid.judge(answer["vertices"], answer["triangles"])
    return entry


def fewest(tool, worker, mesh, tolerance, entry, limit):
    """Searches the fewest triangles that keep both directions.

    Returns {} or, if a result was found, its "triangles" and "parameter", as "call" the seconds of its call, and as "solid"
    the judgement of solid.judge().
    """
    calls, least = {}, None

    def count(parameter):
        answer = worker.ask("search", parameter, limit)
        if "failure" in answer or not len(answer["triangles"]):
            return None
        calls[parameter] = answer["seconds"]
        try:
            kept = keeps_both(mesh, tolerance, answer)
        except tolvol.TolvolError:
            return None
        nonlocal least
        if kept and (least is None or len(answer["triangles"]) < len(least["triangles"])):
            least = answer
        return len(answer["triangles"]) if kept else None

    starts = {
        "error": tolerance,
        "ratio": len(mesh.triangles) / max(4, entry.get("triangles", len(mesh.triangles) / FIRST_RATIO)),
        "angle": FIRST_ANGLE,
    }
    best = search(starts[tool.parameter], count)
    if best is None:
        return {}
    found = {"parameter": best[0], "triangles": best[1], "call": calls[best[0]]}
    return {**found, "solid": solid.judge(least["vertices"], least["triangles"])}


def remembered(path, again, work):
    """Returns the entry in the file. If there is none, or if `again` is set, it calls work() and stores the result."""
    if path.exists() and not again:
        return json.loads(path.read_text())
    entry = work()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(entry, indent=1) + "\n")
    return entry


def compare(mesh, tolerance, options, numbers):
    """Returns an entry for each tool."""
    entries = {}
    for name in options.only:
        number = numbers[TOOLS[name].package]
        if number is None:
            entries[name] = {"failure": f"{TOOLS[name].package} is not installed"}
        else:
            percent = 100 * tolerance / mesh.size
            if TOOLS[name].package == "tolvol":  # Its version number stays the same while its code changes.
                number += "-" + digest(Path(tolvol._native.__file__).read_bytes())
            label = f"{mesh.name}-{mesh.digest()}-{percent:.6g}-{options.threads}-{options.limit}-{name}-{number}.json"
            entries[name] = remembered(
                BUILD / "results" / label,
                options.again,
                lambda name=name: measure(name, mesh, tolerance, options.threads, options.limit),
            )
        print(" | ".join(row(name, entries[name])), flush=True)
    return entries


# ---- the command


def percentage_or_length(word):
    value, percent = length(word)
    if percent and value > 100:
        raise argparse.ArgumentTypeError(f"{word!r} is more than the size of the mesh")
    return value, percent


def arguments(words):
    first, _, *rest = __doc__.split("\n\n")
    parser = argparse.ArgumentParser(
        prog="other_tools.py",
        description=first,
        epilog=rest[0],
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("mesh", nargs="+", metavar="MESH", help=", ".join([*FORMATS, *GENERATED]))
    parser.add_argument(
        "--tolerance",
        action="append",
        type=percentage_or_length,
        metavar="T",
        help="N%% of size (1%%), or a length; may be repeated; default: 1%% and 0.1%%",
    )
    parser.add_argument("--only", nargs="+", choices=TOOLS, default=list(TOOLS), metavar="NAME", help=", ".join(TOOLS))
    parser.add_argument("--again", action="store_true", help="also measure results that are stored")
    parser.add_argument("--write", metavar="FILE.md", help="put the table into this file")
    parser.add_argument(
        "--table", default="other tools", metavar="NAME", help="the name of the table in FILE.md (default: %(default)s)"
    )
    parser.add_argument("--picture", metavar="FILE.png", help="draw triangles against processor seconds to this file")
    parser.add_argument("--curves", metavar="FILE.png", help="draw triangles against the tolerance to this file")
    parser.add_argument("--json", metavar="FILE", help="write the figures to this file")
    parser.add_argument(
        "--limit",
        type=whole_number(1),
        default=300,
        metavar="S",
        help="seconds after which a call is ended (default: %(default)s)",
    )
    parser.add_argument(
        "--threads",
        type=whole_number(1),
        default=len(os.sched_getaffinity(0)),
        metavar="N",
        help="cores for each tool, default: all, %(default)s",
    )
    parser.error = refuse
    options = parser.parse_args(words)
    options.tolerance = options.tolerance or [(1.0, True), (0.1, True)]
    return options


def refuse(message):
    raise Stop(f"{message}; see --help")


def main(options):
    for path in options.mesh:
        if path in GENERATED:
            continue
        if not Path(path).is_file():
            raise Stop(f"{path}: no such file")
        if Path(path).suffix.lower() not in FORMATS:
            raise Stop(f"{path}: not one of {', '.join(FORMATS)}")
    for option in ("write", "picture", "curves", "json"):
        if getattr(options, option):
            require_folder(getattr(options, option), f"--{option}")

    set_up(options.only)
    numbers = {**versions(), "tolvol": tolvol.__version__}
    figures = {"machine": machine(), "threads": options.threads, "versions": numbers, "cases": []}
    for path in options.mesh:
        with tempfile.TemporaryDirectory() as folder:
            mesh = read_mesh(path, Path(folder))
        state = solid.judge(mesh.vertices, mesh.triangles)
        for wanted in options.tolerance:
            tolerance = in_units(wanted, mesh.size)
            if tolerance > mesh.size:
                raise Stop(f"--tolerance {tolerance:g}: {path} is only {mesh.size:g} large")
            case = {
                "mesh": mesh.name,
                "triangles": len(mesh.triangles),
                "size": mesh.size,
                "tolerance": tolerance,
                "percent": float(f"{100 * tolerance / mesh.size:.6g}"),
                "solid": state,
            }
            print(title(case), flush=True)
            case["tools"] = compare(mesh, tolerance, options, numbers)
            figures["cases"].append(case)
    if options.json:
        Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")
    if options.write:
        tables.write(options.write, options.table, text(figures))
    if options.picture:
        draw(figures["cases"], options.picture)
    if options.curves:
        draw_curves(figures["cases"], options.curves)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(arguments(sys.argv[1:])))
    except Stop as stop:
        print(f"other_tools.py: {stop}", file=sys.stderr)
        sys.exit(USAGE)
