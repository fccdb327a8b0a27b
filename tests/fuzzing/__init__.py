# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of tests/fuzz.py: kinds draws meshes, draw draws operations and options, operations runs and judges them,
watchdog does so in a child process, and shrink reduces a finding."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build/release/python")), str(ROOT / "tests/python")]
