# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs clang-tidy on a share of the native sources: clang_tidy.py INDEX COUNT [--all].

A source is left out if clang-tidy has passed it with the same contents, the same contents of all files that it includes, the
same compile command, the same configuration and the same clang-tidy. With --all no source is left out.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

from passes import Passes, hash_of, key_of

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build/release"
CLANG_TIDY = str(ROOT / "build/style/bin/clang-tidy")
OPTIONS = ("--quiet", "--extra-arg=-Wno-unknown-warning-option")  # clang does not know some options of GCC.


def said_by(*command):
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def name_of(path):
    """A path that is the same in each checkout."""
    return str(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path)


def included():
    """Returns the files that the compiler read for each source, itself among them, as the last build has noted them."""
    files = {}
    for block in said_by("ninja", "-C", str(BUILD), "-t", "deps").split("\n\n"):
        header, *lines = block.splitlines() or [""]
        paths = [Path(os.path.normpath(BUILD / line.strip())) for line in lines if line.startswith(" ")]
        if header.endswith("(VALID)") and paths:
            files.setdefault(paths[0], set()).update(paths)
    return files


def keys():
    """Returns the key of a pass for each source that the last build has compiled."""
    common = [said_by(CLANG_TIDY, "--version"), hash_of(ROOT / ".clang-tidy"), *OPTIONS]
    commands = {}
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        commands.setdefault(Path(entry["file"]), []).append(entry["command"].replace(str(ROOT), "."))
    found = {}
    for source, files in included().items():
        contents = sorted((name_of(path), hash_of(path)) for path in files if path.exists())
        found[source] = key_of(common, name_of(source), sorted(commands.get(source, [])), contents)
    return found


def is_passed(source):
    """Whether clang-tidy passes a source. Prints what it says."""
    command = [CLANG_TIDY, *OPTIONS, "-p", str(BUILD), str(source)]
    run = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    # Its counts of warnings in system headers are of no use, nor is how far it is with a source that is compiled twice.
    said = re.sub(r"^(\d+ warnings? generated\.|\[.* Processing file .*)\n", "", run.stdout, flags=re.MULTILINE)
    print(said, end="")
    return run.returncode == 0 and not said.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("index", type=int, help="0, 1, ... COUNT - 1")
    parser.add_argument("count", type=int)
    parser.add_argument("--all", action="store_true")
    options = parser.parse_args()
    passes = Passes("clang_tidy")
    known, checked, failed = keys(), 0, []
    sources = sorted(ROOT.glob("native/**/*.cpp"))[options.index :: options.count]
    for source in sources:
        key = known.get(source)
        if options.all or not key or passes.text(key) is None:
            checked += 1
            if not is_passed(source):
                failed.append(name_of(source))
                print(f"{name_of(source)}: FAILED", flush=True)
                continue
            if key:
                passes.note(key)
        print(f"{name_of(source)}: ok", flush=True)
    if options.index == 0:
        passes.forget_old()
    outcome = f"not {', '.join(failed)}" if failed else "all pass"
    print(f"style: clang-tidy on {checked} of {len(sources)} files, the others are as they passed before: {outcome}")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
