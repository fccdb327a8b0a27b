# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of decimate.py about a whole file, from the reports of the operator about its objects."""

from .. import filling


def summary(names, runs, judged, tolerance, size, target):
    """Returns the report of a whole file from those of its objects.

    names, runs: the name and the operator's report of each object. judged: what certify() found of each object in the file; its
    distances are those of the report. tolerance, size: in the file's units. target: the triangles that were asked for, or None.
    """

    def worst(pairs):
        return [max(ends) for ends in zip(*pairs)]

    forward, backward = (worst(part[way] for part in judged) for way in ("forward", "backward"))
    outside = {"faces": sum(run["outside"]["faces"] for run in runs), "first": None}
    if outside["faces"]:
        outside["first"] = next(run["outside"]["first"] for run in runs if run["outside"]["faces"])
        outside["rest"] = worst(part["outside"].get("rest", part["forward"]) for part in judged)
        outside["backward_before"] = max(run["outside"].get("backward_before", 0.0) for run in runs)
    locked = {}
    for run in runs:
        for cause, count in run["locked"].items():
            locked[cause] = locked.get(cause, 0) + count
    left = sum(run["output"]["triangles"] for run in runs)
    target = target or 0
    out_of_time = any(run["stopped_by"] == "time" for run in runs)
    several = len(runs) > 1
    return {
        **{key: runs[0][key] for key in ("version", "two_sided", "placement", "effort", "method", "renderer")},
        "tolerance": {"absolute": tolerance, "percent": 100 * tolerance / size},
        "target_triangles": target,
        "stopped_by": "target" if target and left <= target else "time" if out_of_time else "tolerance",
        "precision": min(run["precision"] for run in runs),
        "forward": forward,
        "backward": backward,
        "outside": outside,
        "normals": _normals(runs),
        "holes": _holes(runs),
        "repairs": [
            {**repair, "message": f"{name}: {repair['message']}" if several else repair["message"]}
            for name, run in zip(names, runs)
            for repair in run["repairs"]
        ],
        "locked": locked,
        "warnings": [
            f"{name}: {text}" if several else text for name, run in zip(names, runs) for text in run["warnings"]
        ],
        "objects": [{"name": name, **run} for name, run in zip(names, runs)],
    }


def deviation(run):
    """Returns the larger of both proved distances of a run."""
    return max(run["forward"][1], run["backward"][1])


def _normals(runs):
    """Returns the normals of several runs as those of one, or None if a run has none.

    They are of the meshes before the file rounds coordinates.
    """
    kept = [run["normals"] for run in runs]
    if not all(kept):
        return None
    counts = {key: sum(one[key] for one in kept) for key in ("unsure", "exceeded_before", "exceeded_after")}
    return {"largest": max((one["largest"] for one in kept if one["largest"] is not None), default=None), **counts}


def _holes(runs):
    """Returns what became of the holes of several runs as of one, or None if none were to be closed."""
    if runs[0]["holes"] is None:
        return None
    refused = {}
    for run in runs:
        for reason, count in run["holes"]["refused"].items():
            refused[reason] = refused.get(reason, 0) + count
    counts = {key: sum(run["holes"][key] for run in runs) for key in ("closed", "triangles_added")}
    places = filling.largest([place for run in runs for place in run["holes"]["places"]])
    return {**counts, "refused": refused, "places": places, "largest_perimeter": runs[0]["holes"]["largest_perimeter"]}
