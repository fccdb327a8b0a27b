# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs that end only when a test wants it: what happens meanwhile must not depend on how fast the machine is."""

import contextlib

from addon.background import thread


def _repeated(work, released):
    def again(progress):
        while True:
            outcome = work(progress)
            if released or progress.cancelled:
                return outcome

    return again


@contextlib.contextmanager
def jobs():
    """Each job that begins while the context lasts repeats its work until it is cancelled, or the list given has an item."""
    run, released = thread.Job._run, []
    thread.Job._run = lambda job, work: run(job, _repeated(work, released))
    try:
        yield released
    finally:
        thread.Job._run = run
