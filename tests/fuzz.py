#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Searches failures that no other test covers: random difficult meshes with every operation and every option.

    tests/fuzz.py --minutes 1 --seed 1        runs cases 0, 1, 2, ... of a seed until the time is over
    tests/fuzz.py --cases 600 --seed 1        runs so many cases, however long they take
    tests/fuzz.py --seed 1 --case 17          repeats one of these cases
    tests/fuzz.py --file FILE.npz             repeats a finding that was reduced and stored

Results are judged by tolvol.hausdorff, by CGAL, and by the promises of the docstrings. Each call has a time limit. A finding
is reduced, printed, and stored under build/fuzz. The exit code is 1 if there was a finding. The script needs NumPy and the
module that setup.sh --tests builds."""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from fuzzing import ROOT, draw, judges  # noqa: E402
from fuzzing.case import Case  # noqa: E402
from fuzzing.run import SECONDS  # noqa: E402
from fuzzing.shrink import Shrink  # noqa: E402
from fuzzing.watchdog import Watchdog  # noqa: E402

SHOWN_FACES = 12


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--cases", type=int, help="so many cases, not so many minutes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="the number of the first case")
    parser.add_argument("--case", type=int, help="only the case of this number")
    parser.add_argument("--file", type=Path, help="only the case in this file")
    parser.add_argument("--shrink", type=float, default=60.0, help="seconds to make a finding small, 0: as it is")
    parser.add_argument("--out", type=Path, default=ROOT / "build/fuzz", help="folder for findings")
    return parser.parse_args()


def report(watchdog, case, name, found, options):
    """Reduces a finding and prints it with the command that repeats it."""
    _, what, message = found
    print(f"\nFOUND {name}: {what}: {message}\n  {case.line()}", flush=True)
    if options.shrink:

        def still(smaller):
            # A reduced case that hangs shows the same finding as one that is slow.
            again = watchdog.run(smaller, SECONDS)[1]
            return again.replace("hang: ", "slow: ") == what.replace("hang: ", "slow: ")

        case = Shrink(case, still, options.shrink).case
        print(f"  smaller: {case.line()}")
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / f"{name}.npz"
    case.save(path)
    print(f"  again: /usr/bin/python3 tests/fuzz.py --file {path}")
    if len(case.triangles) <= SHOWN_FACES:
        print(f"  vertices = {case.vertices.tolist()}\n  triangles = {case.triangles.tolist()}")
        for array, values in case.arrays.items():
            print(f"  {array} = {values.tolist()}")
    sys.stdout.flush()


def one(watchdog, case, options):
    print(case.line(), flush=True)
    found = watchdog.run(case)
    print(*(part for part in found if part), sep=": ")
    if found[0] == "found" and options.case is not None:
        report(watchdog, case, f"{options.seed}-{options.case}", found, options)
    return found[0] == "found"


def main():
    options = arguments()
    watchdog = Watchdog()
    if options.file:
        return one(watchdog, Case.load(options.file), options)
    if options.case is not None:
        return one(watchdog, draw.case_of(options.seed, options.case), options)
    if not judges.CGAL.exists():
        sys.exit(f"fuzz: the judge {judges.CGAL} is not built; run sh setup.sh --tests")
    outcomes, operations, findings, number = Counter(), Counter(), Counter(), options.first
    end = time.monotonic() + 60 * options.minutes
    while time.monotonic() < end if options.cases is None else number < options.first + options.cases:
        case = draw.case_of(options.seed, number)
        found = watchdog.run(case)
        outcomes[found[0]] += 1
        operations[case.operation] += 1
        if found[0] == "found":
            findings[found[1]] += 1
            report(watchdog, case, f"{options.seed}-{number}", found, options)
        number += 1
    for what, count in findings.most_common():
        print(f"{count} x {what}")
    print("fuzz:", ", ".join(f"{count} {name}" for name, count in operations.most_common()))
    print(f"fuzz: seed {options.seed}, {number - options.first} cases, ", end="")
    print(
        f"{outcomes['refused']} refused with reason, {outcomes['endless']} without an end that none was promised, ",
        end="",
    )
    print(f"{outcomes['found']} findings of {len(findings)} kinds")
    return bool(findings)


if __name__ == "__main__":
    sys.exit(main())
