# SPDX-License-Identifier: GPL-3.0-or-later
"""What the commands here have in common: arguments, exit codes, and the add-on loaded without being installed.

Exit codes: 0 done and proved, 1 a bug, 2 bad usage or input (one line on stderr), 3 not proved.
"""

import argparse
import sys
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import addon
from addon import native
from addon.errors import Refused
from common import NOT_PROVED, USAGE, Stop, in_units, length, require_folder, whole_number  # noqa: F401


class Parser(argparse.ArgumentParser):
    """Errors are one line that names the offender."""

    def __init__(self, script, **options):
        super().__init__(
            prog=f"blender --background --python blender_scripts/{script} --",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
            **options,
        )
        self._script = script

    def error(self, message):
        raise Stop(f"{message}; see --help")

    def parse(self, may_be_empty=False):
        words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
        if not words and not may_be_empty:
            self.error("no arguments after --")
        # "-1%" would count as an option: a value goes with the option before it.
        valued = {name for action in self._actions for name in action.option_strings if action.nargs is None}
        joined = []
        for word in words:
            if joined and joined[-1] in valued and not word.startswith("--"):
                joined[-1] += "=" + word
            else:
                joined.append(word)
        return self.parse_args(joined)


def run(script, arguments, main):
    """Calls main(arguments()) of a script with an empty scene and the add-on registered, and ends Blender with the exit code."""
    code = 1
    try:
        code = _with_addon(main, arguments())
    except SystemExit as done:  # --help
        code = done.code
    except Stop as stop:
        print(f"{Path(script).name}: {stop}", file=sys.stderr)
        code = stop.code
    except Exception:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    sys.exit(code)


def _with_addon(main, options):
    # An installed copy of the add-on, or objects of a start-up file, must not take part.
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if native.module is None:
        raise Stop(native.reason)
    addon.register()
    try:
        return main(options)
    except (Refused, native.module.TolvolError) as error:
        raise Stop(str(error)) from None
    finally:
        addon.unregister()
