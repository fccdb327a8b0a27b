# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs cases in a child process, so that a crash, a hang or too much memory is a finding as well."""

import multiprocessing
import os
import resource
import signal
import time
import traceback
from pathlib import Path

from . import operations
from .case import Finding
from .run import Refused, Run

# Time limits for an answer of the child, of the processor and by the clock. A deadlock takes no time of the processor, and
# other programs may slow the clock, so both are needed. A case that is only slow ends, and run.py finds it.
HANG_SECONDS = 40
DEADLOCK_SECONDS = 400
MEMORY = 8 << 30


def processor_seconds(process):
    """Returns the processor time that a process and its threads have used."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def outcome(case, tell=lambda step: None):
    """Runs one case in this process. Returns ("passed" | "refused" | "endless" | "found", what, message)."""
    try:
        operations.OPERATIONS[case.operation](Run(case, tell))
    except Refused as reason:
        return "refused", "", str(reason)
    except Finding as finding:
        return "found", finding.what, str(finding)
    except Exception as error:
        return "found", f"fuzzer: {type(error).__name__}", traceback.format_exc()
    return "passed", "", ""


def _work(pipe, other_end):
    other_end.close()  # This process then ends when its parent does.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    while True:
        try:
            case = pipe.recv()
        except EOFError:
            return
        pipe.send(("outcome", outcome(case, lambda step: pipe.send(("step", step)))))


class Watchdog:
    def __init__(self):
        self._context = multiprocessing.get_context("fork")
        self._child = None

    def run(self, case, seconds=HANG_SECONDS):
        """Returns the result of outcome() in the child.

        If the child crashes or exceeds the time limits, the result is "found", or "endless" for a case without time limit.
        """
        if self._child is None:
            self._pipe, end = self._context.Pipe()
            self._child = self._context.Process(target=_work, args=(end, self._pipe), daemon=True)
            self._child.start()
            end.close()
        self._pipe.send(case)
        step, clock, processor = "start", time.monotonic(), processor_seconds(self._child.pid)
        try:
            while True:
                if self._pipe.poll(1):
                    kind, value = self._pipe.recv()
                    if kind == "outcome":
                        return value
                    step, clock, processor = value, time.monotonic(), processor_seconds(self._child.pid)
                    continue
                used = processor_seconds(self._child.pid) - processor
                if used > seconds or time.monotonic() - clock > DEADLOCK_SECONDS:
                    self.close()
                    found = "found" if case.is_limited() else "endless"
                    return found, f"hang: {step}", f"{step} had not ended after {used:.0f} s of the processor"
        except (EOFError, ConnectionError):
            self._child.join()
            code = self._child.exitcode
            self.close()
            return "found", f"crash: {step}", f"the process ended in {step}, exit code {code}"

    def close(self):
        if self._child is not None:
            self._child.kill()
            self._child.join()
            self._pipe.close()
            self._child = None
