# SPDX-License-Identifier: GPL-3.0-or-later
# PYTHON_ARGCOMPLETE_OK
"""The command `tolvol`, which needs no Blender."""

import sys


def main():
    """Runs the command with the words of the command line, and ends the process with its exit code."""
    from .command import run

    sys.exit(run(sys.argv[1:]))


if __name__ == "__main__":
    main()
