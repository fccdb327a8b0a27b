# SPDX-License-Identifier: GPL-3.0-or-later
"""The numbers of a run. A run is a dictionary as --report writes it (`decimation_run`), lengths in world units."""

import json
import math

from .. import native

# What the certified distance leaves open of itself: Interval is at most this wide, relative to its upper end.
_RESOLUTION = 0.01


def decimation_run(source, result, native_report, volume, certified, options, seconds):
    """What one decimation says of itself.

    source: the MeshArrays that went in; result: the Decimated; native_report: decimate()'s own; certified: by certify(), of
    what will be stored; options: two_sided, placement, effort, target_triangles as given.
    """
    # Blender keeps vertices that no face uses, so they are no repair here.
    repairs = [repair for repair in native_report["repairs"] if repair["kind"] != "unused"]
    if result.coincident:
        message = f"{result.coincident:,} faces left out that lie exactly on another face"
        repairs.append({"kind": "coincident", "count": result.coincident, "message": message})
    return {
        "version": native.module.__version__,
        "input": {"vertices": len(source.vertices), "triangles": len(source.triangles)},
        "output": {"vertices": len(result.vertices), "triangles": len(result.triangles)},
        "tolerance": {"absolute": volume.tolerance, "percent": 100 * volume.tolerance / volume.size},
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
        "seconds": seconds,
        "repairs": repairs,
        "locked": native_report["locked"],
        "outside": native_report["outside"] | certified["outside"],
        "warnings": native_report["warnings"],
    }


def proved(run):
    """Whether the certified intervals hold what was promised."""
    tolerance = run["tolerance"]["absolute"]
    kept = run["outside"]
    # Faces that were outside from the start and kept: the rest is within, and the reference no worse than before.
    forward = kept.get("rest", run["forward"])
    backward_bound = max(tolerance, kept.get("backward_before", 0.0) * (1 + _RESOLUTION))
    return forward[1] <= tolerance and (not run["two_sided"] or run["backward"][1] <= backward_bound)


def line(run, seconds=None):
    """A run in one line; every percentage is of the reference's size."""
    size = 100 * run["tolerance"]["absolute"] / run["tolerance"]["percent"]
    seconds = sum(run["seconds"].values()) if seconds is None else seconds
    return (
        f"{counts(run)}, "
        f"tolerance {run['tolerance']['percent']:.4g} % = {run['tolerance']['absolute']:.3g}, "
        f"result within {percent(run['forward'][1], size)}, reference within {percent(run['backward'][1], size)} "
        f"({'certified' if proved(run) else 'not proved'}), {duration(seconds)}"
    )


def counts(run):
    """How many triangles a run left, and what kept it from leaving fewer or all of it from being within."""
    remarks = []
    if run["target_triangles"] and run["stopped_by"] != "target":
        within = " within the tolerance" if run["stopped_by"] == "tolerance" else ""
        remarks.append(f"target {run['target_triangles']:,} not reached{within}")
    if run["stopped_by"] == "request":
        remarks.append("stopped early")
    if run["stopped_by"] == "time":
        remarks.append("stopped at the time limit")
    if run["outside"]["faces"]:
        remarks.append(f"{run['outside']['faces']:,} faces outside kept")
    remark = f" ({', '.join(remarks)})" if remarks else ""
    return f"{run['input']['triangles']:,} -> {run['output']['triangles']:,} triangles{remark}"


def remembered_counts(text):
    """counts() of a run that a file keeps as JSON, or None when the text is no such run: a file may be damaged."""
    try:
        return counts(json.loads(text))
    except (ValueError, TypeError, LookupError, RecursionError):
        return None


def intervals(run):
    """Both certified intervals, for a message."""
    size = 100 * run["tolerance"]["absolute"] / run["tolerance"]["percent"]
    forward, backward = (
        f"between {percent(run[way][0], size)} and {percent(run[way][1], size)}" for way in ("forward", "backward")
    )
    return f"the result is {forward} of the size from the reference, the reference {backward} from the result"


def percent(value, whole):
    """`value` in % of `whole` with three digits, rounded up: a proved bound must not look smaller than it is."""
    share = 100 * value / whole
    if share <= 0:
        return "0 %"
    excess = share - 100
    if 1e-9 < excess < 1:  # however little is beyond the whole is seen, and not made more of
        digits = 1 - math.floor(math.log10(excess))
        return f"{100 + math.ceil(excess * 10**digits - 1e-4) / 10**digits:.{digits}f} %"
    step = 10.0 ** (math.floor(math.log10(share)) - 2)
    # A last digit is not rounded up for less than a ten-thousandth of it, which is what float32 does to 1 %.
    return f"{math.ceil(share / step - 1e-4) * step:#.3g}".rstrip(".") + " %"


def duration(seconds):
    return f"{seconds:.1f} s" if seconds >= 0.1 else f"{seconds:.2f} s"
