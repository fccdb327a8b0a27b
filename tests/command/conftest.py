# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the package under test, and the meshes of tests/python."""

import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build/release/python")), str(ROOT / "tests/python")]

from fixtures import gl  # noqa: E402, F401


def pytest_sessionstart(session):
    try:
        import tolvol  # noqa: F401
        import trimesh  # noqa: F401
    except ImportError as error:
        pytest.exit(f"{error}: run sh setup.sh --tests", returncode=3)


def pytest_sessionfinish(session):
    if commands := sys.modules.get("commands"):
        commands.end_served()
