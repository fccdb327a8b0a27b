# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the report of a run and texts from it.

A run is a dictionary, as --report writes it (decimation_run()), or that of another operation (last_run.py). Its lengths
are in world units.
"""

import math

from .. import package
from ..numbers import three_digits
from . import solidity
from .verdict import Interval

# The distance of the reference counts as no larger than before if its upper end grew by at most this share, the width of a
# certified interval (native/measure/hausdorff.h): equal distances count as equal.
_RESOLUTION = 0.001


# Why a hole is left open: the outcomes of close_holes(), and "unselected".
_LEFT_OPEN = {
    "not_a_loop": "with a rim that does not close",
    "too_long": "of more than 1,000 edges",
    "perimeter": "beyond Largest Perimeter",
    "outside": "beyond the tolerance",
    "turned": "with faces that would be turned away",
    "crossing": "with faces that would cross others",
    "non_manifold": "with edges that would have three faces",
    "degenerate": "with faces that would have no area",
    "given_up": "given up after a long search",
    "unselected": "at unselected faces",
}


def decimation_run(source, result, native_report, volume, certified, options, seconds, holes=None):
    """Returns the run of one decimation.

    source: the MeshArrays of the input; result: the Decimated; native_report: the report of the native decimate();
    certified: the result of certify() for the mesh that will be stored, and "solidity", the result of solidity.compared();
    options: two_sided, placement, effort and target_triangles as they were given. holes: what became of the holes, a
    dictionary of closed, triangles_added, refused, places, largest_perimeter, max_normal_angle and warnings, or None if
    none were to be closed.
    """
    # The native report lists unused vertices as removed, but Blender keeps them: this is not a repair here.
    repairs = [repair for repair in native_report["repairs"] if repair["kind"] != "unused"]
    if result.coincident:
        message = f"{result.coincident:,} faces that lie exactly on another face were left out"
        repairs.append({"kind": "coincident", "count": result.coincident, "message": message})
    return {
        "version": package.module.__version__,
        "input": {"vertices": len(source.vertices), "triangles": len(source.triangles)},
        "output": {"vertices": len(result.vertices), "triangles": len(result.triangles)},
        "tolerance": {"absolute": volume.tolerance, "percent": 100 * volume.tolerance / volume.diagonal},
        "two_sided": options["two_sided"],
        "placement": options["placement"],
        "effort": options["effort"],
        "target_triangles": options["target_triangles"],
        "stopped_by": native_report["stopped_by"],
        "method": native_report["method"],
        "renderer": native_report["renderer"],
        "precision": volume.precision,
        "forward": certified["forward"],
        "backward": certified["backward"],
        "solidity": certified["solidity"],
        "crossings": {when: certified["solidity"][when]["crossing_pairs"] for when in ("before", "after")},
        "normals": native_report["normals"],
        "seconds": seconds,
        "repairs": repairs,
        "locked": native_report["locked"],
        "outside": native_report["outside"] | certified["outside"],
        "holes": holes and {key: value for key, value in holes.items() if key != "warnings"},
        "warnings": (holes or {"warnings": []})["warnings"] + native_report["warnings"],
    }


def proved(run):
    """Whether the certified intervals prove the promise of the run."""
    tolerance = run["tolerance"]["absolute"]
    kept = run["outside"]
    # If faces that were outside from the start were kept, the other faces have to be within the tolerance, and the
    # reference must not be farther away than it was before.
    forward = kept.get("rest", run["forward"])
    backward_bound = max(tolerance, kept.get("backward_before", 0.0) * (1 + _RESOLUTION))
    backward = Interval(*run["backward"])
    return Interval(*forward).within(tolerance) and (not run["two_sided"] or backward.within(backward_bound))


def line(run, seconds=None):
    """Returns a run as one line of text, which programs may read. Every percentage is of the reference's size."""
    size = 100 * run["tolerance"]["absolute"] / run["tolerance"]["percent"]
    seconds = sum(run["seconds"].values()) if seconds is None else seconds
    normals = ""
    if run["normals"] and run["normals"]["largest"] is not None:
        others = "other " if run["normals"]["exceeded_after"] or run["normals"]["unsure"] else ""
        # Rounded up: a proved bound must not look smaller than it is.
        largest = math.ceil(10 * run["normals"]["largest"]) / 10
        normals = f", {others}normals within {largest:g}\N{DEGREE SIGN}"
    return (
        f"{counts(run)}, "
        f"tolerance {run['tolerance']['percent']:.4g} % = {run['tolerance']['absolute']:.3g}, "
        f"result within {all_digits(run['forward'][1], size)}, reference within {all_digits(run['backward'][1], size)}"
        f"{normals} ({'proved' if proved(run) else 'not proved'}), {duration(seconds)}"
    )


