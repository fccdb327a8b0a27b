# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed package in another project: the examples are built with it alone, and their results are judged."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import tolvol

import meshes

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(tolvol.__file__).resolve().parents[2]


def run(*command, ok=True):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert (done.returncode == 0) == ok, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def example(tmp_path_factory):
    """Builds decimate_with_openmesh from a copy of examples/, which does not know this source tree."""
    folder = tmp_path_factory.mktemp("package")
    run("cmake", "--install", BUILD, "--prefix", folder / "installed")
    for source in (ROOT / "examples").iterdir():
        os.makedirs(folder / "examples", exist_ok=True)
        (folder / "examples" / source.name).write_text(source.read_text())
    prefix = f"-DCMAKE_PREFIX_PATH={folder / 'installed'}"
    run(
        "cmake",
        "-G",
        "Ninja",
        "-S",
        folder / "examples",
        "-B",
        folder / "build",
        prefix,
        "-DCMAKE_CXX_FLAGS=-Wall -Werror",
    )
    run("cmake", "--build", folder / "build")
    return folder / "build" / "decimate_with_openmesh"


def write_off(path, vertices, triangles):
    with open(path, "w") as file:
        file.write(f"OFF\n{len(vertices)} {len(triangles)} 0\n")
        np.savetxt(file, vertices, fmt="%.9g")
        np.savetxt(file, np.insert(triangles, 0, 3, axis=1), fmt="%d")


def read_off(path):
    words = Path(path).read_text().split()
    assert words[0] == "OFF"
    count, faces = int(words[1]), int(words[2])
    vertices = np.array(words[4 : 4 + 3 * count], np.float32).reshape(count, 3)
    return vertices, np.array(words[4 + 3 * count :], np.int32).reshape(faces, 4)[:, 1:]


@pytest.mark.parametrize("tolerance", [0.03, 0.01])
def test_example_keeps_the_tolerance(example, tmp_path, tolerance):
    vertices, triangles = meshes.torus()
    write_off(tmp_path / "in.off", vertices, triangles)
    run(example, tmp_path / "in.off", tmp_path / "out.off", tolerance)
    result = read_off(tmp_path / "out.off")
    assert len(result[1]) < len(triangles) / 4
    reference = vertices.astype(np.float64), triangles
    stored = result[0].astype(np.float64), result[1]
    assert tolvol.directed_hausdorff(*stored, *reference, bound=tolerance).upper <= tolerance
    assert tolvol.directed_hausdorff(*stored, *reference).upper > 0.5 * tolerance, "the tolerance is used"


def test_example_says_what_is_missing(example, tmp_path):
    run(example, tmp_path / "none.off", tmp_path / "out.off", 0.1, ok=False)
    run(example, ok=False)


def test_headers_stand_alone(example, tmp_path):
    """Each installed header compiles alone, with only the installed package."""
    include = example.parents[1] / "installed" / "include"
    headers = sorted(path.relative_to(include) for path in include.rglob("*.h*"))
    assert Path("tolvol/check/certificate.h") in headers and Path("tolvol/openmesh/ModToleranceT.hh") in headers
    source = tmp_path / "header.cpp"
    for header in headers:
        source.write_text(f"#include <{header}>\n#include <{header}>\n")
        run(
            "c++",
            "-std=c++20",
            "-Wall",
            "-Werror",
            "-Wno-psabi",
            "-fsyntax-only",
            "-I",
            include,
            "-I",
            include / "tolvol",
            source,
        )
