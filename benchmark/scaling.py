# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a decimation in cells on 1, 2... workers of Dask, what each cell reads and writes, and models more workers.

build/command/bin/python benchmark/scaling.py [--triangles 4] [--tolerance 0.1%] [--memory 500MB] [--workers 1 2] [--runs 2]
                                             [--folder DIR] [--write docs/cluster.md]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from dask.utils import key_split
from distributed import Client, LocalCluster, WorkerPlugin

import planet
import tables
from machine import machine

ROOT = Path(__file__).resolve().parents[1]
MODULE = Path(os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build" / "release" / "python")))
os.environ["PYTHONPATH"] = str(MODULE)  # of the command
sys.path.insert(0, str(MODULE))  # The workers get this list.
MILLION, MEGA = 1_000_000, 1e6
MODELLED = (1, 2, 4, 8, 16, 32)


class Counter(WorkerPlugin):
    """Notes for each task what its worker has read and written, and the processor time that it took.

    A worker has one thread, and reads and writes nothing else meanwhile. The system counts what passes through read() and
    write(), from the cache of the disk as well.
    """

    def setup(self, worker):
        import psutil

        self.process, self.found, self.begun = psutil.Process(), {}, None

    def _now(self):
        files, used = self.process.io_counters(), self.process.cpu_times()
        return files.read_chars, files.write_chars, used.user + used.system

    def transition(self, key, start, finish, **_):
        if finish == "executing":
            self.begun = self._now()
        elif start == "executing":
            self.found[key] = tuple(after - before for before, after in zip(self.begun, self._now()))


def counted(dask_worker):
    return dask_worker.plugins["counter"].found


@dataclass
class Task:
    group: str  # the round
    begun: float
    ended: float
    read: int
    written: int
    processor: float

    @property
    def seconds(self):
        return self.ended - self.begun


@dataclass
class Run:
    seconds: float  # of the whole command
    processor: float  # of the command without its workers
    stages: dict
    tasks: list
    triangles: int
    result: bytes  # the file

    @property
    def serial(self):
        """The seconds in which no cell was worked on."""
        busy, until = 0.0, 0.0
        for task in sorted(self.tasks, key=lambda task: task.begun):
            busy += max(0.0, task.ended - max(task.begun, until))
            until = max(until, task.ended)
        return self.seconds - busy

    def groups(self):
        """Returns {round: its tasks}, in their order."""
        found = {}
        for task in sorted(self.tasks, key=lambda task: task.begun):
            found.setdefault(task.group, []).append(task)
        return found


def run(source, folder, count, options):
    """Decimates a file on so many workers of one thread, and returns the Run."""
    out, report = folder / "out.ply", folder / "report.json"
    cluster = LocalCluster(n_workers=count, threads_per_worker=1, memory_limit=None, dashboard_address="127.0.0.1:0")
    with cluster, Client(cluster) as client:
        client.register_plugin(Counter(), name="counter")
        client.get_task_stream()
        words = [sys.executable, "-m", "tolvol", "decimate", source, out, "--tolerance", options.tolerance]
        words += ["--memory", options.memory, "--report", report, "--scheduler", cluster.scheduler_address]
        words += ["--threads", "1", "--scratch", folder / "scratch"]
        began = time.perf_counter()
        process = subprocess.Popen(list(map(str, words)), stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        took = time.perf_counter() - began
        if status:
            sys.exit("scaling.py: the command has failed")
        stream = client.get_task_stream()
        counts = {}
        for of_worker in client.run(counted).values():
            counts.update(of_worker)
    tasks = []
    for task in stream:
        (span,) = (span for span in task["startstops"] if span["action"] == "compute")
        tasks.append(Task(key_split(task["key"]), span["start"], span["stop"], *counts[task["key"]]))
    found = json.loads(report.read_text())
    return Run(
        took,
        used.ru_utime + used.ru_stime,
        found["seconds"],
        tasks,
        found["output"]["triangles"],
        out.read_bytes(),
    )


def modelled(one, count):
    """Returns the seconds on so many workers that a run on one worker lets expect.

    What is serial stays. In each round the cells go to the workers in their order, each to the first that is free.
    """
    total = one.serial
    for tasks in one.groups().values():
        free = [0.0] * count
        for task in tasks:
            free.sort()
            free[0] += task.seconds
        total += max(free)
    return total


def figures(number):
    return f"{number:,.1f}"


def measured_table(runs):
    rows = []
    for count, found in runs.items():
        work = sum(task.seconds for task in found.tasks)
        rows.append(
            [
                str(count),
                figures(found.seconds),
                figures(runs[min(runs)].seconds / found.seconds),
                figures(modelled(runs[min(runs)], count)),
                figures(found.serial),
                figures(work),
                figures(sum(task.processor for task in found.tasks)),
                figures(found.processor),
            ]
        )
    heads = [
        "Workers",
        "s",
        "Times as fast",
        "By the model, s",
        "No cell at work, s",
        "All cells, s",
        "Of the processor, s",
        "The command's own, of the processor, s",
    ]
    return tables.table(heads, rows, "rrrrrrrr")


def rounds_table(one):
    rows = []
    for name, tasks in one.groups().items():
        reads, writes = (sorted(getattr(task, way) for task in tasks) for way in ("read", "written"))
        rows.append(
            [
                name,
                str(len(tasks)),
                figures(sum(task.seconds for task in tasks)),
                figures(max(task.seconds for task in tasks)),
                f"{reads[0] / MEGA:.1f} to {reads[-1] / MEGA:.1f}",
                f"{writes[0] / MEGA:.2f} to {writes[-1] / MEGA:.2f}",
                figures(sum(reads) / MEGA),
                figures(sum(writes) / MEGA),
            ]
        )
    heads = [
        "Round",
        "Tasks",
        "All cells, s",
        "The longest, s",
        "A cell reads, MB",
        "writes, MB",
        "All read, MB",
        "write, MB",
    ]
    return tables.table(heads, rows, "lrrrrrrr")


def model_table(one):
    rows = [
        [str(count), figures(modelled(one, count)), figures(one.seconds / modelled(one, count))] for count in MODELLED
    ]
    return tables.table(["Workers", "s (model)", "Times as fast (model)"], rows, "rrr")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=float, default=4, help="millions")
    parser.add_argument("--tolerance", default="0.1%")
    parser.add_argument("--memory", default="500MB")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--runs", type=int, default=2, help="of each number of workers; the fastest counts")
    parser.add_argument("--folder", help="for the files (default: a temporary folder)")
    parser.add_argument("--write", metavar="FILE.md", help="put the tables into this file")
    options = parser.parse_args()
    runs = {}
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        source = Path(folder) / "planet.ply"
        triangles = planet.write(source, planet.rows_of(options.triangles * MILLION))
        for _ in range(options.runs):  # They take turns, so that a drift of the machine is shared.
            for count in options.workers:
                found = run(source, Path(folder), count, options)
                print(f"{count} workers: {found.seconds:.1f} s, {found.stages}", flush=True)
                runs[count] = min(found, runs.get(count, found), key=lambda found: found.seconds)
    one = runs[min(runs)]
    if len({found.result for found in runs.values()}) > 1:
        sys.exit("scaling.py: the results differ")
    stages = ", ".join(f"{name} {seconds:.1f}" for name, seconds in one.stages.items())
    asked = f"{triangles:,} triangles at {options.tolerance}, `--memory {options.memory}`, one thread a worker"
    heading = f"{machine()}, {asked}; {one.triangles:,} triangles are left, the same bytes in each run."
    text = f"{heading}\n\n{measured_table(runs)}"
    tables.publish(options.write, "scaling", text)
    tables.publish(options.write, "rounds", f"Seconds of the stages on one worker: {stages}.\n\n{rounds_table(one)}")
    tables.publish(options.write, "model", model_table(one))


if __name__ == "__main__":
    main()
