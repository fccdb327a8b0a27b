# SPDX-License-Identifier: GPL-3.0-or-later
"""smooth, deform, constrain and Guard with any of their options, judged by the promises of their docstrings."""

import re

import numpy as np
import tolvol

from . import judges
from .case import Finding
from .parts import (
    covers,
    draw_spline,
    faces_of,
    flipped,
    lattice_of,
    motion_of,
    moved,
    proved_inside,
    some,
    uncrossed_as_pieces,
    volume_of,
    within_as_pieces,
)

HELD = re.compile(r"(\d+) vert\w+ holds? T-junctions together and cannot move")


def draw_smooth(rng, case):
    options, n = case.options, len(case.vertices)
    options["iterations"] = int(some(rng, 0, 1, 3, 10, 30))
    options["operator"] = some(rng, "laplacian", "bilaplacian")
    options["weights"] = some(rng, "uniform", "cotangent")
    options["boundary"] = some(rng, "fixed", "along")
    options["mode"] = some(rng, "pull_back", "reset")
    options["two_sided"] = bool(rng.random() < 0.7)
    options["crossings"] = some(rng, "keep_out", "keep_out", "allow")
    draw_angle(rng, case)
    if rng.random() < 0.2:
        case.arrays["locked"] = rng.random(n) < rng.random()
    if rng.random() < 0.2:
        case.arrays["strength"] = rng.random(n) * (rng.random(n) < 0.8)
    if rng.random() < 0.2:
        options["moved"], options["outside"] = float(some(rng, 0.1, 0.5, 2)), some(rng, "error", "keep", "keep")
        case.arrays["motion"] = motion_of(rng, case, options["moved"])
    if rng.random() < 0.1:
        options["free"] = True


def draw_angle(rng, case):
    if rng.random() < 0.4:
        case.options["max_normal_angle"] = float(some(rng, 5, 45, 90, 180, 180))


def smooth(run):
    case, options, arrays = run.case, run.case.options, run.case.arrays
    vertices, triangles, volume = moved(run), case.triangles, volume_of(run)
    names = (
        *("iterations", "operator", "weights", "boundary", "mode", "two_sided", "outside", "crossings"),
        "max_normal_angle",
    )
    given = {name: options[name] for name in names if name in options}
    given |= {name: arrays[name] for name in ("locked", "strength") if name in arrays}

    def call(threads, progress):
        return tolvol.smooth(
            vertices, triangles, volume, to_world=case.to_world, threads=threads, progress=progress, **given
        )

    result = run.repeated("smooth", call, ("vertices",))
    stay = arrays.get("locked", np.zeros(len(vertices), bool)) | (arrays.get("strength", np.ones(len(vertices))) == 0)
    if len(result.report["held_back"]) != given.get("iterations", 10):
        raise Finding("report", f"held_back has {len(result.report['held_back'])} entries")
    _judge_motion(run, result, vertices, triangles, volume, stay)


def _judge_motion(run, result, vertices, faces, volume, stay):
    """Judges the promises that smooth, deform and constrain share. Without a volume nothing is held back."""
    case = run.case
    run.tell("judging")
    judges.valid(run, result.vertices, case.triangles, vertices.dtype)
    if not np.array_equal(result.vertices[stay], vertices[stay]):
        raise Finding("locked", f"vertex {np.flatnonzero(stay)[0]} or another that is to stay has moved")
    if volume is None:
        if np.any(result.report["held_back"]) or np.any(result.report["kept_from_crossing"]):
            raise Finding("report", f"vertices are said to be held back: {result.report}")
        return
    kept = np.zeros(len(faces), bool)
    if result.report["outside"]["faces"]:
        kept = ~proved_inside(run, vertices, faces, volume)
        if not np.array_equal(result.vertices[faces[kept]], vertices[faces[kept]]):
            raise Finding("outside", "a face that was outside has moved")
    reference = case.world(case.vertices), case.triangles
    within_as_pieces(run, case.world(result.vertices), faces[~kept], reference)
    if case.options["two_sided"] and not result.report["outside"]["reference_faces"]:
        covers(run, case.world(result.vertices), faces, reference)
    if case.options["crossings"] == "keep_out":
        uncrossed_as_pieces(run, vertices, result.vertices, faces)
    _judge_angles(run, result, faces, kept)
    if case.options["crossings"] != "keep_out" and np.any(result.report["kept_from_crossing"]):
        raise Finding("report", "vertices are said to be kept from crossing, which is allowed")


def _judge_angles(run, result, faces, kept):
    """Judges triangles alone: quads keep the angle in each of their triangulations, and may be folded."""
    angle, normals = run.case.options.get("max_normal_angle", 90), result.report["normals"]
    if (normals is None) != (faces.shape[1] < 3 or angle == 180) and not result.report["warnings"]:
        raise Finding("report", f"with an angle of {angle} degrees the normals are {normals}")
    if faces.shape[1] == 3:
        given = run.case.vertices, run.case.triangles
        judges.angles_kept(run, (result.vertices, faces[~kept]), given, result.report, angle)
    if normals is not None and normals["exceeded_after"] > normals["exceeded_before"]:
        raise Finding("angle", f"more faces exceed the angle than before: {normals}")


