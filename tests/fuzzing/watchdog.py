# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs cases in a child process, so that a crash, a hang or a hunger for memory of the module is a finding as well."""

import multiprocessing
import resource
import signal
import time
import traceback

from . import operations
from .case import Finding
from .run import Refused, Run

HANG_SECONDS = 90  # without a word from the child; what is merely slow is found by run.py, and may then end
MEMORY = 8 << 30


def outcome(case, tell=lambda step: None):
    """("passed" | "refused" | "endless" | "found", what, message) of one case, in this process."""
    try:
        operations.OPERATIONS[case.operation](Run(case, tell))
    except Refused as reason:
        return "refused", "", str(reason)
    except Finding as finding:
        return "found", finding.what, str(finding)
    except Exception as error:
        return "found", f"fuzzer: {type(error).__name__}", traceback.format_exc()
    return "passed", "", ""


def _work(pipe):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    while True:
        case = pipe.recv()
        pipe.send(("outcome", outcome(case, lambda step: pipe.send(("step", step)))))


class Watchdog:
    def __init__(self):
        self._context = multiprocessing.get_context("fork")
        self._child = None

    def run(self, case, seconds=HANG_SECONDS):
        """What outcome() says, or that the child crashed or said nothing for so many seconds: found, or endless where
        no end within a time is promised."""
        if self._child is None:
            self._pipe, end = self._context.Pipe()
            self._child = self._context.Process(target=_work, args=(end,), daemon=True)
            self._child.start()
            end.close()
        step, started = "start", time.monotonic()
        self._pipe.send(case)
        try:
            while True:
                if not self._pipe.poll(max(0.1, seconds - (time.monotonic() - started))):
                    self.close()
                    found = "found" if case.is_limited() else "endless"
                    return found, f"hang: {step}", f"{step} did not end within {seconds} s"
                kind, value = self._pipe.recv()
                if kind == "outcome":
                    return value
                step, started = value, time.monotonic()
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
