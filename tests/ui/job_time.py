# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes what happens while a job runs independent of how fast the machine is."""

import contextlib

from addon import native
from addon.background import thread
from addon.job import run


def _repeated(work, released):
    def again(progress):
        while True:
            outcome = work(progress)
            if released or progress.cancelled:
                return outcome
            native.module.pause(0.0)  # Blender works on.

    return again


@contextlib.contextmanager
def unending():
    """Each job that begins while the context lasts repeats its work until it is cancelled, or until the caller
    adds an item to the list that it gets."""
    original, released = thread.Job._run, []
    thread.Job._run = lambda job, work: original(job, _repeated(work, released))
    try:
        yield released
    finally:
        thread.Job._run = original


@contextlib.contextmanager
def in_background():
    """Each job that begins while the context lasts goes on in the background, even one that ends at once."""
    patience, run.PATIENCE = run.PATIENCE, 0.0
    try:
        yield
    finally:
        run.PATIENCE = patience
