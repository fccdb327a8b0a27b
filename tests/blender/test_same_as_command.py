# SPDX-License-Identifier: GPL-3.0-or-later
"""The scripts for Blender and the command tolvol say the same about one file."""

import json
import os
import re
import subprocess
from pathlib import Path

import pytest

from addon import native
from commands import command, save
from scenes import torus_arrays

ROOT = Path(__file__).resolve().parents[2]
PYTHON = ROOT / "build/command/bin/python"  # setup.sh --tests makes it
OWN = {"seconds", "date", "file", "name"}  # entries that differ from run to run, or with the name of a file


@pytest.fixture(autouse=True)
def _packages():
    assert PYTHON.exists(), "run sh setup.sh --tests"


def tolvol(*arguments):
    environment = {**os.environ, "PYTHONPATH": str(Path(native.path).parents[1])}
    done = subprocess.run(
        [PYTHON, "-m", "tolvol", *map(str, arguments)], capture_output=True, text=True, env=environment, timeout=120
    )
    return done.returncode, done.stdout, done.stderr


def without_own(value):
    """Returns a report without the entries that differ from run to run."""
    if isinstance(value, dict):
        return {key: without_own(entry) for key, entry in value.items() if key not in OWN}
    return [without_own(entry) for entry in value] if isinstance(value, list) else value


def torus_triangles(**options):
    """Returns a rough torus of triangles: Blender cuts other polygons in its own way."""
    vertices, quads = torus_arrays(**options)
    return vertices, [corners for a, b, c, d in quads.tolist() for corners in ((a, b, c), (a, c, d))]


@pytest.mark.parametrize(
    "asked", [["1%"], ["0.03", "--one-sided", "--max-normal-angle", "40"], ["2%", "--close-holes"]]
)
def test_decimation_has_the_same_result_line_and_report(tmp_path, asked):
    vertices, triangles = torus_triangles()
    source = save(tmp_path / "in.ply", ("in", vertices, triangles[:-1]))
    found = []
    for name, run in (
        ("script", lambda *words: command("decimate.py", *words)),
        ("command", lambda *w: tolvol("decimate", *w)),
    ):
        report = tmp_path / f"{name}.json"
        code, out, err = run(source, tmp_path / f"{name}.ply", "--tolerance", *asked, "--report", report)
        assert (code, err) == (0, ""), (out, err)
        line = re.sub(r"[\d.]+ s$", "", out.splitlines()[-1])
        found.append((line, without_own(json.loads(report.read_text()))))
    assert found[0] == found[1]


def test_a_measurement_has_the_same_lines_and_reports(tmp_path):
    one = save(tmp_path / "one.ply", ("one", *torus_triangles(around=24, across=12)))
    other = save(tmp_path / "other.ply", ("other", *torus_triangles(around=24, across=12, seed=2)))
    found = []
    for name in ("script", "command"):
        asked = one, other, "--tolerance", "1%", "--bounds", "2%", "--require", "closed"
        reports = [tmp_path / f"{name}.{extension}" for extension in ("json", "csv", "html")]
        asked += tuple(word for report in reports for word in ("--report", report))
        code, out, err = command("report.py", *asked) if name == "script" else tolvol("report", *asked)
        assert (code, err) == (0, ""), (out, err)
        page = re.sub(r"\d{4}-\d\d-\d\d[ T][\d:+]+", "", reports[2].read_text())
        table = [row for row in reports[1].read_text().splitlines() if not row.startswith(",date,")]
        found.append((out, without_own(json.loads(reports[0].read_text())), table, page))
    for one_of_script, one_of_command in zip(*found):
        assert one_of_script == one_of_command


def test_failures_have_the_same_exit_codes_and_messages(tmp_path):
    source, target = save(tmp_path / "in.ply", ("in", *torus_arrays())), tmp_path / "out.ply"
    (tmp_path / "early.ply").write_bytes(source.read_bytes()[:4000])
    for asked in (
        (source, target, "--tolerance", "0"),
        (source, target, "--tolerance", "300%"),
        (source, tmp_path / "out.xyz", "--tolerance", "1%"),
        (tmp_path / "early.ply", target, "--tolerance", "1%"),
        (source, tmp_path / "none" / "out.ply", "--tolerance", "1%"),
        (source, target, "--tolerance", "1%", "--report", source),
    ):
        script, own = command("decimate.py", *asked), tolvol("decimate", *asked)
        messages = [err.partition(": ")[2].partition("; the known ones")[0] for _, _, err in (script, own)]
        assert (script[0], messages[0]) == (own[0], messages[1]) and script[0] == 2, (script, own)
        assert not target.exists()
