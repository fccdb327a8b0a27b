# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs commands one after another in one Blender, whose start takes longer than most of them.

The last argument is the file descriptor of a connection. It brings (script, arguments, Python code
to run first) and takes (exit code, stdout, stderr). The code has a function patch(owner, name, value), which sets an attribute
for this command alone.
"""

import contextlib
import ctypes
import multiprocessing.connection
import os
import runpy
import sys
import tempfile
import traceback


def flush():
    """Flushes the output of Python and of Blender's own code, which the C library buffers."""
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL(None).fflush(None)


def run(script, arguments, patches):
    """Runs a script, after the code `patches`, and returns (exit code, stdout, stderr).

    A script has to end by sys.exit: otherwise the code is None.
    """
    sys.argv = ["blender", "--", *arguments]
    with contextlib.ExitStack() as after, tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:

        def patch(owner, name, value):
            after.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, value)

        flush()
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        code = None
        try:
            exec(patches, {"patch": patch})
            runpy.run_path(script, run_name="__main__")
        except SystemExit as end:
            code = end.code
        except BaseException:
            traceback.print_exc()
        flush()
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read().decode())
    return code, *texts


link = multiprocessing.connection.Connection(int(sys.argv[-1]))
try:
    while True:
        link.send(run(*link.recv()))
except EOFError:  # The tests have ended.
    os._exit(0)
