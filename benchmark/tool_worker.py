# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one tool on one mesh in a process of its own, so that a crash, a hang or a leak does not affect the others."""

import contextlib
import json
import os
import select
import signal
import subprocess
from pathlib import Path

import numpy as np

import tool_server


class Worker:
    """The process of a tool. It starts at the first request, and again at the first request after its end.

    python: the path of a Python that has the tool's package.
    """

    def __init__(self, python, name, mesh, threads, folder):
        self.folder = Path(folder)
        np.save(self.folder / "vertices.npy", mesh.vertices)
        np.save(self.folder / "triangles.npy", mesh.triangles)
        self.command = [python, tool_server.__file__, "serve", name, "vertices.npy", "triangles.npy", str(threads)]
        self.threads = threads
        self.process = None

    def start(self):
        cores = sorted(os.sched_getaffinity(0))[: self.threads]
        self.process = subprocess.Popen(
            self.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=(self.folder / "log.txt").open("w"),
            text=True,
            cwd=self.folder,
            env={**os.environ, "OMP_NUM_THREADS": str(self.threads)},
            start_new_session=True,  # The processes that the tool starts are then ended with it.
            preexec_fn=lambda: os.sched_setaffinity(0, cores),
        )

    def ask(self, what, parameter, limit):
        """Returns a dictionary with "seconds", "vertices" and "triangles", or with "failure"."""
        if not self.process:
            self.start()
        try:
            self.process.stdin.write(json.dumps({"what": what, "parameter": parameter}) + "\n")
            self.process.stdin.flush()
            ready = select.select([self.process.stdout], [], [], limit)[0]
            answer = json.loads(self.process.stdout.readline()) if ready else None
        except (BrokenPipeError, json.JSONDecodeError):
            code = self.end()
            return {"failure": f"crashed ({signal.Signals(-code).name if code < 0 else f'exit code {code}'})"}
        if answer is None:
            self.end()
            return {"failure": f"did not end in {limit} s"}
        if "failure" not in answer:
            answer["vertices"] = np.load(self.folder / "result_vertices.npy")
            answer["triangles"] = np.load(self.folder / "result_triangles.npy")
        return answer

    def end(self):
        """Ends the process and returns its exit code."""
        if not self.process:
            return 0
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.close()  # A process that waits for a request ends at this.
        try:
            code = self.process.wait(1)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            code = self.process.wait()
        self.process.stdout.close()
        self.process = None
        return code
