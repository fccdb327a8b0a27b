# SPDX-License-Identifier: GPL-3.0-or-later
"""A process that answers one request after another, for tests of commands whose start takes longer than most of them."""

import multiprocessing
import os
import signal
import subprocess

PATIENCE = 120  # seconds after which a request counts as stuck


class Served:
    """Starts the process at the first request, and anew after a request that had no answer.

    words: its command line, to which the file descriptor of a connection is added. It receives each request there, answers
    it, and ends once the connection is closed. options: for subprocess.Popen.
    """

    def __init__(self, words, **options):
        self._words, self._options = words, options
        self._running = None  # (connection, process)

    def _start(self):
        link, there = multiprocessing.Pipe()
        with there:
            process = subprocess.Popen(
                [*self._words, str(there.fileno())],
                stdin=subprocess.DEVNULL,
                pass_fds=[there.fileno()],
                start_new_session=True,
                **self._options,
            )
        return link, process

    def ask(self, *request):
        """Returns the answer to a request."""
        (link, process), self._running = self._running or self._start(), None
        link.send(request)
        if not link.poll(PATIENCE):
            os.killpg(process.pid, signal.SIGKILL)  # What it has started for the request is of its group.
            raise subprocess.TimeoutExpired(str(request), PATIENCE)
        answer = link.recv()
        self._running = link, process
        return answer

    def end(self):
        """Ends the process, if there is one."""
        if self._running:
            link, process = self._running
            link.close()
            process.wait(PATIENCE)
