# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs clang-tidy on a share of the native sources: clang_tidy.py INDEX COUNT [--all].

Sources that CMake joins to be compiled as one are checked as one, in a quarter of the time. A unit, which is such a group or
a single source, is left out if clang-tidy has passed it with the same contents of all files that it is compiled with, the same
options, the same configuration and the same clang-tidy. With --all each source is checked by itself, and none is left out.
"""

import argparse
import json
import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from passes import Passes, hash_of, key_of

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/release"
SOURCES = set(ROOT.glob("native/**/*.cpp"))
CLANG_TIDY = str(ROOT / "build/style/bin/clang-tidy")
OPTIONS = ("--quiet", "--extra-arg=-Wno-unknown-warning-option")  # clang does not know some options of GCC.
# CMake joins sources by a file that includes each of them.
OF_JOINED = ("--checks=-bugprone-suspicious-include",)
# In an included file clang-tidy does not report using-declarations and namespace aliases that are not used. This finds most:
# a name that stands in a comment as well counts as used.
NAMES = re.compile(r"^\s*(?:using (?:\w*::)+|namespace )(\w+)(?:;| = )", re.MULTILINE)


def said_by(*command):
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def name_of(path):
    """A path that is the same in each checkout."""
    return str(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path)


@dataclass(frozen=True)
class Unit:
    """What is compiled as one: the file that the compiler is given, the native sources in it, the options, and the files that
    the compiler read."""

    file: Path
    sources: list
    options: list
    read: list

    def alone(self):
        """Returns a unit for each source."""
        return [Unit(source, [source], self.options, self.read) for source in self.sources]

    def is_joined(self):
        return self.file not in SOURCES


def units():
    """Returns the units of the last build in which a native source was compiled, each source in one of them."""
    options = {}
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        words = shlex.split(entry["command"].replace(str(ROOT), "."))
        first = next(place for place, word in enumerate(words) if word.startswith("-"))
        options.setdefault(Path(entry["file"]), words[first : words.index("-o")])
    found, left = [], set(SOURCES)
    for block in sorted(said_by("ninja", "-C", str(BUILD), "-t", "deps").split("\n\n")):
        header, *lines = block.splitlines() or [""]
        paths = [Path(os.path.normpath(BUILD / line.strip())) for line in lines if line.startswith(" ")]
        if header.endswith("(VALID)") and paths and paths[0] in options:
            sources = sorted(left.intersection(paths))
            left.difference_update(sources)
            if sources:
                found.append(Unit(paths[0], sources, options[paths[0]], paths))
    return found


def key(unit, common):
    """Returns the key of a pass. A file that joins sources is left out: its name and text hold the path of the checkout."""
    read = [path for path in unit.read if path.exists() and not (unit.is_joined() and path == unit.file)]
    contents = sorted((name_of(path), hash_of(path)) for path in read)
    return key_of(common, [name_of(source) for source in unit.sources], unit.options, contents)


def is_passed(unit):
    """Whether clang-tidy passes a unit. Prints what it says."""
    command = [CLANG_TIDY, *OPTIONS, *(OF_JOINED if unit.is_joined() else ()), str(unit.file), "--", *unit.options]
    run = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    # Its counts of warnings in system headers are of no use.
    said = re.sub(r"^\d+ warnings? generated\.\n", "", run.stdout, flags=re.MULTILINE)
    for source in unit.sources if unit.is_joined() else ():
        text = source.read_text()
        for name in NAMES.findall(text):
            if len(re.findall(rf"\b{name}\b", text)) == 1:
                said += f"{source}: {name} is not used\n"
    print(said, end="")
    return run.returncode == 0 and not said.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("index", type=int, help="0, 1, ... COUNT - 1")
    parser.add_argument("count", type=int)
    parser.add_argument("--all", action="store_true")
    options = parser.parse_args()
    passes = Passes("clang_tidy")
    common = [said_by(CLANG_TIDY, "--version"), hash_of(ROOT / ".clang-tidy"), hash_of(Path(__file__))]
    planned, checked, total, failed = units(), 0, 0, []
    not_compiled = SOURCES.difference(*(unit.sources for unit in planned)) if options.index == 0 else ()
    for source in sorted(not_compiled):
        failed.append(name_of(source))
        print(f"{BUILD} has not compiled it\n{name_of(source)}: FAILED", flush=True)
    if options.all:
        planned = [one for unit in planned for one in unit.alone()]
    for unit in planned[options.index :: options.count]:
        known = None if options.all else key(unit, common)
        passed = known is not None and passes.text(known) is not None
        if not passed:
            checked += len(unit.sources)
            passed = is_passed(unit)
            if passed and known:
                passes.note(known)
        for source in map(name_of, unit.sources):
            print(f"{source}: {'ok' if passed else 'FAILED'}", flush=True)
            total += 1
            if not passed:
                failed.append(source)
    if options.index == 0:
        passes.forget_old()
    outcome = f"not {', '.join(failed)}" if failed else "all pass"
    print(f"style: clang-tidy on {checked} of {total} files, the others are as they passed before: {outcome}")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
