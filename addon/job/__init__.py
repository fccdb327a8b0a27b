# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the long computations of operators in threads, with progress and Esc, while Blender can be used.

An operator has three parts: prepare() reads Blender's data, in parts, and returns the work; the work runs in the thread and
touches no data of Blender; finish() writes the outcome in one go. An operator whose work needs Blender between its parts
overrides steps(), a generator. For a script and in Blender without a window the same parts run one after the other, and
the call returns when they are done.

While a job runs, the operator takes Esc and passes all other events on. If the user changes what the job works on, the
job ends, and it writes nothing.
"""

from .. import status_bar
from . import adjusting, interruptions
from .interruptions import under_way
from .operator import JobOperator
from .run import WRITE, breathe

__all__ = ["WRITE", "JobOperator", "breathe", "register", "under_way", "unregister"]


def register():
    """Call this once all classes of operators exist: those that Adjust Last Operation offers get their helpers here."""
    interruptions.register()
    adjusting.register(JobOperator)


def unregister():
    adjusting.unregister()
    interruptions.unregister()
    status_bar.clear()
