# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates a file that is larger than the memory: `tolvol decimate` with --memory."""

import argparse
import contextlib
import json
import re
import shutil
from pathlib import Path

import numpy as np

from ..shared import package
from ..shared.command.arguments import Stop, file_name, in_units, require_within_size
from ..shared.command.stages import Stages, say
from ..shared.errors import NotProved, NotWritten
from ..shared.files import safe_files
from ..shared.proof import report, solidity
from ..tiles import mapped
from ..tiles.plan import Plan
from ..tiles.rounds import Rounds, bounds, needed_space
from ..tiles.scratch import Scratch
from . import mesh_files
from .mesh import Mesh
from .workers import dask, here, local_count

_UNITS = {"": 1, "k": 1e3, "m": 1e6, "g": 1e9, "t": 1e12}
_TOO_MUCH = 1e18  # bytes: more than any machine has, and less than the native code can count
# Options of decimate that need the whole mesh at once, or more than one run of the rounds.
_WHOLE = (
    "reference",
    "one_sided",
    "max_seconds",
    "target_triangles",
    "close_holes",
    "outside",
    "lod",
    "lod_pixels",
    "picture",
)

GROUP = """\
A mesh that is larger than the memory is decimated part by part, from and to files of the extension .ply or .stl, IN binary. The
parts are proved against all of IN, and so is the whole. Vertices at one position become one, and all else that IN holds, such as
normals and colours, is left out."""


def memory(text):
    """Parses a number of bytes such as 4GB."""
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*([kmgt]?)i?b?\s*", text, re.IGNORECASE)
    count = float(match[1]) * _UNITS[match[2].lower()] if match else 0
    if not 0 < count < _TOO_MUCH:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of bytes such as 500MB or 4GB")
    return int(count)


def scheduler(text):
    """Parses local:N or an address."""
    try:
        local_count(text)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither local:N nor an address such as tcp://host:8786"
        ) from None
    return text


def add(parser):
    """Adds the options of a mesh that is larger than the memory to a parser."""
    group = parser.add_argument_group("larger than the memory", GROUP)
    group.add_argument(
        "--memory",
        type=memory,
        metavar="SIZE",
        help="the memory to use, such as 4GB. The cells into which the mesh is divided, and so the result, depend on it",
    )
    group.add_argument(
        "--scratch",
        type=file_name,
        metavar="DIR",
        help="the folder for temporary files, new or empty: at most 144 bytes for each triangle of IN, or 252 for "
        "float64, and a third of that where nearly all vertices are shared (default: OUT.tolvol beside OUT). It is "
        "removed at the end",
    )
    group.add_argument(
        "--scheduler",
        type=scheduler,
        metavar="ADDRESS",
        help="do the work in the cells as tasks of Dask, whose workers have SIZE of memory each and see the scratch folder: "
        "tcp://HOST:PORT, or local:N for N worker processes on this machine. Needs pip install '.[scale]'",
    )
    group.add_argument(
        "--resume", action="store_true", help="go on with the run that was interrupted and left its scratch folder"
    )


def checked(parser, options):
    """Returns the options. Raises Stop if they make no sense together."""
    if options.memory is None:
        for name in ("scratch", "scheduler", "resume"):
            if getattr(options, name):
                parser.error(f"--{name} needs --memory")
        return options
    for name in _WHOLE:
        if getattr(options, name) not in (None, False, parser.get_default(name)):
            parser.error(f"--{name.replace('_', '-')} cannot be used with --memory")
    return options


def decimate(options):
    """Runs the command and returns its exit code. Raises Stop, Refused and the errors of the package."""
    with safe_files.Staged() as staged:
        return _Run(options, staged).run()


