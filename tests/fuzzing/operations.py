# SPDX-License-Identifier: GPL-3.0-or-later
"""The operations by name. draw_<name>(rng, case) gives a case its options; <name>(run) runs the case and judges it."""

from . import chaining, closing, decimating, measuring, moving

_MODULES = {
    decimating: ("decimate",),
    moving: ("smooth", "deform", "constrain", "guard"),
    measuring: ("check", "distance", "hausdorff", "deviation"),
    chaining: ("chain",),
    closing: ("close_holes",),
}
OPERATIONS = {name: getattr(module, name) for module, names in _MODULES.items() for name in names}
DRAW = {name: getattr(module, f"draw_{name}") for module, names in _MODULES.items() for name in names}
