# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers the operators in bpy.ops.tolvol: set_tolerance, set_reference, clear_reference, show_original,
restore_original, new_original, check, measure_statistics, select_outside, worst_point, next_place, clear_places, probe,
add_label, renew_labels, remove_label, select_crossing, select_staying, save_report, copy_problem_report, decimate,
make_lods, show_level, smooth, apply_modifier, fit_modifier, deform, shade_by_reference and bake_normals."""

import bpy

from . import original
from .appearance import TOLVOL_OT_bake_normals, TOLVOL_OT_shade_by_reference
from .apply_modifier import TOLVOL_OT_apply_modifier
from .check import TOLVOL_OT_check, TOLVOL_OT_measure_statistics, TOLVOL_OT_select_outside
from .crossings import TOLVOL_OT_select_crossing
from .decimate import TOLVOL_OT_decimate
from .deform import TOLVOL_OT_deform
from .fit_modifier import TOLVOL_OT_fit_modifier
from .lod import TOLVOL_OT_make_lods, TOLVOL_OT_show_level
from .original import TOLVOL_OT_new_original, TOLVOL_OT_restore_original, TOLVOL_OT_show_original
from .places import TOLVOL_OT_clear_places, TOLVOL_OT_next_place, TOLVOL_OT_worst_point
from .presets import TOLVOL_MT_tolerances, TOLVOL_OT_set_tolerance
from .probe import TOLVOL_OT_add_label, TOLVOL_OT_probe, TOLVOL_OT_remove_label, TOLVOL_OT_renew_labels
from .problem_report import TOLVOL_OT_copy_problem_report
from .reference import TOLVOL_OT_clear_reference, TOLVOL_OT_set_reference
from .report import TOLVOL_OT_save_report
from .smooth import TOLVOL_OT_smooth
from .staying import TOLVOL_OT_select_staying

_CLASSES = (
    TOLVOL_OT_set_tolerance,
    TOLVOL_MT_tolerances,
    TOLVOL_OT_set_reference,
    TOLVOL_OT_clear_reference,
    TOLVOL_OT_show_original,
    TOLVOL_OT_restore_original,
    TOLVOL_OT_new_original,
    TOLVOL_OT_check,
    TOLVOL_OT_measure_statistics,
    TOLVOL_OT_select_outside,
    TOLVOL_OT_worst_point,
    TOLVOL_OT_next_place,
    TOLVOL_OT_clear_places,
    TOLVOL_OT_probe,
    TOLVOL_OT_add_label,
    TOLVOL_OT_renew_labels,
    TOLVOL_OT_remove_label,
    TOLVOL_OT_select_crossing,
    TOLVOL_OT_select_staying,
    TOLVOL_OT_save_report,
    TOLVOL_OT_copy_problem_report,
    TOLVOL_OT_decimate,
    TOLVOL_OT_make_lods,
    TOLVOL_OT_show_level,
    TOLVOL_OT_smooth,
    TOLVOL_OT_apply_modifier,
    TOLVOL_OT_fit_modifier,
    TOLVOL_OT_deform,
    TOLVOL_OT_shade_by_reference,
    TOLVOL_OT_bake_normals,
)

_register, _unregister = bpy.utils.register_classes_factory(_CLASSES)


def register():
    _register()
    original.register()


def unregister():
    original.unregister()
    _unregister()
