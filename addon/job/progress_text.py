# SPDX-License-Identifier: GPL-3.0-or-later
"""Says how far the work of an operator is, for the status bar and the panel."""

import time
from dataclasses import dataclass

# The time that a stage still takes is told after so many seconds, and after such a share of the stage.
_KNOWN_AFTER, _KNOWN_SHARE = 1.0, 0.05
_MOST = 0.99  # Who reads 100 % believes that the work has ended.


class Clock:
    """Estimates how long the present stage of a job goes on."""

    def __init__(self):
        self._stage = None
        self._began, self._first = 0.0, 0.0  # when the stage began, and at which share

    def seconds_left(self, stage, share):
        """Returns the seconds, or None as long as too little of the stage is done. share: of the stage that is done."""
        if stage != self._stage or share == 0:
            self._stage, self._began, self._first = stage, time.monotonic(), share
        took, done = time.monotonic() - self._began, share - self._first
        return took * (1 - share) / done if took >= _KNOWN_AFTER and done >= _KNOWN_SHARE else None


@dataclass(frozen=True)
class Told:
    """What is known about the work, as texts, which are empty where nothing is known."""

    title: str  # the name of the operator
    part: str  # the part of the work that is under way
    stage: str
    share: float | None  # of the stage that is done
    left: str  # how long the stage goes on
    count: str
    escape: str  # what Esc does


def tell(operator, progress, clock):
    """Returns the Told of an operator."""
    if progress.cancelled:
        return stopping(operator.bl_label, operator.part)
    if operator.doing:
        stage, share, count = operator.doing, operator.share, operator.count
    else:
        stage, share = progress.stage.capitalize() or "Preparing", progress.fraction
        if progress.finishing and progress.stage == "refining":
            stage = "Ending"  # Esc was pressed: who still read Refining would press it again.
        # In these two stages the count is the number of triangles left.
        counts = progress.count and progress.stage in {"decimating", "refining"}
        count = f"{progress.count:,} triangles left" if counts else ""
    # An operator that says what it is doing says so for each of its steps, which are one stage together.
    left = clock.seconds_left(operator.part if operator.doing else progress.stage, share)
    return Told(
        operator.bl_label,
        operator.part,
        stage,
        min(share, _MOST) or None,
        f"{_duration(left)} left" if left is not None else "",
        count,
        "Keep Present Result" if operator.improving() else "Discard Result" if progress.finishing else "Cancel",
    )


def preparing(title):
    """Returns the Told of an operator that has not read its meshes yet."""
    return Told(title, "", "Preparing", None, "", "", "Cancel")


def stopping(title, part=""):
    """Returns the Told of an operator that is about to end."""
    return Told(title, part, "Stopping", None, "", "", "")


def status_line(told):
    """Returns the text for the status bar."""
    if not told.escape:
        return told.stage
    part = f"{told.part}: " if told.part else ""
    share = f" ({told.share:.0%})" if told.share else ""
    count = f", {told.count}" if told.count else ""
    return f"{part}{told.stage}{share}{count}    Esc: {told.escape}"


def _duration(seconds):
    # "0 s" would say that the work has ended.
    return f"{max(round(seconds), 1)} s" if seconds < 59.5 else f"{seconds / 60:.0f} min"
