# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel says: the number of triangles, or why there is none."""

import functools
import json
import math
from dataclasses import dataclass

from .. import job
from ..operators import blocked
from ..operators.decimate import targets
from ..proof import last_run
from ..properties import automatic_placement
from . import known, runs

# *Thorough* leaves about this share of the triangles that *Fast* leaves, if Fast removes this share of them or more.
_THOROUGH, _MANY = 0.65, 0.25
_AT_WORK, _TOO_LARGE, _OTHER_MODE = "Estimating", "Too large to estimate", "Decimate needs Object Mode"
# A float32 tolerance in percent differs from that of the run by a smaller share.
_SAME = 1e-6


@dataclass(frozen=True)
class Estimate:
    before: int
    after: int
    known: bool  # whether Decimate has left this number


def shown(context):
    """Returns the Estimate for the objects that Decimate would work on, or a text that says why there is none.

    The text is empty where the panel says the reason itself, as it does in Object Mode. Panels call the function while they
    are drawn: it reads what is known, and asks for what is not.
    """
    objects = targets(context)
    at_work = job.under_way()
    if at_work or any(blocked.decimate_blocked(ob) for ob in objects):
        runs.cancel()
        return "" if at_work or objects[0].mode == "OBJECT" else _OTHER_MODE
    settings = objects[0].tolvol
    done = [_decimated(ob, settings) for ob in objects]
    if all(done):
        runs.cancel()
        return Estimate(sum(before for before, _ in done), sum(after for _, after in done), True)
    if runs.triangles(objects) > runs.MOST_TRIANGLES:
        runs.cancel()
        return _TOO_LARGE
    percents = {ob.name: known.percent(ob, settings) for ob in objects}
    if not all(percents.values()):
        return ""
    runs.ask(objects, percents)
    return _sum(objects, percents, settings)


def _sum(objects, percents, settings):
    before = after = 0
    for ob in objects:
        found = known.current(ob, settings)
        if found is None:
            return _AT_WORK
        curve = found.curve
        if curve is None:
            return ""
        if curve.too_large:
            return _TOO_LARGE
        if curve.refused(percents[ob.name]):
            return "No result at this tolerance"
        count = curve.count(percents[ob.name])
        if not count:
            return _AT_WORK
        before += curve.triangles
        after += _limited(count, curve.triangles, settings)
    return Estimate(before, round(after), False)


def _limited(count, triangles, settings):
    """Returns the number of triangles with the settings that do not change the curve. count: what *Fast* leaves."""
    if settings.effort == "THOROUGH":
        # Where the tolerance permits hardly any change, Thorough hardly helps.
        count *= 1 - (1 - _THOROUGH) * min(max((1 - count / triangles) / _MANY, 0), 1)
    return max(count, min(settings.target_triangles, triangles)) if settings.use_target else count


def _decimated(ob, settings):
    """Returns the numbers of triangles before and after the last operation on `ob`, or None unless it was Decimate with the
    tolerance, the directions, the effort and the target of the settings."""
    run = _counted(last_run.shown(ob))
    percent = known.percent(ob, settings)
    if (
        run is None
        or not percent
        or not math.isclose(run[0], percent, rel_tol=_SAME)
        or run[1] != _choices(ob, settings)
    ):
        return None
    return run[2:]


def _choices(ob, settings):
    target = settings.target_triangles if settings.use_target else None
    placement = settings.placement if settings.placement_choice >= 0 else automatic_placement(ob.data)
    return settings.keep == "BOTH", settings.effort.lower(), placement.lower(), target


@functools.lru_cache(maxsize=16)
def _counted(run):
    """Returns (tolerance in percent, choices, triangles before, after) of a run as JSON, or None if it is no decimation."""
    try:
        told = json.loads(run)
        choices = tuple(told[name] for name in ("two_sided", "effort", "placement", "target_triangles"))
        counts = int(told["input"]["triangles"]), int(told["output"]["triangles"])
        return float(told["tolerance"]["percent"]), choices, *counts
    except last_run.DAMAGED:
        return None
