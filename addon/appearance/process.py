# SPDX-License-Identifier: GPL-3.0-or-later
"""The script that the other Blender runs (other_blender.py): MODULE FOLDER are its arguments.

It calls main(FOLDER) of a module of this folder, and writes the dictionary that main() returns into result.json there. If
main() raises an exception, the dictionary is {"error": the last line of the traceback}.
"""

import importlib
import json
import sys
import traceback
import types
from pathlib import Path

_ADDON = Path(__file__).resolve().parents[1]


def _main_of(module):
    # The add-on's own __init__.py would load all of it. In a package without one the module can import what it needs.
    package = sys.modules["addon"] = types.ModuleType("addon")
    package.__path__ = [str(_ADDON)]
    return importlib.import_module(f"addon.appearance.{module}").main


if __name__ == "__main__":
    name, folder = sys.argv[-2], Path(sys.argv[-1])
    try:
        result = _main_of(name)(folder)
    except Exception:
        traceback.print_exc()
        result = {"error": traceback.format_exc().strip().splitlines()[-1]}
    (folder / "result.json").write_text(json.dumps(result))
