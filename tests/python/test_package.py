# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed package in another project: the examples are built with it alone, and their results are judged."""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import tolvol

import meshes

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(tolvol.__file__).resolve().parents[2]
# ccache knows an earlier run's programs and headers again, because it takes all paths relative to the temporary folder.
LAUNCHER = ["ccache"] if shutil.which("ccache") else []


def run(*command, ok=True, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    assert (done.returncode == 0) == ok, done.stdout + done.stderr
    return done.stdout


def caching(folder):
    """Returns the environment in which ccache takes the paths in this folder relative."""
    return {**os.environ, "CCACHE_BASEDIR": str(folder), "CCACHE_NOHASHDIR": "1"}


def build(sources, folder, installed, environment):
    """Builds the programs of a folder from a copy of it, which does not know this source tree. Returns where they are."""
    shutil.copytree(sources, folder / "sources")
    run(
        "cmake",
        "-G",
        "Ninja",
        "-S",
        folder / "sources",
        "-B",
        folder / "build",
        f"-DCMAKE_PREFIX_PATH={installed}",
        "-DCMAKE_CXX_FLAGS=-Wall -Werror",
        f"-DCMAKE_CXX_COMPILER_LAUNCHER={';'.join(LAUNCHER)}",
    )
    run("cmake", "--build", folder / "build", env=environment)
    return folder / "build"


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    prefix = tmp_path_factory.mktemp("package") / "installed"
    run("cmake", "--install", BUILD, "--prefix", prefix)
    return prefix


@pytest.fixture(scope="module")
def programs(tmp_path_factory, installed):
    environment = caching(tmp_path_factory.getbasetemp())
    return build(ROOT / "examples", tmp_path_factory.mktemp("examples"), installed, environment)


def write_off(path, vertices, triangles):
    with open(path, "w") as file:
        file.write(f"OFF\n{len(vertices)} {len(triangles)} 0\n")
        np.savetxt(file, vertices, fmt="%.17g")
        np.savetxt(file, np.insert(triangles, 0, 3, axis=1), fmt="%d")


def read_off(path):
    words = Path(path).read_text().split()
    assert words[0] == "OFF"
    count, faces = int(words[1]), int(words[2])
    vertices = np.array(words[4 : 4 + 3 * count], np.float64).reshape(count, 3)
    return vertices, np.array(words[4 + 3 * count :], np.int32).reshape(faces, 4)[:, 1:]


def expect_kept(result, reference, tolerance):
    upper = tolvol.directed_hausdorff(*result, *reference, bound=tolerance).upper
    assert 0.5 * tolerance < upper <= tolerance, "the tolerance is kept, and used"


@pytest.mark.parametrize("tolerance", [0.03, 0.015])
@pytest.mark.parametrize("name", ["decimate", "decimate_with_openmesh"])
def test_decimate_keeps_the_tolerance(programs, tmp_path, name, tolerance):
    vertices, triangles = meshes.torus(64, 32)
    write_off(tmp_path / "in.off", vertices, triangles)
    run(programs / name, tmp_path / "in.off", tmp_path / "out.off", tolerance)
    result = read_off(tmp_path / "out.off")
    assert len(result[1]) < len(triangles) / 4
    reference = read_off(tmp_path / "in.off")
    expect_kept(result, reference, tolerance)
    if name == "decimate":
        assert tolvol.directed_hausdorff(*reference, *result, bound=tolerance).upper <= tolerance


def test_constrain_keeps_the_tolerance(programs, tmp_path):
    # Almost every vertex ends at the tolerance and is then held back in each of the 30 steps, which takes long.
    vertices, triangles = meshes.torus(20, 10)
    write_off(tmp_path / "in.off", vertices, triangles)
    run(programs / "constrain", tmp_path / "in.off", tmp_path / "out.off", 0.01)
    result = read_off(tmp_path / "out.off")
    assert np.array_equal(result[1], triangles)
    expect_kept(result, read_off(tmp_path / "in.off"), 0.01)


def test_hausdorff_prints_the_interval(programs, tmp_path):
    vertices, triangles = meshes.torus()
    write_off(tmp_path / "a.off", vertices, triangles)
    write_off(tmp_path / "b.off", vertices + [0, 0, 0.01], triangles)
    printed = run(programs / "hausdorff", tmp_path / "a.off", tmp_path / "b.off")
    expected = tolvol.directed_hausdorff(*read_off(tmp_path / "a.off"), *read_off(tmp_path / "b.off"))
    assert [float(word) for word in printed.split()] == [expected.lower, expected.upper]


def test_a_program_decides_by_a_check_of_its_own(tmp_path, tmp_path_factory, installed):
    environment = caching(tmp_path_factory.getbasetemp())
    program = build(ROOT / "tests/python/own_check", tmp_path, installed, environment) / "own_check"
    assert run(program, -1) == "200 100\n", "it refuses everything"
    left, on_the_right = map(int, run(program, 0.5).split())
    assert left < 150 and on_the_right == 100, "it decides about each change"


@pytest.mark.parametrize("name", ["decimate", "decimate_with_openmesh", "constrain", "hausdorff"])
def test_programs_fail_without_their_files(programs, tmp_path, name):
    run(programs / name, tmp_path / "none.off", tmp_path / "out.off", *[0.1] * (name != "hausdorff"), ok=False)
    run(programs / name, ok=False)


def test_headers_stand_alone(installed, tmp_path, tmp_path_factory):
    """Each installed header compiles alone, with only the installed package."""
    include = installed / "include"
    headers = sorted(path.relative_to(include) for path in include.rglob("*.h*"))
    assert Path("tolvol/check/certificate.h") in headers and Path("tolvol/openmesh/ModToleranceT.hh") in headers
    source = tmp_path / "header.cpp"
    for header in headers:
        source.write_text(f"#include <{header}>\n#include <{header}>\n")
        run(
            *LAUNCHER,
            "c++",
            "-std=c++20",
            "-Wall",
            "-Werror",
            "-Wno-psabi",
            "-I",
            include,
            "-c",
            source,
            "-o",
            tmp_path / "header.o",
            cwd=tmp_path,
            env=caching(tmp_path_factory.getbasetemp()),
        )
