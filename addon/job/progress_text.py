# SPDX-License-Identifier: GPL-3.0-or-later
"""Says how far the work of an operator is, for the status bar and the panel."""

from dataclasses import dataclass

# The time that has passed is told after so many seconds.
_TOLD_AFTER = 1.0


@dataclass(frozen=True)
class Told:
    """What is known about the work, as texts, which are empty where nothing is known."""

    title: str  # the name of the operator
    part: str  # the part of the work that is under way
    stage: str
    share: float | None  # of the stage that is done
    passed: str  # how long the operator has been at work. How long it goes on is not known: see tell()
    count: str
    escape: str  # what Esc does


def tell(operator, progress, seconds):
    """Returns the Told of an operator. seconds: since it began.

    It gives no time that is left. The first 90 % of the collapses of a decimation take a third of its time or less, so that the
    share of a stage tells how far the work is, but not how long the rest takes; nor does it tell of the stages that follow.
    """
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
    return Told(
        operator.bl_label,
        operator.part,
        stage,
        share or None,
        f"{_duration(seconds)} so far" if seconds >= _TOLD_AFTER else "",
        count,
        "Keep Present Result" if operator.improving() else "Discard Result" if progress.finishing else "Cancel",
    )


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
    return f"{int(seconds)} s" if seconds < 60 else f"{int(seconds / 60)} min"
