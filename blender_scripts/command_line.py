# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts that all commands here share: arguments, exit codes, and loading the add-on without installing it.

The exit codes are those of addon/shared/command/process.py.
"""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import addon
from addon import native
from addon.shared.command import arguments, process
from addon.shared.command.arguments import (  # noqa: F401
    NOT_PROVED,
    USAGE,
    Stop,
    in_units,
    length,
    require_folder,
    whole_number,
)


class Parser(arguments.Parser):
    """A parser of the words after "--" on Blender's command line."""

    def __init__(self, script, **options):
        super().__init__(prog=f"blender --background --python {script} --", **options)

    def parse(self, may_be_empty=False):
        words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
        if not words and not may_be_empty:
            self.error("no arguments after --")
        return super().parse(words)


def run(script, arguments, main):
    """Calls main(arguments()) of a script with an empty scene and the add-on registered. Ends Blender with the exit code."""
    name = Path(script).name
    process.end_on_signals(name, bpy.app.tempdir)
    sys.exit(process.exit_code(name, lambda: _with_addon(main, arguments())))


def _with_addon(main, options):
    # Factory settings keep an installed copy of the add-on and the objects of a start-up file out of the run.
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if native.module is None:
        raise Stop(native.reason)
    addon.register()
    try:
        return main(options)
    finally:
        addon.unregister()
