# SPDX-License-Identifier: GPL-3.0-or-later
"""The name of the machine, for the tables."""

import os
import platform
import re
from pathlib import Path


def machine():
    model = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    return f"{model[1] if model else platform.processor()}, {os.cpu_count()} cores"
