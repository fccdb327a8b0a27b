# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs clang-tidy on a share of the native sources: clang_tidy.py INDEX COUNT [--all].

A source is left out if clang-tidy has passed it with the same contents of all files that it is compiled with, those of the
sources that CMake joins with it among them, the same options, the same configuration and the same clang-tidy. With --all no
source is left out.
"""

import argparse
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

from passes import Passes, hash_of, key_of

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/release"
SOURCES = set(ROOT.glob("native/**/*.cpp"))
CLANG_TIDY = str(ROOT / "build/style/bin/clang-tidy")
OPTIONS = ("--quiet", "--extra-arg=-Wno-unknown-warning-option")  # clang does not know some options of GCC.


def said_by(*command):
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def name_of(path):
    """A path that is the same in each checkout."""
    return str(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path)


def compiled():
    """Returns {source: (options, files)} for the native sources of the last build: the options that it was compiled with,
    and the files that the compiler read. CMake joins several sources, which are compiled as one and share these files."""
    options = {}
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        words = shlex.split(entry["command"].replace(str(ROOT), "."))
        first = next(place for place, word in enumerate(words) if word.startswith("-"))
        options.setdefault(Path(entry["file"]), words[first : words.index("-o")])
    found = {}
    for block in sorted(said_by("ninja", "-C", str(BUILD), "-t", "deps").split("\n\n")):
        header, *lines = block.splitlines() or [""]
        paths = [Path(os.path.normpath(BUILD / line.strip())) for line in lines if line.startswith(" ")]
        if header.endswith("(VALID)") and paths and paths[0] in options:
            for source in SOURCES.intersection(paths):
                found.setdefault(source, (options[paths[0]], paths))
    return found


def is_passed(source, options):
    """Whether clang-tidy passes a source. Prints what it says."""
    command = [CLANG_TIDY, *OPTIONS, str(source), "--", *options]
    run = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    # Its counts of warnings in system headers are of no use.
    said = re.sub(r"^\d+ warnings? generated\.\n", "", run.stdout, flags=re.MULTILINE)
    print(said, end="")
    return run.returncode == 0 and not said.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("index", type=int, help="0, 1, ... COUNT - 1")
    parser.add_argument("count", type=int)
    parser.add_argument("--all", action="store_true")
    options = parser.parse_args()
    passes, found = Passes("clang_tidy"), compiled()
    common = [said_by(CLANG_TIDY, "--version"), hash_of(ROOT / ".clang-tidy"), *OPTIONS]
    sources, checked, failed = sorted(SOURCES)[options.index :: options.count], 0, []
    for source in sources:
        if source not in found:
            failed.append(name_of(source))
            print(f"{BUILD} has not compiled it\n{name_of(source)}: FAILED", flush=True)
            continue
        compiled_with, files = found[source]
        contents = sorted((name_of(path), hash_of(path)) for path in files if path.exists())
        key = key_of(common, name_of(source), compiled_with, contents)  # of its pass
        if options.all or passes.text(key) is None:
            checked += 1
            if not is_passed(source, compiled_with):
                failed.append(name_of(source))
                print(f"{name_of(source)}: FAILED", flush=True)
                continue
            passes.note(key)
        print(f"{name_of(source)}: ok", flush=True)
    if options.index == 0:
        passes.forget_old()
    outcome = f"not {', '.join(failed)}" if failed else "all pass"
    print(f"style: clang-tidy on {checked} of {len(sources)} files, the others are as they passed before: {outcome}")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
