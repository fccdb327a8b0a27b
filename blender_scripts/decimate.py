# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates a mesh file within a tolerance. The proof, in both directions, is of the mesh that is in the written file.

blender --background --python blender_scripts/decimate.py -- IN OUT --tolerance 1%
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
try:
    import blender_files
    import command_line as cli
    from addon.shared.command import decimate_options
    from addon.shared.command.decimate import decimate
except ImportError as error:  # After an uncaught exception Blender would end with exit code 0.
    print(f"decimate.py: Blender's Python lacks a package: {error}; install Debian's python3-numpy", file=sys.stderr)
    sys.exit(2)


def arguments():
    description = f"{decimate_options.DESCRIPTION} {blender_files.FORMATS}"
    parser = cli.Parser("blender_scripts/decimate.py", description=description, epilog=decimate_options.EPILOG)
    decimate_options.add_files(parser)
    return decimate_options.checked(parser, parser.parse())


cli.run(__file__, arguments, lambda options: decimate(options, blender_files))
