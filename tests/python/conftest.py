# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the module under test: TOLVOL_PYTHON_PATH when set, else what the release preset built."""

import os
import sys
from pathlib import Path

import pytest

from fixtures import gl  # noqa: F401

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build/release/python")))


def pytest_sessionstart(session):
    try:
        import tolvol  # noqa: F401
    except ImportError as error:
        pytest.exit(f"the module tolvol does not load ({error}): run sh setup.sh", returncode=3)
