# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory that a computation takes, for the tables."""

import re
from pathlib import Path


class PeakMemory:
    """Measures the most memory that the process has held since the object was made, in bytes (Linux only)."""

    def __init__(self):
        Path("/proc/self/clear_refs").write_text("5")
        self.before = self.peak()

    @staticmethod
    def peak():
        status = Path("/proc/self/status").read_text()
        return 1024 * int(re.search(r"VmHWM:\s+(\d+) kB", status)[1])
