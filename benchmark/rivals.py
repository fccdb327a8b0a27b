#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Other people's decimation asked for the same tolerance on the same meshes, and judged by the same certified distances.

/usr/bin/python3 benchmark/rivals.py MESH... [--tolerance 1% --tolerance 0.1%] [--only NAME...] [--again]
    [--write FILE.md] [--picture FILE.png] [--json FILE]

MESH: .obj, .ply or .stl. The tools are in benchmark/rival_tools.py, each with what its documentation says; in the versions of
benchmark/rivals.txt they are installed from PyPI into build/rivals/venv, and CGAL's is built where libcgal-dev is installed.
Each runs in a process of its own: seconds are those of its call alone, the best of three where one takes less than 5 s.
Then its parameter is searched for the fewest triangles that keep both directions, unless one call takes more than 20 s.
Results are kept in build/rivals/results and taken from there the next time; --again measures anew.
"""

import argparse
import contextlib
import hashlib
import json
import math
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "blender_scripts"))
import rival_tools  # noqa: E402
import tables  # noqa: E402
from common import USAGE, Stop, in_units, length, machine, require_folder, whole_number  # noqa: E402
from rival_tools import CGAL_PROGRAM, ROOT, TOOLS  # noqa: E402

sys.path.insert(0, os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build" / "release" / "python")))
try:
    import tolvol
except ImportError as error:
    sys.exit(f"rivals.py: the module tolvol does not load ({error}): run sh setup.sh --tests")

HERE = Path(__file__).resolve().parent
BUILD = ROOT / "build" / "rivals"
PYTHON = BUILD / "venv" / "bin" / "python"
PINS = HERE / "rivals.txt"
CGAL_SOURCE = HERE / "rivals_cgal.cpp"
CGAL_HEADER = Path("/usr/include/CGAL/version.h")

REPEATS, QUICK = 3, 5  # calls of what takes less than so many seconds
SEARCH_CALLS = 16  # of a tool while its parameter is searched,
SEARCH_QUICK = 20  # which is not done when one takes more than so many seconds,
SEARCH_LIMIT = 60  # and one that takes longer than that counts as not kept
NEAR = 1.01  # a bracket so narrow is not bisected any more

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


# ---- the tools' own ground


def set_up(names):
    """The virtual environment, anew when the pins have changed, and CGAL's program."""
    if not PYTHON.exists() or not same_text(PINS, BUILD / "venv" / PINS.name):
        print("rivals: a virtual environment, some minutes", flush=True)
        shutil.rmtree(BUILD / "venv", ignore_errors=True)
        quietly(sys.executable, "-m", "venv", BUILD / "venv")
        quietly(PYTHON, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--requirement", PINS)
        shutil.copy(PINS, BUILD / "venv")
    if "cgal" in names and CGAL_HEADER.exists() and newer(CGAL_SOURCE, CGAL_PROGRAM):
        print("rivals: CGAL's program, half a minute", flush=True)
        # As CGAL's own releases are built; rounding by the processor's mode is what its intervals rely on.
        options = ["-std=c++17", "-O3", "-DNDEBUG", "-frounding-math"]
        quietly("g++", *options, CGAL_SOURCE, "-o", CGAL_PROGRAM, "-lgmp", "-lmpfr")


def same_text(a, b):
    return b.exists() and a.read_text() == b.read_text()


def newer(source, product):
    return not product.exists() or source.stat().st_mtime > product.stat().st_mtime


def quietly(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines()
        raise Stop(f"{Path(command[0]).name} failed: {said[-1] if said else f'exit code {done.returncode}'}")


def versions():
    """Of each package; None for CGAL where it is not installed."""
    found = dict(re.findall(r"^([a-z0-9]+)==(\S+)$", PINS.read_text(), re.M))
    header = CGAL_HEADER.read_text() if CGAL_HEADER.exists() else ""
    number = re.search(r"#define CGAL_VERSION (\S+)", header)
    return {**found, "cgal": number and number[1], "tolvol": tolvol.__version__}


def read_mesh(path, folder):
    arrays = folder / "vertices.npy", folder / "triangles.npy"
    done = subprocess.run([PYTHON, rival_tools.__file__, "read", path, *arrays], capture_output=True, text=True)
    if done.returncode:
        raise Stop(f"{path}: {done.stderr.strip().splitlines()[-1]}")
    vertices, triangles = (np.load(file) for file in arrays)
    if not len(triangles):
        raise Stop(f"{path}: no triangles")
    return Mesh(Path(path).stem, vertices, triangles, tolvol.size(vertices, triangles))


class Worker:
    """A process with one tool and one mesh. It is started when it is asked, and again after it was ended."""

    def __init__(self, name, mesh, threads, folder):
        self.folder = Path(folder)
        np.save(self.folder / "vertices.npy", mesh.vertices)
        np.save(self.folder / "triangles.npy", mesh.triangles)
        self.command = [PYTHON, rival_tools.__file__, "serve", name, "vertices.npy", "triangles.npy", str(threads)]
        self.threads = threads
        self.process = None

    def start(self):
        cores = sorted(os.sched_getaffinity(0))[: self.threads]
        self.process = subprocess.Popen(
            self.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=(self.folder / "log.txt").open("w"),
            text=True,
            cwd=self.folder,
            env={**os.environ, "OMP_NUM_THREADS": str(self.threads)},
            start_new_session=True,  # so that its own processes end with it
            preexec_fn=lambda: os.sched_setaffinity(0, cores),
        )

    def ask(self, what, parameter, limit):
        """{"seconds", "vertices", "triangles"}, or {"failure"}."""
        if not self.process:
            self.start()
        try:
            self.process.stdin.write(json.dumps({"what": what, "parameter": parameter}) + "\n")
            self.process.stdin.flush()
            ready = select.select([self.process.stdout], [], [], limit)[0]
            answer = json.loads(self.process.stdout.readline()) if ready else None
        except (BrokenPipeError, json.JSONDecodeError):
            code = self.end()
            return {"failure": f"crashed ({signal.Signals(-code).name if code < 0 else f'exit code {code}'})"}
        if answer is None:
            self.end()
            return {"failure": f"did not end in {limit} s"}
        if "failure" not in answer:
            answer["vertices"] = np.load(self.folder / "result_vertices.npy")
            answer["triangles"] = np.load(self.folder / "result_triangles.npy")
        return answer

    def end(self):
        """The exit code: its own where it has ended by itself."""
        if not self.process:
            return 0
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()  # which ends one that waits
        try:
            code = self.process.wait(1)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            code = self.process.wait()
        self.process.stdout.close()
        self.process = None
        return code


# ---- judging and searching


def interval(a, b, tolerance):
    """[lower, upper] of the largest distance of a point of a to b, in tolerances: decided, and narrow where it is beyond."""
    found = tolvol.hausdorff(*a, *b, bound=tolerance)
    if found.upper > tolerance:
        found = tolvol.hausdorff(*a, *b)
    return [found.lower / tolerance, found.upper / tolerance]


def directions(mesh, answer):
    """(a, b) of both ways between what a tool returned and the mesh: the distance is of a's points to b."""
    reference = mesh.vertices.astype(np.float64), mesh.triangles
    result = answer["vertices"], answer["triangles"]
    return {"forward": (result, reference), "backward": (reference, result)}


def judge(mesh, tolerance, answer):
    """The certified distances of what a tool returned: {"forward", "backward"}."""
    return {way: interval(*pair, tolerance) for way, pair in directions(mesh, answer).items()}


def keeps_both(mesh, tolerance, answer):
    pairs = directions(mesh, answer).values()
    return all(tolvol.hausdorff(*a, *b, bound=tolerance).upper <= tolerance for a, b in pairs)


def kept(entry):
    """What is proved: "both", "forward" (the result within the tolerance of the reference), "backward", or "no"."""
    forward, backward = (entry.get(way) is not None and entry[way][1] <= 1 for way in ("forward", "backward"))
    return {(True, True): "both", (True, False): "forward", (False, True): "backward"}.get((forward, backward), "no")


def search(start, count, calls=SEARCH_CALLS):
    """(parameter, triangles) with the fewest triangles, or None. `count(parameter)`: the triangles, None where not kept.

    From `start` on in growing steps until one parameter is kept and a larger one is not, then bisected on a logarithmic scale.
    What a larger parameter does is not always worse: the calls that are left try some above.
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
    """What a tool leaves when it is asked for the tolerance, and the fewest found."""
    tool = TOOLS[name]
    entry = {}
    with tempfile.TemporaryDirectory() as folder:
        worker = Worker(name, mesh, threads, folder)
        try:
            answer = worker.ask("run", tolerance, limit)
            if "failure" in answer:
                return {"failure": answer["failure"]}
            entry["seconds"] = answer["seconds"]
            entry["triangles"] = len(answer["triangles"])
            for _ in range(REPEATS - 1):
                if entry["seconds"] < QUICK:
                    again = worker.ask("run", tolerance, limit)
                    entry["seconds"] = min(entry["seconds"], again.get("seconds", math.inf))
            if entry["triangles"]:
                try:
                    entry |= judge(mesh, tolerance, answer)
                except tolvol.TolvolError as error:
                    return {**entry, "failure": f"no mesh: {error}"}
            quick = tool.search is not tool.run or entry["seconds"] <= SEARCH_QUICK
            if tool.search and quick:
                entry["search"] = fewest(tool, worker, mesh, tolerance, entry, min(limit, SEARCH_LIMIT))
        finally:
            worker.end()
    return entry


def fewest(tool, worker, mesh, tolerance, entry, limit):
    """{"seconds": of all, and where one is kept: "triangles", "parameter", "call": the seconds of its one call}."""
    calls = {}

    def count(parameter):
        answer = worker.ask("search", parameter, limit)
        if "failure" in answer or not len(answer["triangles"]):
            return None
        calls[parameter] = answer["seconds"]
        try:
            return len(answer["triangles"]) if keeps_both(mesh, tolerance, answer) else None
        except tolvol.TolvolError:
            return None

    started = time.perf_counter()
    start = len(mesh.triangles) / max(4, entry["triangles"]) if tool.by_ratio else tolerance
    best = search(start, count)
    found = {"seconds": time.perf_counter() - started}
    if best:
        found |= {"parameter": best[0], "triangles": best[1], "call": calls[best[0]]}
    return found


def remembered(path, again, work):
    """The result of work(), from the file where it is there."""
    if path.exists() and not again:
        return json.loads(path.read_text())
    entry = work()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(entry, indent=1) + "\n")
    return entry


def compare(mesh, tolerance, options, numbers):
    """An entry for each tool."""
    entries = {}
    for name in options.only:
        number = numbers[TOOLS[name].package]
        if number is None:
            entries[name] = {"failure": "libcgal-dev is not installed"}
        else:
            percent = 100 * tolerance / mesh.size
            if TOOLS[name].package == "tolvol":  # its number stays while it is worked on
                number += "-" + digest(Path(tolvol.__file__).read_bytes())
            label = f"{mesh.name}-{mesh.digest()}-{percent:.6g}-{options.threads}-{options.limit}-{name}-{number}.json"
            entries[name] = remembered(
                BUILD / "results" / label,
                options.again,
                lambda name=name: measure(name, mesh, tolerance, options.threads, options.limit),
            )
        print(" | ".join(row(name, entries[name])), flush=True)
    return entries


# ---- what people read

HEADS = ["Tool", "Triangles", "Seconds", "Result → reference", "Reference → result", "Kept"]
HEADS += ["Fewest kept", "Search, s"]


def seconds(value):
    return f"{value:.2f}" if value < 10 else f"{value:.0f}"


def distance(interval):
    if interval is None:
        return ""
    text = f"{interval[1]:.3f}" if interval[1] < 100 else "over 100"
    return f"**{text}**" if interval[1] <= 1 else text


def row(name, entry):
    if "failure" in entry:
        return [TOOLS[name].title, entry["failure"].replace("|", "/"), *[""] * (len(HEADS) - 2)]
    found = entry.get("search")
    return [
        TOOLS[name].title,
        f"{entry['triangles']:,}",
        seconds(entry["seconds"]),
        distance(entry.get("forward")),
        distance(entry.get("backward")),
        kept(entry),
        "" if found is None else f"{found['triangles']:,}" if "triangles" in found else "none",
        "" if found is None else seconds(found["seconds"]),
    ]


def title(case):
    return f"{case['mesh']}, {case['triangles']:,} triangles, ε = {case['percent']:g} %"


def text(figures):
    rows = []
    for case in figures["cases"]:
        rows.append([f"***{title(case)}***"] + [""] * (len(HEADS) - 1))
        rows += [row(name, entry) for name, entry in case["tools"].items()]
    used = {TOOLS[name].package for case in figures["cases"] for name in case["tools"]}
    numbers = [f"{package} {number}" for package, number in sorted(figures["versions"].items()) if package in used]
    threads = "1 thread" if figures["threads"] == 1 else f"{figures['threads']} threads"
    where = f"{figures['machine']}, {threads}; {', '.join(numbers)}."
    return f"{where}\n\n{tables.table(HEADS, rows, 'lrrrrlrr')}"


BLUE, ORANGE, GREEN, PURPLE, SKY, GREY = "#0072B2", "#D55E00", "#009E73", "#AA4499", "#56B4E9", "#777777"
LOOKS = {  # name: (colour, marker); told apart without colours as well
    "ours": ("#000000", "D"),
    "thorough": ("#000000", "*"),
    "cgal": (ORANGE, "s"),
    "manifold3d": (GREY, "v"),
    "meshlib": (BLUE, "o"),
    "meshlib-weighted": (BLUE, "p"),
    "meshoptimizer": (GREEN, "^"),
    "open3d": (PURPLE, "<"),
    "openmesh": (GREEN, "h"),
    "pyfqmr": (SKY, ">"),
    "pymeshlab": (PURPLE, "d"),
    "pytetwild": (ORANGE, "X"),
    "pytetwild-long": (ORANGE, "P"),
    "vtk-pro": (SKY, "s"),
    "vtk-quadric": (GREY, "8"),
}


def draw(cases, picture):
    """Triangles against seconds, a row for each tolerance and a column for each mesh."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.lines import Line2D

    meshes = list(dict.fromkeys(case["mesh"] for case in cases))
    percents = list(dict.fromkeys(case["percent"] for case in cases))
    height = 3.1 * len(percents)
    figure, axes = pyplot.subplots(
        len(percents), len(meshes), figsize=(12, height + 1.7), sharey=True, sharex="row", squeeze=False
    )
    figure.subplots_adjust(left=0.06, right=0.99, top=1 - 0.3 / (height + 1.7), hspace=0.32, wspace=0.05)
    figure.subplots_adjust(bottom=1.9 / (height + 1.7))
    for case in cases:
        axis = axes[percents.index(case["percent"]), meshes.index(case["mesh"])]
        axis.set_title(title(case), fontsize=10)
        for name, entry in case["tools"].items():
            if name in LOOKS and "failure" not in entry:
                mark(axis, *LOOKS[name], entry)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.grid(True, color="#E4E4E4", linewidth=0.6)
        axis.set_axisbelow(True)
    for axis in axes[-1]:
        axis.set_xlabel("triangles")
    for axis in axes[:, 0]:
        axis.set_ylabel("seconds")

    def sample(colour, marker, filled, label):
        face = colour if filled else "white"
        return Line2D([], [], linestyle="", marker=marker, color=colour, markerfacecolor=face, label=label)

    shown = [name for name in LOOKS if any(name in case["tools"] for case in cases)]
    handles = [sample(*LOOKS[name], True, TOOLS[name].title.replace("**", "")) for name in shown]
    handles += [
        sample("#444444", "o", True, "filled: both directions kept, proved"),
        sample("#444444", "o", False, "hollow: not kept"),
        Line2D([], [], color="#444444", linewidth=0.8, marker=".", label="to the fewest found by search"),
    ]
    figure.legend(handles=handles, loc="lower center", ncol=4, fontsize=9, frameon=False)
    figure.savefig(picture, dpi=110)
    pyplot.close(figure)


def mark(axis, colour, marker, entry):
    """What was left when it was asked, large, and a line to the fewest found; of what left nothing, those alone."""
    x, y = entry["triangles"], entry["seconds"]
    found = entry.get("search", {})
    if "triangles" in found:
        axis.plot(found["triangles"], found["call"], marker, color=colour, markersize=4)
        if x:
            axis.plot([x, found["triangles"]], [y, found["call"]], color=colour, linewidth=0.8, alpha=0.6)
    if x:
        face = colour if kept(entry) == "both" else "white"
        axis.plot(x, y, marker, color=colour, markerfacecolor=face, markersize=12 if marker == "*" else 8, zorder=3)


# ---- the command


def percentage_or_length(word):
    value, percent = length(word)
    if percent and value > 100:
        raise argparse.ArgumentTypeError(f"{word!r} is more than the mesh itself")
    return value, percent


def arguments(words):
    first, _, *rest = __doc__.split("\n\n")
    parser = argparse.ArgumentParser(
        prog="rivals.py",
        description=first,
        epilog=rest[0],
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("mesh", nargs="+", metavar="MESH", help=", ".join(FORMATS))
    parser.add_argument(
        "--tolerance",
        action="append",
        type=percentage_or_length,
        metavar="T",
        help="N%% of size (1%%), or a length; may be repeated; default: 1%% and 0.1%%",
    )
    parser.add_argument("--only", nargs="+", choices=TOOLS, default=list(TOOLS), metavar="NAME", help=", ".join(TOOLS))
    parser.add_argument("--again", action="store_true", help="measure what is remembered as well")
    parser.add_argument("--write", metavar="FILE.md", help="put the table there")
    parser.add_argument("--picture", metavar="FILE.png", help="draw triangles against seconds there")
    parser.add_argument("--json", metavar="FILE", help="write the figures there")
    parser.add_argument(
        "--limit", type=whole_number(1), default=300, metavar="S", help="seconds for a call, default: %(default)s"
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
        if not Path(path).is_file():
            raise Stop(f"{path}: no such file")
        if Path(path).suffix.lower() not in FORMATS:
            raise Stop(f"{path}: not one of {', '.join(FORMATS)}")
    for option in ("write", "picture", "json"):
        if getattr(options, option):
            require_folder(getattr(options, option), f"--{option}")

    set_up(options.only)
    numbers = versions()
    figures = {"machine": machine(), "threads": options.threads, "versions": numbers, "cases": []}
    for path in options.mesh:
        with tempfile.TemporaryDirectory() as folder:
            mesh = read_mesh(path, Path(folder))
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
            }
            print(title(case), flush=True)
            case["tools"] = compare(mesh, tolerance, options, numbers)
            figures["cases"].append(case)
    if options.json:
        Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")
    if options.write:
        tables.write(options.write, "rivals", text(figures))
    if options.picture:
        draw(figures["cases"], options.picture)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(arguments(sys.argv[1:])))
    except Stop as stop:
        print(f"rivals.py: {stop}", file=sys.stderr)
        sys.exit(USAGE)
