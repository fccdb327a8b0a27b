# SPDX-License-Identifier: GPL-3.0-or-later
"""Mean, root mean square and 95th percentile of the deviation over the area, both ways, kept with the measurement.

They are estimates. The reports give the intervals that certainly contain the true numbers.
"""

import json

from .. import native
from ..reference import measurements

_PERCENTILE = 95
# (name in the panel, key)
ROWS = (("Mean", "mean"), ("RMS", "rms"), (f"{_PERCENTILE} %", "percentile"))


def measure(surface, reference, threads=None, progress=None):
    """Returns {"forward" or "backward": {key: length in the world}} for two Surfaces."""
    own, other = ((each.world(), each.arrays.triangles) for each in (surface, reference))
    found = {}
    for way, pair in (("forward", (*own, *other)), ("backward", (*other, *own))):
        spread = native.module.deviation(*pair, percentiles=(_PERCENTILE,), threads=threads, progress=progress)
        found[way] = {"mean": spread.mean, "rms": spread.rms, "percentile": float(spread.percentiles[0])}
    return found


def as_text(found):
    """Returns the result of measure() as the text that is kept with a measurement."""
    return json.dumps(found)


def of(ob):
    """Returns what was measured of `ob` as it is now, or None. It is quick enough to be called while drawing."""
    measured = measurements.measurement_of(ob)
    if measured is None or not measured.statistics:
        return None
    try:
        found = json.loads(measured.statistics)
        return {way: {key: float(found[way][key]) for _, key in ROWS} for way in ("forward", "backward")}
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return None  # The file is damaged.
