# SPDX-License-Identifier: GPL-3.0-or-later
"""tests/runners: which tasks count as failed, and what the closing line says then."""

import re
import shutil
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "runners"))

import clang_tidy
import passes
import run
import tasks

GTEST_FAILED = (
    "[  PASSED  ] 8 tests.\n[  SKIPPED ] 2 tests, listed below:\n[  SKIPPED ] A.A\n"
    "[  FAILED  ] 1 test, listed below:\n[  FAILED  ] A.B\n\n 1 FAILED TEST"
)
FUZZ = (
    "fuzz: seed 5, 812 cases, 12 refused with reason, 0 without an end that none was promised, {} findings of 2 kinds"
)


@pytest.mark.parametrize(
    "count, output, command, failure, said",
    [
        (tasks.count_gtest, "[  PASSED  ] 3 tests.", "exit 0", "", "3 passed, 0 failed"),
        (tasks.count_gtest, GTEST_FAILED, "exit 1", "has 1 failed", "8 passed, 1 failed, 2 skipped"),
        (tasks.count_gtest, "[  PASSED  ] 0 tests.", "exit 0", "ran no test", "0 passed, 1 failed"),
        (tasks.count_gtest, "[ RUN      ] A.B", "exit 0", "has no closing line, exit code 0", "0 passed, 1 failed"),
        (tasks.count_gtest, "[  PASSED  ] 3 tests.", "kill -SEGV $$", "was ended by SIGSEGV", "3 passed, 1 failed"),
        (tasks.count_gtest, "[  PASSED  ] 3 tests.", "exit 1", "ended with exit code 1", "3 passed, 1 failed"),
        (tasks.count_pytest, "2 passed, 1 skipped in 63.20s (0:01:03)", "exit 0", "", "2 passed, 0 failed, 1 skipped"),
        (tasks.count_pytest, "1 failed, 2 passed, 2 errors in 3.2s", "exit 1", "has 3 failed", "2 passed, 3 failed"),
        (
            tasks.count_pytest,
            "no tests ran in 0.01s",
            "exit 5",
            "has no closing line, exit code 5",
            "0 passed, 1 failed",
        ),
        (tasks.count_pytest, "3 failed, 20 passed in 300.1 s", "exit 1", "has 3 failed", "20 passed, 3 failed"),
        (tasks.count_fuzz, FUZZ.format(3), "exit 1", "has 3 failed", "809 passed, 3 failed"),
        (tasks.count_checks, "a: ok\nb: FAILED\nstyle: failed: b", "exit 1", "has 1 failed", "1 passed, 1 failed"),
        (tasks.count_checks, "style: in order", "exit 0", "ran no test", "0 passed, 1 failed"),
    ],
)
def test_a_task_fails_by_its_end_and_by_its_closing_line(
    tmp_path, monkeypatch, capsys, count, output, command, failure, said
):
    monkeypatch.setattr(run, "OUT", tmp_path)
    monkeypatch.setattr(run, "TIMES", tmp_path / "times.json")
    (tmp_path / "output").write_text(output + "\n")
    script = f"cat '{tmp_path / 'output'}'; {command}"
    failed = run.Run([tasks.Task("native", "one", ("sh", "-c", script), count)]).run()
    printed = capsys.readouterr().out
    assert failed == bool(failure) and (tmp_path / "native.one.log").read_text() == output + "\n"
    seconds = r"in \d+ s"
    line = f"native: {'FAILED' if failed else 'passed'} {seconds} of the processor: {said}"
    assert re.search(f"^{line}{re.escape(f' (one {failure})') if failed else ''}$", printed, re.MULTILINE)
    assert re.search(
        f"^tests: {'failed: native' if failed else 'all passed'}: {said}, {seconds}$", printed, re.MULTILINE
    )
    assert (output in printed) == failed
    assert ("native/one" in (tmp_path / "times.json").read_text()) == (not failed)


