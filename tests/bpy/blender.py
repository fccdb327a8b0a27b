# SPDX-License-Identifier: GPL-3.0-or-later
"""Does the part of Blender's command line that the tests use with PyPI's bpy: blender --background [--factory-startup]
[--python-exit-code N] [--python-expr CODE | --python FILE]... [-- ARGUMENTS]
"""

import os
import sys
import tempfile
import traceback
import types


def run(code, file):
    main = sys.modules["__main__"] = types.ModuleType("__main__")
    main.__file__ = file
    exec(compile(code, file, "exec"), main.__dict__)


def scripts(arguments):
    """Returns (code, file) of each script, and the exit code for a script that fails."""
    arguments = iter(arguments)
    found, failure = [], 0
    for argument in arguments:
        if argument == "--python-expr":
            found.append((next(arguments), "<string>"))
        elif argument == "--python":
            file = next(arguments)
            with open(file, encoding="utf-8") as text:
                found.append((text.read(), file))
        elif argument == "--python-exit-code":
            failure = int(next(arguments))
        elif argument == "--":
            break
        elif argument not in {"--background", "--factory-startup"}:
            raise SystemExit(f"blender: {argument} is not known to tests/bpy/blender.py")
    return found, failure


def main():
    sys.argv[0] = os.environ["TOLVOL_BPY_BLENDER"]
    found, failure = scripts(sys.argv[1:])
    import bpy

    bpy.app.binary_path = sys.argv[0]
    for code, file in found:
        try:
            run(code, file)
        except SystemExit as end:
            if isinstance(end.code, str):
                print(end.code, file=sys.stderr)
            return end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:
            traceback.print_exc()
            if failure:
                return failure
    return 0


with tempfile.TemporaryDirectory(prefix="tolvol-bpy-") as scratch:
    os.environ.setdefault("BLENDER_USER_RESOURCES", scratch)
    code = main()
# At the end of the process classes that are still registered make Blender 4.2 crash and 4.5 hang.
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)
