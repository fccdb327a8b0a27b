# SPDX-License-Identifier: GPL-3.0-or-later
"""The seconds that each stage of a command takes."""

import time

from ..proof import report


class Stages:
    """seconds: {stage: seconds}. Each stage lasts from the end of the one before to its own, so that all sum to the total."""

    def __init__(self):
        self.seconds = {}
        self._last_ended = time.perf_counter()

    def end(self, stage):
        """Adds the time since the end of the stage before to `stage`, and returns it."""
        now = time.perf_counter()
        took, self._last_ended = now - self._last_ended, now
        self.seconds[stage] = self.seconds.get(stage, 0.0) + took
        return took


def say(text, took):
    """Prints what was done, and the seconds that it took."""
    print(f"{text}, {report.duration(took)}", flush=True)