def test_a_task_that_its_program_decides_is_not_run_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run, "OUT", tmp_path)
    monkeypatch.setattr(run, "TIMES", tmp_path / "times.json")
    monkeypatch.setattr(passes, "FOLDER", tmp_path / "passes")
    passes.hash_of.cache_clear()
    program, runs, passing = tmp_path / "program", tmp_path / "runs", tmp_path / "passing"
    shutil.copy("/bin/sh", program)
    script = f"echo >>'{runs}'; [ -e '{passing}' ] && echo '[  PASSED  ] 3 tests.'"

    def number_of_runs(argument="1", environment=None, everything=False):
        command = (str(program), "-c", script, argument)
        task = tasks.Task("asan", "one", command, tasks.count_gtest, environment or {}, program=str(program))
        failed = run.Run([task], everything).run()
        printed = capsys.readouterr().out
        assert failed == (not passing.exists()) and ("3 passed" in printed) == (not failed)
        return len(runs.read_text())

    assert [number_of_runs(), number_of_runs()] == [1, 2], "what failed runs again"
    passing.touch()
    assert [number_of_runs(), number_of_runs()] == [3, 3]
    assert "one" in (tmp_path / "times.json").read_text(), "the time of the last run stays"
    assert [number_of_runs(everything=True), number_of_runs()] == [4, 4]
    passing.unlink()
    assert [number_of_runs(everything=True), number_of_runs()] == [5, 6], "a failure ends what has passed before"
    passing.touch()
    assert [number_of_runs(), number_of_runs()] == [7, 7]
    assert [number_of_runs("2"), number_of_runs(environment={"A": "1"}), number_of_runs()] == [8, 9, 9]
    monkeypatch.setenv("ASAN_OPTIONS", "detect_leaks=0")
    assert [number_of_runs(), number_of_runs()] == [10, 10]
    with program.open("ab") as file:
        file.write(b"changed")
    passes.hash_of.cache_clear()
    assert [number_of_runs(), number_of_runs()] == [11, 11]


def test_only_tests_that_their_program_decides_are_left_out():
    left_out = {task.key for task in tasks.planned(["native", "asan", "tsan"], False) if task.program}
    assert left_out == {f"native/{i}_of_4" for i in range(1, 5)} | {f"asan/{i}_of_6" for i in range(1, 7)}


@pytest.mark.parametrize(
    "line, said",
    [
        ("", ""),
        ("int f(int* p) { return p == 0 ? 1 : 2; }", "modernize-use-nullptr"),
        ("using std::pair;", "pair is not used"),
        ("namespace other = std;", "other is not used"),
    ],
)
def test_clang_tidy_finds_in_joined_sources_what_it_finds_in_each(tmp_path, capfd, line, said):
    shutil.copy(clang_tidy.ROOT / ".clang-tidy", tmp_path)
    sources = [tmp_path / "native" / name for name in ("one.cpp", "two.cpp")]
    sources[0].parent.mkdir()
    for source in sources:
        source.write_text("#include <utility>\nusing std::swap;\nvoid two(int& a, int& b) { swap(a, b); }\n")
    sources[0].write_text(f"#include <utility>\n{line}\n")
    joined = tmp_path / "joined.cxx"
    joined.write_text("".join(f'#include "{source}"\n' for source in sources))
    assert clang_tidy.is_passed(clang_tidy.Unit(joined, sources, ["-std=c++20"], [])) == (not said)
    assert said in capfd.readouterr().out


def test_a_unit_is_checked_again_after_a_change_of_any_file_that_it_is_compiled_with(tmp_path):
    header, source = (tmp_path / name for name in ("one.h", "one.cpp"))
    header.write_text("")
    source.write_text("")

    def key(joined="joined.cxx", options=("-O2",)):
        passes.hash_of.cache_clear()
        file = tmp_path / joined
        file.write_text(joined)
        return clang_tidy.key(clang_tidy.Unit(file, [source], list(options), [file, source, header]), ["version"])

    keys = [key(), key("elsewhere.cxx"), key(options=("-O3",))]
    header.write_text("// changed")
    keys.append(key())
    source.write_text("// changed")
    keys.append(key())
    assert keys[0] == keys[1] and len(set(keys)) == 4