def draw_deform(rng, case):
    options = case.options
    options["mode"] = some(rng, "blocked", "farthest", "pull_back")
    options["two_sided"] = bool(rng.random() < 0.7)
    options["crossings"] = some(rng, "keep_out", "keep_out", "allow")
    draw_angle(rng, case)
    options["points"] = [int(k) for k in rng.integers(2, 6, 3)]
    options["amplitude"] = float(10 ** rng.uniform(-2, 2))
    options["seed"] = int(rng.integers(1 << 30))
    options["reach"] = float(some(rng, 0.5, 1.0, 1.2))
    if case.operation == "deform" and rng.random() < 0.2:
        options["moved"], options["outside"] = float(some(rng, 0.1, 0.5, 2)), some(rng, "error", "keep", "keep")
        case.arrays["motion"] = motion_of(rng, case, options["moved"])
    if case.operation == "deform":
        draw_spline(rng, case)
        if rng.random() < 0.1:
            options["free"] = True


def deform(run):
    case, options = run.case, run.case.options
    vertices, triangles, volume = moved(run), case.triangles, volume_of(run)
    lattice = run.call("Lattice", lambda: lattice_of(run, vertices))
    names = ("mode", "two_sided", "outside", "crossings", "max_normal_angle")
    given = {name: options[name] for name in names if name in options}

    def call(threads, progress):
        return tolvol.deform(
            vertices, lattice, triangles, volume, to_world=case.to_world, threads=threads, progress=progress, **given
        )

    result = run.repeated("deform", call, ("vertices",))
    fraction = result.report["permitted_fraction"]
    if fraction is not None and not 0 <= fraction <= 1:
        raise Finding("report", f"permitted_fraction is {fraction}")
    stopped = sum(result.report[why]["faces"] for why in ("leaving", "turning", "crossing")) > 0
    stay = np.full(len(vertices), options["mode"] == "blocked" and stopped)
    _judge_motion(run, result, vertices, triangles, volume, stay)


def draw_constrain(rng, case):
    case.options["corners"] = int(some(rng, 1, 2, 3, 3, 3, 4))
    case.options["mode"] = some(rng, "pull_back", "pull_back", "reset")
    case.options["two_sided"] = bool(case.options["corners"] > 2 and rng.random() < 0.7)
    case.options["outside"] = "keep" if case.options["corners"] == 4 else "error"
    case.options["crossings"] = some(rng, "keep_out", "keep_out", "allow")
    draw_angle(rng, case)
    case.arrays["wish"] = motion_of(rng, case, 10 ** rng.uniform(-1, 2))


def constrain(run):
    case, options = run.case, run.case.options
    vertices, volume = case.vertices, run.volume()
    faces = faces_of(case)
    wish = (vertices + case.arrays.get("wish", 0)).astype(vertices.dtype)

    def bounded(mode, threads, progress):
        return tolvol.constrain(
            vertices,
            wish,
            faces,
            volume,
            to_world=case.to_world,
            mode=mode,
            two_sided=options["two_sided"],
            outside=options["outside"],
            crossings=options["crossings"],
            max_normal_angle=options.get("max_normal_angle"),
            threads=threads,
            progress=progress,
        )

    result = run.repeated("constrain", lambda *how: bounded(options["mode"], *how), ("vertices", "factors"))
    f = result.factors
    _judge_motion(run, result, vertices, faces, volume, f == 0)
    if not ((f >= 0) & (f <= 1)).all() or result.report["held_back"] != (f < 1).sum():
        raise Finding(
            "factors", f"factors from {f.min()} to {f.max()}, {result.report['held_back']} said to be held back"
        )
    if options["mode"] == "reset" or options["two_sided"] or options["crossings"] == "keep_out":
        return
    if options["corners"] > 2 and options.get("max_normal_angle") != 180:
        return
    reset = run.call("constrain", lambda: bounded("reset", 1, None)).factors
    if (f < reset).any():
        raise Finding("factors", f"vertex {np.flatnonzero(f < reset)[0]} goes less far than by reset")
    before = vertices.astype(np.float64)
    kept = np.zeros(len(vertices), bool)
    kept[faces[~proved_inside(run, vertices, faces, volume)]] = True
    # What holds a T-junction together does not move, and a warning counts it. All other vertices that stay are judged
    # where there are more of them than it says.
    held = [int(said[1]) for said in map(HELD.match, result.report["warnings"]) if said]
    if held and (f == 0).sum() <= held[0] + kept.sum():
        kept |= f == 0
    for v in np.flatnonzero((f < 1) & ~kept)[:3]:
        # Vertices at one place that are to go to one place move together.
        together = (vertices == vertices[v]).all(1) & (wish == wish[v]).all(1)
        higher = result.vertices.copy()
        to = before[v] + min(1, f[v] + 1 / 64) * (wish[v].astype(np.float64) - before[v])
        higher[together] = wish[v] if f[v] + 1 / 64 >= 1 else to
        around = faces[together[faces].any(1)]
        if (kept & together).any():
            continue
        if proved_inside(run, higher, around, volume).all():
            raise Finding("factors", f"vertex {v} could go on: its factor is {f[v]}, and 1/64 more is inside")


