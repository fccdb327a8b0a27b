# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts that all commands here share: arguments, exit codes, and loading the add-on without installing it.

The exit codes are 0 for done and proved, 1 for a file that could not be written or a bug, 2 for bad usage or input, and 3
for not proved. Every failure except a bug prints one line to stderr. A signal ends the command with the exit code 128 plus
the signal's number, and its temporary files are removed.
"""

import argparse
import os
import shutil
import signal
import socket
import sys
import threading
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import addon
from addon import native
from addon.errors import NotWritten, Refused
from addon.files import safe_files, side_files
from common import (  # noqa: F401
    NOT_PROVED,
    NOT_WRITTEN,
    USAGE,
    Stop,
    above_zero,
    angle,
    file_name,
    in_units,
    length,
    require_folder,
    several,
    whole_number,
)


class Parser(argparse.ArgumentParser):
    """An ArgumentParser whose errors are one line that names the faulty argument."""

    def __init__(self, script, **options):
        super().__init__(
            prog=f"blender --background --python {script} --",
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
        # argparse would take a value such as "-1%" for an option. It is joined to the option before it by "=".
        valued = {name for action in self._actions for name in action.option_strings if action.nargs is None}
        joined = []
        for word in words:
            if joined and joined[-1] in valued and not word.startswith("--"):
                joined[-1] += "=" + word
            else:
                joined.append(word)
        return self.parse_args(joined)


def reads(option, path):
    """Returns pairs (name for messages, path) for a mesh file that is read and for all files that it needs."""
    return [(f"{option} {path}", path)] + [(f"{file} of {option}", file) for file in side_files.read_with(path)]


def _end_on_signals(script):
    """Makes SIGTERM, Ctrl-C and a closed terminal remove the temporary files and end the process, even in native calls."""
    # Python runs signal handlers only between two of its instructions, and a native call may take minutes. A thread reads
    # the signals instead.
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    for name in ("SIGTERM", "SIGINT", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows does not have all of these signals.
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:  # nohup makes the process ignore SIGHUP.
            signal.signal(number, lambda *_: None)
    scratch = bpy.app.tempdir

    def end():
        with writer:  # The reference keeps the socket open.
            number = reader.recv(1)[0]
        safe_files.remove_all()
        shutil.rmtree(scratch, ignore_errors=True)
        print(f"{script}: ended by {signal.Signals(number).name}", file=sys.stderr, flush=True)
        os._exit(128 + number)

    threading.Thread(target=end, daemon=True).start()


def run(script, arguments, main):
    """Calls main(arguments()) of a script with an empty scene and the add-on registered. Ends Blender with the exit code."""
    code = 1
    _end_on_signals(Path(script).name)
    try:
        code = _with_addon(main, arguments())
    except SystemExit as done:  # --help raises this.
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
    # Factory settings keep an installed copy of the add-on and the objects of a start-up file out of the run.
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if native.module is None:
        raise Stop(native.reason)
    addon.register()
    try:
        return main(options)
    except NotWritten as error:
        raise Stop(str(error), NOT_WRITTEN) from None
    except (Refused, native.module.TolvolError) as error:
        raise Stop(str(error)) from None
    finally:
        addon.unregister()