def counts(run, as_text="{:.3g}".format):
    """Returns the numbers of triangles before and after a run as text, with remarks. as_text: returns a length as text.

    The remarks say how many holes were closed and how many were not, why the run ended early or missed its target, how
    many faces outside the tolerance were kept, how many pairs of faces cross, and how many faces have a larger angle to
    the reference than they may have.
    """
    remarks = [holes_closed(run["holes"], as_text)] if run.get("holes") else []
    if run["target_triangles"] and run["stopped_by"] != "target":
        within = " within the tolerance" if run["stopped_by"] == "tolerance" else ""
        remarks.append(f"target {run['target_triangles']:,} not reached{within}")
    if run["stopped_by"] == "request":
        remarks.append("stopped early")
    if run["stopped_by"] == "time":
        remarks.append("stopped at the time limit")
    if run["outside"]["faces"]:
        remarks.append(f"{run['outside']['faces']:,} faces outside kept")
    pairs = run.get("crossings", {"after": 0})  # a file may keep a run of an earlier version
    if pairs["after"]:
        before = "" if pairs["before"] is None else f", before {solidity.pair_count(pairs['before'])}"
        remarks.append(f"{solidity.pair_count(pairs['after'])} pairs of faces cross{before}")
    turned = (run.get("normals") or {"exceeded_after": 0})["exceeded_after"]
    if turned:
        remarks.append(f"{turned:,} faces beyond the angle of Normals, before {run['normals']['exceeded_before']:,}")
    remark = f" ({', '.join(remarks)})" if remarks else ""
    return f"{run['input']['triangles']:,} -> {run['output']['triangles']:,} triangles{remark}"


def holes_closed(holes, as_text="{:.3g}".format):
    """Returns the entry "holes" of a run as text. as_text: returns a length as text."""
    closed, refused = holes["closed"], holes["refused"]
    text = f"{closed:,} hole{'s' if closed != 1 else ''} closed"
    if holes.get("places"):  # a file may keep a run of an earlier version
        text += f", {'the longest' if closed > 1 else 'its'} rim {as_text(holes['places'][0]['perimeter'])}"
    if not refused:
        return text
    reasons = ", ".join(f"{refused[reason]:,} {words}" for reason, words in _LEFT_OPEN.items() if reason in refused)
    return f"{text}, {sum(refused.values()):,} left open: {reasons}"


def hole_rows(holes):
    """Yields the entry "holes" of a run as (quantity, at, value): counts, and each place by itself."""
    for key in ("closed", "triangles_added"):
        yield f"holes {key}", "", holes[key]
    for reason, count in holes["refused"].items():
        yield "holes left open", reason, count
    for i, place in enumerate(holes.get("places", ())):
        yield f"hole {i + 1} perimeter", "", place["perimeter"]
        for axis, value in zip("xyz", place["centre"]):
            yield f"hole {i + 1} centre", axis, value


def intervals(run):
    """Returns both certified intervals as text for a message."""
    size = 100 * run["tolerance"]["absolute"] / run["tolerance"]["percent"]
    forward, backward = (
        f"between {percent(run[way][0], size)} and {percent(run[way][1], size)}" for way in ("forward", "backward")
    )
    return f"the result is {forward} of the size from the reference, the reference {backward} from the result"


# A smaller percentage is hardly more than rounding, and Python would write it with an exponent.
_LEAST_PERCENT = 0.0001


def percent(value, whole):
    """Returns `value` in percent of `whole` for people to read, like all_digits() but without the digits of tiny values."""
    return f"<{_LEAST_PERCENT} %" if 0 < 100 * value / whole < _LEAST_PERCENT else all_digits(value, whole)


def all_digits(value, whole):
    """Returns `value` in percent of `whole` with three digits, rounded up: a proved bound must not look smaller than it is."""
    share = 100 * value / whole
    if share <= 0:
        return "0 %"
    excess = share - 100
    # Just above 100 % more digits are shown, so that the text neither hides nor inflates the excess.
    if 1e-9 < excess < 1:
        digits = 1 - math.floor(math.log10(excess))
        return f"{100 + math.ceil(excess * 10**digits - 1e-4) / 10**digits:.{digits}f} %"
    step = 10.0 ** (math.floor(math.log10(share)) - 2)
    # An excess of less than a ten-thousandth of the last digit is not rounded up: rounding 1 % to float32 makes such one.
    return three_digits(math.ceil(share / step - 1e-4) * step) + " %"


def duration(seconds):
    return f"{seconds:.1f} s" if seconds >= 0.1 else f"{seconds:.2f} s"
