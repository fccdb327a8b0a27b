# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs commands one after another, each in a fork of this process, which has imported the command. Its imports take longer than
most commands.

The argument is the file descriptor of a connection. It brings (words, environment, folder) and takes (exit code, stdout, stderr).
"""

import multiprocessing.connection
import os
import runpy
import sys
import tempfile

import tolvol.command  # noqa: F401


def served(link):
    """Runs commands until the other end is closed. Returns the words of a command in its fork, and None here."""
    while True:
        try:
            words, environment, folder = link.recv()
        except EOFError:  # The tests have ended.
            return None
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            child = os.fork()
            if not child:
                os.dup2(out.fileno(), 1)
                os.dup2(err.fileno(), 2)
                os.environ.update(environment)
                os.chdir(folder)
                return words
            _, status = os.waitpid(child, 0)
            texts = []
            for file in (out, err):
                file.seek(0)
                texts.append(file.read().decode())
        link.send((os.waitstatus_to_exitcode(status), *texts))


with multiprocessing.connection.Connection(int(sys.argv[1])) as connection:
    words = served(connection)
if words is not None:  # From here on as python -m tolvol.
    sys.argv[1:] = words
    runpy.run_module("tolvol", run_name="__main__", alter_sys=True)
