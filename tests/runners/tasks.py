# SPDX-License-Identifier: GPL-3.0-or-later
"""The tasks of each runner: the command of a task, and how its output tells which tests passed."""

import re
import subprocess
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PYTHON = "/usr/bin/python3"
COMMAND_PYTHON = "build/command/bin/python"  # with the packages of the command tolvol: tests/environment.sh
RUNNERS = ("native", "asan", "tsan", "python", "fuzz", "blender", "ui", "style")
FULL_LENGTH = {"TOLVOL_ALL_TESTS": "1"}  # the environment in which tests are as long as they can be
# The tests of what several threads do, and of the proofs that are made after them. Each has a task of its own, because a
# task in which no test ran fails: a suite that got another name is noticed. Left out are long tests without threads, and
# those whose work "ThreadsDoNotChangeABit" does with more threads.
THREADED = {
    "Team": "Team.*",
    "CollapseRounds": "CollapseRounds.*-*.KeepTheTolerance:*.LeaveAsManyTrianglesAsOneLoop",
    "DeferredProof": "*DeferredProof*-*.HoldsOnlyWithinTheTolerance:*.Everything*",
    "Refinement": "Refinement.*-*.KeepsBothDirectionsOnEveryMeshAndAddsNoTriangle:*.KeepsTheOneDirectionThatIsAskedFor:"
    "*.SharesOfTheToleranceAreKeptAroundTheirVertices:*.EdgesBetweenLockedVerticesStay:*.LockedVerticesStay:"
    "*.CornersOfAFaceKeepToOneSideOfASeam:*.TimeAndTargetEndIt",
    "Guard": "Guard.*",
    "Hierarchy": "Hierarchy.ThreadsMakeTheSameTree:Hierarchy.ManyThreadsGetTheSameAnswers",
    "MortonOrder": "MortonOrder.SortsByCodeAndKeepsTheOrderOfEqualOnes",
    "Weld": "Weld.ThreadsFindTheSame",
    "InputCrossings": "InputCrossings.ThreadsGetTheAnswersOfOne",
    "Facing": "Facing.ThreadsFindTheSameNormalsAndBounds",
    "EdgeCollapse": "EdgeCollapse.QuadricsAreTheSameOnThreads",
}


@dataclass(frozen=True)
class Task:
    """A command that one worker runs. `count` takes its output and returns a Counter, or None without a closing line."""

    runner: str
    name: str
    command: tuple
    count: Callable
    environment: dict = field(default_factory=dict)
    preset: str = ""  # besides release, has to be built before, and
    target: str = "all"  # of it
    program: str = ""  # decides, with the command and the environment, how the task ends

    @property
    def key(self):
        return f"{self.runner}/{self.name}"


def count_gtest(output):
    counts = {"passed": r"\[  PASSED  \] (\d+) tests?\.$", "skipped": r"\[  SKIPPED \] (\d+) tests?,"}
    found = {name: re.search(f"^{line}", output, re.MULTILINE) for name, line in counts.items()}
    failed = re.findall(r"^\[  FAILED  \] (\d+) tests?, listed below:$", output, re.MULTILINE)
    if not found["passed"]:
        return None
    return Counter({name: int(line[1]) for name, line in found.items() if line}, failed=sum(map(int, failed)))


def count_pytest(output):
    """Counts by the last line of pytest. tests/ui/run.py ends by a line of the same form."""
    lines = re.findall(r"^(\d+ [a-z]+(?:, \d+ [a-z]+)*) in [\d.]+ ?s\b", output, re.MULTILINE)
    if not lines:
        return None
    found = Counter()
    for number, name in re.findall(r"(\d+) ([a-z]+)", lines[-1]):
        found["failed" if name.startswith("error") else name] += int(number)
    return found


def count_fuzz(output):
    line = re.search(r"^fuzz: seed \d+, (\d+) cases, .* (\d+) findings of \d+ kinds$", output, re.MULTILINE)
    return line and Counter(passed=int(line[1]) - int(line[2]), failed=int(line[2]))


def count_checks(output):
    """Counts the lines "NAME: ok" and "NAME: FAILED" above a closing line that begins with "style:"."""
    if not re.search(r"^style: ", output, re.MULTILINE):
        return None
    ends = Counter(re.findall(r"^[\w./]+: (ok|FAILED)$", output, re.MULTILINE))
    return Counter(passed=ends["ok"], failed=ends["FAILED"])