def draw_guard(rng, case):
    largest = np.abs(case.vertices).max(initial=0)
    if largest and not 1e-25 < largest < 1e25:  # A guard takes only float32, whose range is smaller.
        case.vertices, case.tolerance = case.vertices / largest, case.tolerance / largest
    case.vertices = case.vertices.astype(np.float32)
    case.options["seed"] = int(rng.integers(1 << 30))
    case.options["edits"] = int(rng.integers(1, 6))
    case.options["two_sided"] = bool(rng.random() < 0.7)
    case.options["crossings"] = some(rng, "keep_out", "allow")
    draw_angle(rng, case)
    case.options["amplitude"] = float(10 ** rng.uniform(-1, 2))
    if rng.random() < 0.3:
        case.options["moved"], case.options["outside"] = (
            float(some(rng, 0.1, 0.5, 2)),
            some(rng, "error", "keep", "keep"),
        )
        case.arrays["motion"] = motion_of(rng, case, case.options["moved"])
    if rng.random() < 0.3:
        case.options["resets"] = True
    elif rng.random() < 0.4:
        case.options["flips"] = float(rng.choice([0.02, 0.3]))


def guard(run):
    case, options = run.case, run.case.options
    start, volume = moved(run), run.volume()

    def begun(threads, progress):
        guard = tolvol.Guard(
            start,
            case.triangles,
            volume,
            to_world=case.to_world,
            two_sided=options["two_sided"],
            outside=options.get("outside", "error"),
            crossings=options["crossings"],
            max_normal_angle=options.get("max_normal_angle"),
            threads=threads,
            progress=progress,
        )
        if options.get("resets"):
            guard.reset(start, progress=progress)
        return guard

    class Edited:
        """Makes some edits, lets the guard correct each, and returns the mesh."""

        def __init__(self, threads):
            rng = np.random.default_rng(options["seed"])
            guard = begun(threads, None)
            self.vertices, self.triangles = start.copy(), case.triangles
            scale = 1 if case.to_world is None else np.linalg.norm(case.to_world[:3, :3], 2)
            for edit in range(options["edits"]):
                if options.get("resets") and edit == options["edits"] // 2:
                    # As after opening another version: what was corrected, or what was there at first.
                    self.vertices = self.vertices if rng.random() < 0.5 else start.copy()
                    run.call("Guard.reset", lambda: guard.reset(self.vertices), threads)
                touched = rng.random(len(self.vertices)) < rng.random()
                motion = rng.standard_normal((touched.sum(), 3)) * options["amplitude"] * case.tolerance / scale
                self.vertices[touched] += motion.astype(np.float32)
                indices, back = self.corrections(guard, threads)
                self.vertices[indices] = back
                if options.get("flips"):
                    self.flip(guard, rng, threads)
            self.again = len(self.corrections(guard, threads)[0])
            self.outside, self.uncovered = guard.outside, guard.uncovered

        def flip(self, guard, rng, threads):
            others = flipped(self.triangles, options["flips"], rng)
            if not len(run.call("Guard.replace_faces", lambda: guard.replace_faces(others), threads)):
                self.triangles = others

        def corrections(self, guard, threads):
            return run.call("Guard.constrain", lambda: guard.constrain(self.vertices), threads)

    run.repeated("Guard", begun, ("outside", "uncovered"))
    result = run.repeated_in_steps("Guard", Edited, ("vertices", "triangles", "outside", "uncovered"))
    if result.again:
        raise Finding("guard", f"{result.again} vertices go back again, though nothing was edited")
    triangles = result.triangles
    judges.valid(run, result.vertices, triangles, np.float32)
    kept = case.triangles[result.outside]
    if not np.array_equal(result.vertices[kept], start[kept]):
        raise Finding("outside", "a face that was outside at the start has moved")
    reference = case.world(case.vertices), case.triangles
    within_as_pieces(run, case.world(result.vertices), np.delete(triangles, result.outside, axis=0), reference)
    if options["two_sided"] and not result.uncovered:
        covers(run, case.world(result.vertices), triangles, reference)
    if options["crossings"] == "keep_out":
        judges.uncrossed(run, start, result.vertices, case.triangles, triangles)