class _Run:
    def __init__(self, options, staged):
        self.options, self.staged = options, staged
        self.stages = Stages()
        for path in (options.input, options.output):
            if Path(path).suffix.lower() not in mapped.EXTENSIONS:
                raise Stop(
                    f"{path}: with --memory, IN and OUT are files of the extension {' or '.join(mapped.EXTENSIONS)}"
                )
        self.target = safe_files.Target(options.output)
        self.report = safe_files.Target(options.report, "--report") if options.report else None
        written = [target for target in (self.target, self.report) if target]
        for target in written:
            if target.is_device:
                raise Stop(f"{target.name}: this is a device or a pipe, not a file")
        is_own = safe_files.identity(self.target.place) == safe_files.identity(options.input)
        read = [] if is_own else [("IN", options.input)]
        safe_files.require_apart([(target.name, target.place) for target in written], read)
        for target in written:
            staged.folder(target)
        self.scratch = Path(options.scratch or f"{self.target.place}.tolvol")

    def run(self):
        mesh = mapped.MappedMesh(self.options.input)
        box = bounds(mesh)
        lower, upper = np.array(box.lower, np.float64), np.array(box.upper, np.float64)
        size = float(np.linalg.norm(upper - lower))
        tolerance = in_units(self.options.tolerance, size)
        require_within_size(tolerance, size)
        if mesh.dtype == np.float64 and self.target.place.suffix.lower() == ".stl":
            raise Stop(f"{self.target.name}: IN holds float64 coordinates, which .stl would round: use .ply for OUT")
        say(f"IN {self.options.input}: {mesh.count:,} triangles", self.stages.end("read"))
        plan = Plan(mesh, tolerance, self.options.memory)
        self._require_space(mesh)
        scratch = Scratch(self.scratch, self._asked(mesh, tolerance), self.options.resume)
        done = False
        workers = dask(self.options.scheduler) if self.options.scheduler else contextlib.nullcontext(here)
        try:
            with workers as self._in_cells:
                result = Rounds(mesh, plan, scratch, tolerance, self._native_options(), self._each).run()
            whole = self._report(mesh, result, tolerance, size)
            if not report.proved(whole):
                raise NotProved(f"{report.intervals(whole)}; {self.options.output} was not written")
            self._write(result, whole)
            done = True
        finally:
            scratch.close(discard=done)
        for note in whole["warnings"]:
            print(f"note: {note}")
        print(report.line(whole, whole["seconds"]["total"]))
        return 0

    def _require_space(self, mesh):
        needed, folder = needed_space(mesh), self.scratch if self.scratch.is_dir() else self.scratch.parent
        if not folder.is_dir():
            raise Stop(f"--scratch {self.scratch}: the folder {folder} does not exist")
        free = shutil.disk_usage(folder).free
        if free < needed and not self.options.resume:
            raise Stop(
                f"--scratch {self.scratch}: the disk has {_size(free)} free, and {_size(needed)} may be needed; choose a "
                "folder on another disk"
            )
        print(f"scratch folder {self.scratch}: at most {_size(needed)}", flush=True)

    def _native_options(self):
        return {
            "placement": self.options.placement or "optimal",
            "effort": self.options.effort,
            "crossings": self.options.crossings,
            "max_normal_angle": self.options.max_normal_angle,
            # The workers share the cores of a machine.
            "threads": self.options.threads or (1 if self.options.scheduler else None),
        }

    def _asked(self, mesh, tolerance):
        """Returns what the result depends on, by the names of the options."""
        options = self._native_options()
        del options["threads"]
        status = mesh.path.stat()
        return {
            "version": package.module.__version__,
            "IN": f"{mesh.path.resolve()}, {status.st_size} bytes, written at {status.st_mtime_ns}",
            "--tolerance": tolerance,
            "--memory": self.options.memory,
            **{f"--{name.replace('_', '-')}": value for name, value in options.items()},
        }

    def _each(self, stage, title, work, jobs):
        # A file is read where the command runs.
        yield from (here if stage == "read" else self._in_cells)(title, work, jobs)
        say(title, self.stages.end(stage))

    def _report(self, mesh, result, tolerance, size):
        found = solidity.facts(mesh_files.surface_of(_mesh(result)), self.options.threads)
        print(f"{self.target.place.name}: {solidity.line(found)}")
        return {
            "version": package.module.__version__,
            "input": {"file": self.options.input, "triangles": mesh.count},
            "output": {
                "file": self.options.output,
                "vertices": len(result.vertices),
                "triangles": len(result.triangles),
            },
            "tolerance": {"absolute": tolerance, "percent": 100 * tolerance / size},
            "two_sided": True,
            "placement": self.options.placement or "optimal",
            "effort": self.options.effort,
            "target_triangles": 0,
            "stopped_by": "tolerance",
            "memory": self.options.memory,
            "rounds": [{"cells": cells, "triangles": triangles} for cells, triangles in result.rounds],
            "forward": [result.forward.lower, result.forward.upper],
            "backward": [result.backward.lower, result.backward.upper],
            "outside": {"faces": 0, "first": None},
            # Where some face has no angle, how many have none is not known of the whole.
            "normals": None
            if result.angle is None
            else {"largest": result.angle, "unsure": 0, "exceeded_before": 0, "exceeded_after": 0},
            "solidity": {"after": found},
            "crossings": {"before": None, "after": found["crossing_pairs"]},
            "repairs": [],
            "warnings": list(result.warnings),
        }

    def _write(self, result, whole):
        """Writes OUT beside its place, makes sure that the file holds the result bit for bit, and moves all files."""
        file = self.staged.folder(self.target) / self.target.place.name
        try:
            mesh_files.write(file, [_mesh(result)], None)
        except OSError as error:
            raise self.target.failed(error) from None
        written = mesh_files.read(file).objects[0]
        if not np.array_equal(written.vertices[written.triangles], result.vertices[result.triangles]):
            raise NotWritten(f"{self.target.name}: the written file differs from the result; check the disk")
        self.stages.end("write")
        whole["seconds"] = {**self.stages.seconds, "total": sum(self.stages.seconds.values())}
        if self.report:
            self.staged.write(self.report, (json.dumps(whole, indent=1) + "\n").encode())
        self.staged.add(self.target, file)
        self.staged.publish()


def _size(count):
    """Returns a number of bytes as text."""
    return f"{count / 1e9:,.1f} GB" if count >= 1e9 else f"{count / 1e6:,.1f} MB"


def _mesh(result):
    return Mesh("mesh", result.vertices, result.triangles)
