# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests/fuzz.py is made of: kinds draws meshes, cases draws operations and options, operations runs and judges
them, watchdog does so in a child process, shrink makes a finding small."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build/release/python")), str(ROOT / "tests/python")]
