# SPDX-License-Identifier: GPL-3.0-or-later
"""Says how far the work of an operator is, in a line for the status bar and in lines for the panel."""

import time

# The time that a stage still takes is told after so many seconds, and after such a share of the stage.
_KNOWN_AFTER, _KNOWN_SHARE = 1.0, 0.05


class Clock:
    """Estimates how long the present stage of a job goes on."""

    def __init__(self):
        self._stage = None
        self._began = 0.0

    def seconds_left(self, progress):
        """Returns the seconds, or None as long as too little of the stage is done."""
        if progress.stage != self._stage or progress.fraction == 0:
            self._stage, self._began = progress.stage, time.monotonic()
        took, share = time.monotonic() - self._began, progress.fraction
        return took * (1 - share) / share if took >= _KNOWN_AFTER and share >= _KNOWN_SHARE else None


def status_line(operator, progress):
    """Returns the text for the status bar."""
    if progress.cancelled:
        return "Stopping"
    stage, count, share = _stage(progress)
    native_stage = stage + (f" {share:.0%}" if share else "") + (f", {count}" if count else "")
    prefix = f"{operator.part}: " if operator.part else ""
    return f"{prefix}{operator.doing or native_stage}    Esc: {_escape(operator)}"


def panel_lines(operator, progress, clock):
    """Returns the lines of text for the panel, and the share of the stage that is done, or None if it is not known."""
    if progress.cancelled:
        return [operator.bl_label, "Stopping"], None
    lines = [operator.bl_label, *([operator.part] if operator.part else [])]
    stage, count, share = _stage(progress)
    left = clock.seconds_left(progress)
    if operator.doing:
        lines.append(operator.doing)
    else:
        lines += [stage, *([count] if count else [])]
        lines += [f"About {_duration(left)} left of this stage"] if left is not None else []
    lines.append(f"Esc: {_escape(operator)}")
    return lines, None if operator.doing else share


def _duration(seconds):
    return f"{seconds:.0f} s" if seconds < 60 else f"{seconds / 60:.0f} min"


def _stage(progress):
    """Returns the native stage, what it counts, and its share that is done, or None."""
    # In these two stages the count is the number of triangles left.
    counts = progress.count and progress.stage in {"decimating", "refining"}
    return (
        progress.stage.capitalize(),
        f"{progress.count:,} triangles left" if counts else "",
        progress.fraction or None,
    )


def _escape(operator):
    return "Keep Present Result" if operator.improving() else "Cancel"
