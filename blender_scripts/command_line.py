# SPDX-License-Identifier: GPL-3.0-or-later
"""What the commands here have in common: arguments, exit codes, and the add-on loaded without being installed.

Exit codes: 0 done and proved, 1 a bug, 2 bad usage or input (one line on stderr), 3 not proved.
"""

import argparse
import math
import re
import sys
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import addon
from addon import native
from addon.errors import Refused

USAGE, NOT_PROVED = 2, 3

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf|infinity)"


class Stop(Exception):
    """Ends the command with a line on stderr and an exit code."""

    def __init__(self, message, code=USAGE):
        super().__init__(message)
        self.code = code


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


def whole_number(least):
    def parse(text):
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if value < least:
            raise argparse.ArgumentTypeError(f"{value} is less than {least}")
        return value

    return parse


def length(text):
    """'1%' or '0.5' -> (number, whether it is in percent of size)."""
    match = re.fullmatch(rf"\s*({_NUMBER})\s*(%?)\s*", text, re.IGNORECASE)
    if not match:
        raise argparse.ArgumentTypeError(f"{text!r} is neither a length nor a percentage such as 1%")
    value = float(match[1])
    if not math.isfinite(value) or value <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number above 0")
    return value, bool(match[2])


def in_units(value_and_percent, size):
    value, is_percent = value_and_percent
    return value / 100 * size if is_percent else value


def require_folder(path, what):
    """The folder that a file is to be written to must be there before the work begins."""
    folder = Path(path).resolve().parent
    if not folder.is_dir():
        raise Stop(f"{what} {path}: the folder {folder} does not exist")
    if Path(path).is_dir():
        raise Stop(f"{what} {path}: this is a folder")


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
