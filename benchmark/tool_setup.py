# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs the tools that other_tools.py compares, and says which versions they have."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from tolvol.shared.command.arguments import Stop

import solid
from tool_calls import CGAL_PROGRAM, ROOT

BUILD = ROOT / "build" / "other_tools"
PYTHON = BUILD / "venv" / "bin" / "python"
PINS = Path(__file__).with_name("other_tools.txt")
CGAL_SOURCE = Path(__file__).with_name("other_tools_cgal.cpp")
CGAL_HEADER = Path("/usr/include/CGAL/version.h")


def set_up(names):
    """Makes the virtual environment, again if the pinned versions have changed, and builds CGAL's program."""
    if not solid.JUDGE.exists():
        raise Stop(f"{solid.JUDGE.relative_to(ROOT)} is missing: run sh setup.sh --tests")
    if not PYTHON.exists() or not same_text(PINS, BUILD / "venv" / PINS.name):
        print("other_tools: making a virtual environment, which takes some minutes", flush=True)
        shutil.rmtree(BUILD / "venv", ignore_errors=True)
        quietly(sys.executable, "-m", "venv", BUILD / "venv")
        quietly(PYTHON, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--requirement", PINS)
        shutil.copy(PINS, BUILD / "venv")
    if "cgal" in names and CGAL_HEADER.exists() and newer(CGAL_SOURCE, CGAL_PROGRAM):
        print("other_tools: building CGAL's program, which takes half a minute", flush=True)
        # The options are those of CGAL's own release builds. CGAL's intervals rely on -frounding-math.
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
    """Returns {package: version}, without that of tolvol. CGAL's and Blender's are None if they are not installed."""
    found = dict(re.findall(r"^([a-z0-9_]+)==(\S+)$", PINS.read_text(), re.M))
    header = CGAL_HEADER.read_text() if CGAL_HEADER.exists() else ""
    number = re.search(r"#define CGAL_VERSION (\S+)", header)
    blender = None
    if shutil.which("blender"):
        said = subprocess.run(["blender", "--version"], capture_output=True, text=True).stdout
        blender = re.match(r"Blender (\S+)", said)
    return {**found, "blender": blender and blender[1], "cgal": number and number[1]}
