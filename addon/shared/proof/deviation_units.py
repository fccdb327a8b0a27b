# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts a deviation, as deviation.py describes it, from world units to the unit in which it is reported."""

import math

# The number of digits of the tolerance and of largest distances: operations use up to 99.99 % of the tolerance.
DIGITS = 6


def in_unit(run, factor, unit):
    """Returns a deviation with its lengths times `factor`. Intervals are rounded outwards, and the verdict stays.

    unit: the name of the new unit.
    """
    if factor == 1:
        return run | {"unit": unit}
    convert = _Conversion(factor)
    tolerance = run["tolerance"] and convert.entry(run["tolerance"], lengths=("absolute",))
    converted = {
        "unit": unit,
        "size": run["size"] * factor,
        "tolerance": tolerance,
        "a": convert.mesh(run["a"]),
        "solidity": {key: convert.solidity(facts) for key, facts in run["solidity"].items()},
        **{way: convert.way(run[way]) for way in ("forward", "backward")},
    }
    if "labels" in run:
        converted["labels"] = [convert.entry(label, ("distance",), ("position",)) for label in run["labels"]]
    return run | converted


class _Conversion:
    def __init__(self, factor):
        self._factor = factor

    def entry(self, entry, lengths=(), vectors=(), intervals=()):
        """Returns a dictionary with the entries of these names converted."""
        return (
            entry
            | {name: entry[name] * self._factor for name in lengths}
            | {name: [x * self._factor for x in entry[name]] for name in vectors}
            | {name: self._interval(entry[name]) for name in intervals}
        )

    def _interval(self, ends):
        lower, upper = (end * self._factor for end in ends)
        # A distance of 0 and a bound below the least number stay as they are.
        return [math.nextafter(lower, -math.inf) if lower else lower, math.nextafter(upper, math.inf)]

    def mesh(self, mesh):
        if "holes" not in mesh:
            return mesh
        places = [self.entry(place, ("perimeter",), ("centre",)) for place in mesh["holes"].get("places", ())]
        return mesh | {"holes": mesh["holes"] | {"places": places}}

    def solidity(self, facts):
        if "shells" not in facts:
            return facts  # the changes, which are shares
        volume = facts["volume"] and facts["volume"] * self._factor**3
        return facts | {"area": facts["area"] * self._factor**2, "volume": volume}

    def way(self, way):
        converted = self.entry(
            way,
            ("mean", "mean_error", "rms", "spacing"),
            ("position",),
            ("largest", "mean_range", "rms_range"),
        )
        converted["percentiles"] = [self.entry(entry, ("distance",), (), ("range",)) for entry in way["percentiles"]]
        converted["beyond"] = [self.entry(entry, ("bound",)) for entry in way["beyond"]]
        converted["histogram"] = self.entry(way["histogram"], (), ("edges",))
        converted["sides"] = way["sides"] and self.entry(
            way["sides"], ("mean",), (), ("mean_range", "inside", "outside")
        )
        return converted


def tolerance_text(run):
    """Returns the tolerance of a deviation in percent and as a length, the one first that was given."""
    tolerance = run["tolerance"]
    unit = f" {run['unit']}" if run["unit"] else ""
    texts = [f"{tolerance['percent']:.4g} % of size", f"{tolerance['absolute']:.{DIGITS}g}{unit}"]
    return " = ".join(texts if tolerance["given_in"] == "percent" else texts[::-1])
