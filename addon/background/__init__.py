# SPDX-License-Identifier: GPL-3.0-or-later
"""Computations in threads: a Job each (thread.py), and a queue of those that nobody waits for (queue.py).

Operators, guards and the probe start a Job and look after it themselves. The overlay, the measurement of a mesh that
rests and the estimate ask the queue, which runs one computation at a time.
"""

import atexit

from . import queue, thread
from .thread import Job

__all__ = ["Job", "queue", "register", "unregister"]


def register():
    atexit.register(thread.end_all)  # On exit Blender does not unregister an add-on that a script has registered.


def unregister():
    """Ends all computations."""
    queue.stop()
    atexit.unregister(thread.end_all)
    thread.end_all()
