# SPDX-License-Identifier: GPL-3.0-or-later
"""Operations in any order, with the settings that a new object has: none is refused for what another one left."""

import os

import bpy
import numpy as np
import pytest

from addon import native
from scenes import cage, dissolve, torus, world_triangles


def smooth(ob, rng):
    bpy.ops.tolvol.smooth(iterations=int(rng.integers(1, 6)), method=str(rng.choice(["LAPLACIAN", "BILAPLACIAN"])))


def deform(ob, rng):
    lattice = cage(size=(3, 3, 2))
    for point in lattice.data.points:
        point.co_deform = np.array(point.co) + rng.uniform(-0.02, 0.02, 3)
    bpy.context.view_layer.objects.active = ob
    bpy.ops.tolvol.deform(lattice=lattice.name, mode="PULL_BACK")
    bpy.data.objects.remove(lattice)


def displace(ob, rng):
    modifier = ob.modifiers.new("displace", "DISPLACE")
    modifier.strength, modifier.mid_level = rng.uniform(-0.02, 0.02), 0
    bpy.ops.tolvol.apply_modifier(modifier=modifier.name)


def decimate(ob, rng):
    bpy.ops.tolvol.decimate()


@pytest.mark.parametrize("seed", range(60 if os.environ.get("TOLVOL_ALL_TESTS") else 12))
def test_no_operation_is_refused_for_what_another_left(seed):
    rng = np.random.default_rng(seed)
    ob = torus(around=24, across=12, noise=float(rng.choice([0.01, 0.05])), seed=seed)
    if seed % 2:
        dissolve(ob, rng)
    ob.tolvol.tolerance_percent = 3
    reference = world_triangles(ob)
    tolerance = 0.03 * native.module.diagonal(*reference)
    crossing = len(native.module.crossing_pairs(*reference))
    for operation in rng.choice([smooth, deform, displace, decimate], 4):
        operation(ob, rng)
        stored = world_triangles(ob)
        assert native.module.hausdorff(*stored, *reference, bound=tolerance).upper <= tolerance, operation.__name__
        now = len(native.module.crossing_pairs(*stored))
        assert now <= crossing, operation.__name__
        crossing = now
