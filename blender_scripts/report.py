# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the distance of two mesh files: certified largest distances both ways, statistics and histograms.

blender --background --python blender_scripts/report.py -- A B [--tolerance 1%] [--bounds 0.5%,1%] [--report FILE.html]
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
try:
    import blender_files
    import command_line as cli
    from addon.shared.command import report
except ImportError as error:  # After an uncaught exception Blender would end with exit code 0.
    print(f"report.py: Blender's Python lacks a package: {error}; install Debian's python3-numpy", file=sys.stderr)
    sys.exit(2)


def arguments():
    description = f"{report.DESCRIPTION} {blender_files.FORMATS}"
    parser = cli.Parser("blender_scripts/report.py", description=description, epilog=report.EPILOG)
    report.add(parser)
    return parser.parse()


cli.run(__file__, arguments, lambda options: report.measure(options, blender_files))
