# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs pytest inside Blender and ends with its exit code, even if handlers or classes are still registered."""

import os
import sys
import traceback
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(FOLDER.parents[1]), str(FOLDER), str(FOLDER.parent / "python")]

code = 1
try:
    import pytest

    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    # Options alone, such as -k undo, select among all tests of this folder.
    if not any(Path(argument.split("::")[0]).exists() for argument in arguments):
        arguments.append(str(FOLDER))
    code = int(pytest.main(["-q", "-p", "no:cacheprovider", f"--rootdir={FOLDER}", *arguments]))
except BaseException:
    traceback.print_exc()
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)
