# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains of operations against one reference."""

import numpy as np
import tolvol

import judge

from . import judges
from .moving import draw_deform
from .parts import lattice_of

STEPS = ("decimate", "thorough", "one-sided", "smooth", "deform", "constrain")


def draw_chain(rng, case):
    draw_deform(rng, case)
    case.options["steps"] = [str(step) for step in rng.choice(STEPS, int(rng.integers(2, 5)))]


def chain(run):
    """Runs a chain of operations against one reference. Each operation takes the result of the previous one."""
    case, options = run.case, run.case.options
    volume = run.volume()
    vertices, triangles, place = case.vertices, case.triangles, {"to_world": case.to_world, "threads": run.threads[0]}
    rng = np.random.default_rng(options["seed"])
    scale = 1 if case.to_world is None else np.linalg.norm(case.to_world[:3, :3], 2)
    both_ways = True
    for step in options["steps"]:
        before = vertices, triangles

        # After a step that keeps only one direction the other one may be lost.
        both_ways = both_ways and step != "one-sided"
        place["two_sided"] = both_ways

        def call(step=step, v=vertices, t=triangles):
            if step == "smooth":
                return tolvol.smooth(v, t, volume, iterations=3, **place)
            if step == "deform":
                return tolvol.deform(v, lattice_of(run, v), t, volume, mode=options["mode"], **place)
            if step == "constrain":
                wish = v + rng.standard_normal(v.shape) * case.tolerance / scale
                return tolvol.constrain(v, wish.astype(v.dtype), t, volume, **place)
            return tolvol.decimate(v, t, volume, effort="thorough" if step == "thorough" else "fast", **place)

        result = run.call(step, call, run.threads[0])
        vertices = result.vertices
        # A decimation gives new triangles. An operation that moves vertices keeps the present ones.
        triangles = getattr(result, "triangles", triangles)
        judges.valid(run, vertices, triangles, case.vertices.dtype)
        reference = case.world(case.vertices), case.triangles
        judges.within(run, (case.world(vertices), triangles), reference, case.tolerance, f"after {step}")
        decimates = step in ("decimate", "thorough", "one-sided")
        if both_ways:
            judges.within(run, reference, (case.world(vertices), triangles), case.tolerance, f"reference to {step}")
        if decimates:
            judges.connected_alike(run, before, (vertices, triangles), judge.joins_t_junctions(result))
        else:
            judges.uncrossed(run, before[0], vertices, triangles)
