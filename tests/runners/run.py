# SPDX-License-Identifier: GPL-3.0-or-later
"""Sets up and runs the tests: one queue of tasks for as many workers as there are cores, and a lane for each share of the
window tests.

The window tests mostly wait, so they run beside the compilation of the sanitizer presets and beside the queue. A task of
`native` or `asan` whose program decides what it finds is left out if it has passed with the same program before, except in a
full run.
"""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import tasks
from passes import Passes, hash_of, key_of

OUT = tasks.ROOT / "build/tests"
TIMES = OUT / "times.json"
FIRST_TIMES = tasks.ROOT / "tests/runners/times.json"  # of a machine with two cores, for the first run of a checkout
STUCK = 3600  # seconds after which a task counts as stuck


class Commands:
    """Runs commands, and ends those that still run when the test run is interrupted."""

    def __init__(self):
        self._running, self._lock, self._ended = set(), threading.Lock(), False

    def run(self, command, log, environment):
        """Runs a command with its output in a file. Returns (exit code, seconds of the processor)."""
        with open(log, "ab") as output, self._lock:
            if self._ended:
                return -signal.SIGTERM, 0.0
            process = subprocess.Popen(
                command,
                cwd=tasks.ROOT,
                env={**os.environ, **environment},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            self._running.add(process.pid)
        guard = threading.Timer(STUCK, self._stop, [process.pid])
        guard.start()
        _, status, used = os.wait4(process.pid, 0)
        guard.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        with self._lock:
            self._running.discard(process.pid)
        return process.returncode, used.ru_utime + used.ru_stime

    def _stop(self, pid):
        with self._lock:
            if pid in self._running:
                os.killpg(pid, signal.SIGKILL)

    def end(self):
        with self._lock:
            self._ended = True
            for pid in self._running:
                os.killpg(pid, signal.SIGTERM)


class Report:
    """Collects what became of the tasks, and prints a closing line for a runner when its last task has ended."""

    def __init__(self, planned):
        self._lock = threading.Lock()
        self._open = Counter(task.runner for task in planned)
        self._counts = {runner: Counter() for runner in self._open}
        self._seconds = Counter()
        self._known = Counter()
        self._failures = {runner: [] for runner in self._open}
        self._started = time.monotonic()
        self.times = {}

    def add(self, task, counts, seconds, failure, log):
        """Adds the end of a task. seconds: None for a task that was left out, since it has passed before."""
        with self._lock:
            self._known[task.runner] += seconds is None
            self._counts[task.runner].update(counts)
            self._seconds[task.runner] += seconds or 0
            if failure:
                self._counts[task.runner]["failed"] += not counts["failed"]
                self._failures[task.runner].append(f"{task.name} {failure}")
                print(f"{task.key}: {failure}, its output:", flush=True)
                print(log.read_text(errors="replace"), flush=True)
            elif seconds is not None:
                self.times[task.key] = round(seconds, 1)
            self._open[task.runner] -= 1
            if not self._open[task.runner]:
                self._close(task.runner)

    def _close(self, runner):
        failures = self._failures[runner]
        outcome = "FAILED" if failures else "passed"
        line = f"{runner}: {outcome} in {self._seconds[runner]:.0f} s of the processor: {said(self._counts[runner])}"
        if self._known[runner]:
            line += f", {self._known[runner]} of its tasks not run again: they have passed with the same program"
        print(f"{line} ({'; '.join(failures)})" if failures else line, flush=True)

    def end(self):
        """Prints the line about all runners, and returns the exit code."""
        total = sum(self._counts.values(), Counter())
        failed = [runner for runner, failures in self._failures.items() if failures]
        outcome = f"failed: {' '.join(failed)}" if failed else "all passed"
        print(f"tests: {outcome}: {said(total)}, in {time.monotonic() - self._started:.0f} s")
        return bool(failed)


def said(counts):
    text = f"{counts['passed']} passed, {counts['failed']} failed"
    return f"{text}, {counts['skipped']} skipped" if counts["skipped"] else text


def failure_of(code, counts):
    """Returns why a task that ended in this way has failed, or an empty text."""
    if code < 0:
        return f"was ended by {signal.Signals(-code).name}"
    if counts is None:
        return f"has no closing line, exit code {code}"
    if counts["failed"]:
        return f"has {counts['failed']} failed"
    if code:
        return f"ended with exit code {code}"
    return "" if counts["passed"] + counts["skipped"] else "ran no test"


def key(task):
    """Returns the key of a pass of a task that its program decides, with the libraries that this loads, what these read of
    the environment, and the instructions that the processor has."""
    listed = subprocess.run(["ldd", task.program], cwd=tasks.ROOT, check=True, capture_output=True, text=True).stdout
    libraries = re.findall(r"=> (/\S+)", listed)
    given = {name: value for name, value in os.environ.items() if re.match(r"TOLVOL_|GTEST_|\w+SAN_OPTIONS", name)}
    flags = re.search(r"^flags.*", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    contents = [hash_of(tasks.ROOT / path) for path in (task.program, *libraries)]
    return key_of(
        task.command, sorted((given | task.environment).items()), os.cpu_count(), flags and flags[0], contents
    )


class Run:
    def __init__(self, planned, everything=False):
        self._planned, self._report, self._commands = planned, Report(planned), Commands()
        self._everything, self._passes = everything, Passes("tests")
        self._broken = set()  # presets that could not be built
        known = {}
        for file in (FIRST_TIMES, TIMES):
            if file.exists():
                known.update(json.loads(file.read_text()))
        # The longest task is first, so that none remains at the end alone. A task that is new may be long.
        self._planned.sort(key=lambda task: known.get(task.key, STUCK), reverse=True)

    def run(self):
        """Runs all tasks and returns the exit code."""
        workers = len(os.sched_getaffinity(0))
        lane = [task for task in self._planned if task.runner == "ui"]
        queue = [task for task in self._planned if task.runner != "ui"]
        with ThreadPoolExecutor(max(1, len(lane))) as window, ThreadPoolExecutor(workers) as pool:
            try:
                ends = [window.submit(self._do, task) for task in lane]
                for preset, target in sorted({(task.preset, task.target) for task in queue if task.preset}):
                    self._build(preset, target)
                ends += [pool.submit(self._do, task) for task in queue]
                for end in ends:
                    end.result()
            except BaseException:
                self._commands.end()
                raise
        old = json.loads(TIMES.read_text()) if TIMES.exists() else {}
        TIMES.write_text(json.dumps({**old, **self._report.times}, indent=1, sort_keys=True) + "\n")
        self._passes.forget_old()
        return self._report.end()

    def _build(self, preset, target):
        log = OUT / f"build_{preset}.log"
        log.unlink(missing_ok=True)
        for command in (["cmake", "--preset", preset], ["cmake", "--build", "--preset", preset, "--target", target]):
            if self._commands.run(command, log, {})[0]:
                self._broken.add(preset)
                return

    def _do(self, task):
        log = OUT / f"{task.runner}.{task.name}.log"
        log.unlink(missing_ok=True)
        if task.preset in self._broken:
            built = OUT / f"build_{task.preset}.log"
            self._report.add(task, Counter(), 0, "could not be built", built)
            return
        known = key(task) if task.program else None
        passed = self._passes.text(known) if known and not self._everything else None
        if passed is not None:
            self._report.add(task, Counter(json.loads(passed)), None, "", log)
            return
        code, seconds = self._commands.run(task.command, log, task.environment)
        counts = task.count(log.read_text(errors="replace"))
        failure = failure_of(code, counts)
        if known and failure:
            self._passes.forget(known)
        elif known:
            self._passes.note(known, json.dumps(counts))
        self._report.add(task, counts or Counter(), seconds, failure, log)


def main():
    parser = argparse.ArgumentParser(prog="sh tests/run.sh", description=__doc__.splitlines()[0])
    parser.add_argument("runners", nargs="*", metavar="RUNNER", help=f"only these: {' '.join(tasks.RUNNERS)}")
    parser.add_argument("--all", action="store_true", help="also what takes too long for every run")
    options = parser.parse_args()
    for name in options.runners:
        if name not in tasks.RUNNERS:
            parser.error(f"unknown runner {name} (there are: {' '.join(tasks.RUNNERS)})")
    # Tests that interrupt a process need this signal, which a shell switches off for what it runs in the background.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    subprocess.run(["sh", "setup.sh", "--tests"], cwd=tasks.ROOT, check=True)
    OUT.mkdir(parents=True, exist_ok=True)
    return Run(tasks.planned(list(dict.fromkeys(options.runners)) or tasks.RUNNERS, options.all), options.all).run()


if __name__ == "__main__":
    sys.exit(main())
