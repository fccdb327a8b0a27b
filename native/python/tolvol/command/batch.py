# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates many files, several at once, each by a process of its own."""

import contextlib
import csv
import glob
import io
import json
import os
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from ..shared.command import decimate_options
from ..shared.command.arguments import Stop, file_name, whole_number
from ..shared.files import safe_files
from ..shared.proof import report
from ..shared.proof.spreadsheet import harmless
from . import mesh_files

TEXTS = (
    "Decimates each file by tolvol decimate and writes it to the folder DIR under its own name. A table at the end, which is\n"
    f"also written as DIR/batch.csv, says what became of each file.\n{mesh_files.FORMATS}",
    "Exit codes: 0 if all are proved; otherwise the highest of the exit codes of the files: 2 bad usage or input; 3 not\n"
    "proved; 1 a file that could not be written, or a bug. A file that fails does not keep the others from being decimated.",
)
# Column of the CSV -> its value in the report of a run.
_COLUMNS = {
    "triangles": lambda run: run["input"]["triangles"],
    "left": lambda run: run["output"]["triangles"],
    "tolerance": lambda run: run["tolerance"]["absolute"],
    "result_within": lambda run: run["forward"][1],
    "reference_within": lambda run: run["backward"][1],
    "seconds": lambda run: run["seconds"]["total"],
}
_running = set()  # the processes, for end()
_lock = threading.Lock()


def add(parser):
    """Adds all options to a parser."""
    parser.add_argument(
        "inputs", nargs="+", type=file_name, metavar="GLOB", help="files, or patterns such as 'scans/*.ply'"
    )
    parser.add_argument(
        "--out", required=True, type=file_name, metavar="DIR", help="the folder for the results; it is made"
    )
    parser.add_argument(
        "--jobs", type=whole_number(1), default=1, metavar="N", help="decimate so many files at once (default: 1)"
    )
    parser.add_argument(
        "--extension", choices=mesh_files.EXTENSIONS, help="the format of the results (default: that of each file)"
    )
    parser.add_argument(
        "--csv", type=file_name, metavar="FILE.csv", help="where the table goes (default: DIR/batch.csv)"
    )
    decimate_options.add_tolerance(parser)
    decimate_options.add(parser)


def run(options):
    """Runs the command and returns its exit code."""
    decimate_options.checked(options.parser, options)
    pairs = _pairs(options)
    own = ("--out=", "--jobs=", "--csv=", "--extension=")
    given = [word for word in options.words if word.startswith("--") and not word.startswith(own)]
    if options.threads is None:
        given.append(f"--threads={max(1, (os.cpu_count() or 1) // options.jobs)}")
    with safe_files.Staged() as staged, tempfile.TemporaryDirectory(prefix="tolvol-") as scratch:
        table = safe_files.Target(options.csv or Path(options.out) / "batch.csv", "--csv")
        safe_files.require_apart([(table.name, table.place)], [(str(path), path) for pair in pairs for path in pair])
        if not table.is_device:
            staged.folder(table)
        with ThreadPoolExecutor(options.jobs) as pool:
            jobs = [
                pool.submit(_decimate, source, target, given, Path(scratch) / f"{i}.json", f"{i + 1} of {len(pairs)}")
                for i, (source, target) in enumerate(pairs)
            ]
            rows = [job.result() for job in jobs]
        staged.write(table, _csv(rows).encode("utf-8", "backslashreplace"))
        staged.publish()
    _print(rows)
    return max(row["exit_code"] for row in rows)


def _pairs(options):
    """Returns (file, its result) for all files. Raises Stop where two results would be one file, or DIR cannot be made."""
    found = {}
    for pattern in options.inputs:
        paths = [pattern] if os.path.exists(pattern) else sorted(glob.glob(pattern, recursive=True))
        if not paths:
            raise Stop(f"GLOB {pattern}: no file has such a name")
        for path in paths:
            mesh_files.extension_of(path)
            found.setdefault(safe_files.identity(path), path)
    try:
        Path(options.out).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Stop(f"--out {options.out}: {error.strerror}") from None
    targets = {}
    for path in found.values():
        target = Path(options.out) / (Path(path).stem + (options.extension or Path(path).suffix))
        if target in targets:
            raise Stop(f"{path} and {targets[target]} would both be written to {target}: choose another name or --out")
        targets[target] = path
    return [(path, target) for target, path in targets.items()]


def _decimate(source, target, given, made, number):
    """Decimates one file in a process of its own. Returns the row of the table."""
    # The names stand last, because one that begins with - would be taken for an option.
    files = f"--report={made}", "--", str(source), str(target)
    command = [sys.executable, "-m", __package__.partition(".")[0], "decimate", *given, *files]
    with _lock:
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
            text=True,
        )
        _running.add(process)
    out, err = process.communicate()
    with _lock:
        _running.discard(process)
    row = dict.fromkeys(("file", "result", "exit_code", *_COLUMNS, "message"), "")
    row |= {"file": str(source), "result": str(target), "exit_code": process.returncode}
    if process.returncode:
        row["message"] = err.strip().removeprefix("tolvol decimate: ") or "ended without a message"
    else:
        run = json.loads(made.read_text())
        row |= {name: value(run) for name, value in _COLUMNS.items()}
        row["message"] = out.splitlines()[-1]
    with contextlib.suppress(BrokenPipeError):
        print(f"{number}: {source}: {row['message']}", flush=True)
    return row


def end(number):
    """Ends the processes of all files: a signal has ended the command."""
    with _lock:  # No further process begins.
        for process in _running:
            with contextlib.suppress(OSError):
                process.send_signal(number)
        for process in _running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(0.3)


def _csv(rows):
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: harmless(cell) for name, cell in row.items()} for row in rows)
    return text.getvalue()


def _print(rows):
    """Prints the table."""
    head = ("file", "verdict", "triangles", "left", "result within", "reference within", "time")
    lines = [head]
    for row in rows:
        if row["exit_code"]:
            lines.append((row["file"], {3: "NOT PROVED"}.get(row["exit_code"], "FAILED"), *["-"] * 5))
            continue
        counts = (f"{row[name]:,}" for name in ("triangles", "left"))
        within = (f"{row[name]:.3g}" for name in ("result_within", "reference_within"))
        lines.append((row["file"], "proved", *counts, *within, report.duration(row["seconds"])))
    widths = [max(len(line[i]) for line in lines) for i in range(len(head))]
    for line in lines:
        print(
            "  ".join(
                cell.ljust(width) if i < 2 else cell.rjust(width) for i, (cell, width) in enumerate(zip(line, widths))
            )
        )
    proved = sum(not row["exit_code"] for row in rows)
    print(f"{proved} of {len(rows)} proved")
