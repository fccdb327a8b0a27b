# SPDX-License-Identifier: GPL-3.0-or-later
"""The subcommands of `tolvol`, and their options."""

import os

from .. import __version__
from ..shared.command import decimate_options, report
from ..shared.command.arguments import Parser, Stop
from ..shared.command.decimate import decimate
from ..shared.command.process import end_on_signals, exit_code
from . import batch, check, large, mesh_files, progress_bar

_DESCRIPTION = """\
Decimates and measures mesh files within a tolerance that is proved, without Blender. tolvol COMMAND --help tells the options of
each command."""

_COMPLETION = """\
The shell completes commands, options and files after:
  eval "$(register-python-argcomplete tolvol)"        (bash and zsh)"""

_EXAMPLES = {
    "decimate": """\
  tolvol decimate scan.ply small.ply --tolerance 1%
  tolvol decimate part.stl part.3mf --tolerance 0.05 --effort thorough --report part.json
  tolvol decimate statue.glb statue.glb --lod 0.1%,0.5%,2%""",
    "report": """\
  tolvol report small.ply scan.ply --tolerance 1% --report small.html
  tolvol report a.stl b.stl --bounds 0.5%,1% --report bounds.csv
  tolvol report print.3mf part.stl --require closed,manifold,oriented,uncrossed""",
    "check": """\
  tolvol check small.ply scan.ply --tolerance 1%
  tolvol check part.stl nominal.obj --tolerance 0.05
  tolvol check small.ply scan.ply --tolerance 1% --one-sided && echo within""",
    "batch": """\
  tolvol batch 'scans/*.ply' --out small --tolerance 1%
  tolvol batch 'parts/*.stl' --out parts_3mf --extension .3mf --jobs 4 --tolerance 0.05
  tolvol batch a.obj b.obj --out small --csv table.csv --tolerance 0.5% --close-holes""",
}


def parser():
    """Returns the parser of the whole command."""
    top = Parser(prog="tolvol", description=_DESCRIPTION, epilog=f"{_all_examples()}\n\n{_COMPLETION}")
    top.add_argument("--version", action="version", version=f"tolvol {__version__}")
    commands = top.add_subparsers(metavar="COMMAND", dest="command", required=True)

    def add(name, short, description, epilog, fill, work):
        one = commands.add_parser(
            name, help=short, description=description, epilog=f"{epilog}\n\nExamples:\n{_EXAMPLES[name]}"
        )
        fill(one)
        one.set_defaults(work=work, parser=one)

    add(
        "decimate",
        "reduce the triangles of a file within a tolerance",
        f"{decimate_options.DESCRIPTION}\n{mesh_files.FORMATS}",
        decimate_options.EPILOG,
        lambda one: (decimate_options.add_files(one), large.add(one)),
        _decimate,
    )
    add(
        "report",
        "measure the distance of two files",
        f"{report.DESCRIPTION}\n{mesh_files.FORMATS}",
        report.EPILOG,
        report.add,
        lambda options: report.measure(options, mesh_files),
    )
    add("check", "say whether a file is within the tolerance of another", *check.TEXTS, check.add, check.check)
    add("batch", "decimate many files", *batch.TEXTS, batch.add, batch.run)
    return top


def _decimate(options):
    large.checked(options.parser, decimate_options.checked(options.parser, options))
    return decimate(options, mesh_files) if options.memory is None else large.decimate(options)


def _all_examples():
    return "Examples:\n" + "\n".join(examples.splitlines()[0] for examples in _EXAMPLES.values())


def _end(number):
    """Ends what a signal with this number leaves behind."""
    batch.end(number)
    progress_bar.end()


def run(words):
    """Runs the command with these words and returns its exit code."""
    made = parser()
    if "_ARGCOMPLETE" in os.environ:  # The shell asks for completions.
        import argcomplete

        argcomplete.autocomplete(made)
    end_on_signals("tolvol", before=_end)
    name = next((f"tolvol {word}" for word in words[:1] if word in _EXAMPLES), "tolvol")

    def work():
        try:
            options = made.parse(words)
            options.words = made.joined(words)
            return options.work(options)
        except ModuleNotFoundError as error:
            extra = "scale" if error.name in ("dask", "distributed") else "cli"
            raise Stop(
                f"the package {error.name} is missing: pip install {error.name}, or '.[{extra}]' of the checkout"
            ) from None

    return exit_code(name, work)