def native(runner, preset, name, program="tolvol_tests", only="*", environment=None):
    command = (f"build/{preset}/tests/native/{program}", "--gtest_brief=1", f"--gtest_filter={only}")
    built = "" if preset == "release" else preset
    # The tests of tolvol_tests read no file and use no GPU. Those of tolvol_gl_tests use it, and what tsan sees depends on how
    # the threads meet.
    decides = command[0] if program == "tolvol_tests" and preset != "tsan" else ""
    return Task(runner, name, command, count_gtest, environment or {}, built, program, decides)


def shares(runner, preset, count, everything=False):
    """Tasks that each run every count-th of the native tests of a preset, at full length with `everything`."""
    for index in range(count):
        environment = {"GTEST_TOTAL_SHARDS": str(count), "GTEST_SHARD_INDEX": str(index)}
        if everything:
            environment |= FULL_LENGTH
        yield native(runner, preset, f"{index + 1}_of_{count}", environment=environment)


def threaded():
    for name, only in THREADED.items():
        yield native("tsan", "tsan", name, "tolvol_thread_tests", only)


def python(suffix="", environment=None, preset=""):
    for folder, program in (("python", PYTHON), ("command", COMMAND_PYTHON)):
        command = (program, "-m", "pytest", "-q", "-p", "no:cacheprovider")
        for path in sorted(ROOT.glob(f"tests/{folder}/test_*.py")):
            yield Task("python", path.stem + suffix, (*command, str(path)), count_pytest, environment or {}, preset)


def python_with_addresses_checked():
    """The Python tests with a module that the address sanitizer watches. Python itself, and NumPy, are not built for it."""
    libraries = [
        subprocess.run(["g++", f"-print-file-name={name}"], check=True, capture_output=True, text=True).stdout.strip()
        for name in ("libasan.so", "libstdc++.so")
    ]
    environment = {
        "LD_PRELOAD": " ".join(libraries),
        "ASAN_OPTIONS": "detect_leaks=0",
        "TOLVOL_PYTHON_PATH": str(ROOT / "build/asan-module/python"),
        "TOLVOL_REQUIRE_GL": "",
    }
    return python("_asan", environment, "asan-module")


def fuzz(cases, first=0):
    command = (PYTHON, "tests/fuzz.py", "--seed=5", f"--first={first}", f"--cases={cases}")
    yield Task("fuzz", f"from_{first}", command, count_fuzz)


def blender(count):
    """Tasks that share the files of tests/blender, and a Blender for each, whose start takes as long as many tests."""
    files = sorted(str(path) for path in ROOT.glob("tests/blender/test_*.py"))
    for index in range(count):
        command = ("sh", "tests/blender/run.sh", *files[index::count])
        yield Task("blender", f"{index + 1}_of_{count}", command, count_pytest)


def windows(count, everything):
    """The window tests, in as many shares."""
    for index in range(count):
        command = ("sh", "tests/ui/run.sh", "--share", f"{index + 1}/{count}")
        yield Task("ui", f"{index + 1}_of_{count}", command, count_pytest, FULL_LENGTH if everything else {})


def tidy(everything):
    count = 4
    for index in range(count):
        command = (PYTHON, "tests/runners/clang_tidy.py", str(index), str(count), *(["--all"] if everything else []))
        yield Task("style", f"clang_tidy_{index + 1}_of_{count}", command, count_checks)


def planned(runners, everything):
    """Returns the tasks of these runners; with `everything` those of sh tests/run.sh --all."""
    tasks = {
        "native": [*shares("native", "release", 4, everything), native("native", "release", "gl", "tolvol_gl_tests")],
        "asan": [*shares("asan", "asan", 6)],
        "tsan": [*(shares("tsan", "tsan", 6) if everything else threaded())],
        "python": [*python(), *(python_with_addresses_checked() if everything else ())],
        # About a minute of the processor in every run.
        "fuzz": [*fuzz(300), *fuzz(300, first=300)] if everything else [*fuzz(100), *fuzz(100, first=100)],
        "blender": [*blender(4)],
        "ui": [*windows(2, everything)],
        "style": [Task("style", "checks", ("sh", "tests/style/run.sh"), count_checks), *tidy(everything)],
    }
    return [task for name in runners for task in tasks[name]]
