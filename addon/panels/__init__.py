# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers the panels of 3D View > Sidebar > Tolerance, from top to bottom, and entries in Blender's own menus."""

import bpy

from . import menus
from .appearance import TOLVOL_PT_appearance
from .decimate import TOLVOL_PT_advanced, TOLVOL_PT_decimate, TOLVOL_PT_protect
from .deform import TOLVOL_PT_deform
from .deviation import (
    TOLVOL_PT_deviation,
    TOLVOL_PT_labels,
    TOLVOL_PT_objects,
    TOLVOL_PT_show_deviation,
    TOLVOL_PT_statistics,
    TOLVOL_UL_labels,
)
from .guard import TOLVOL_PT_guard
from .lod import TOLVOL_PT_lod
from .modifiers import TOLVOL_PT_modifiers
from .notes import TOLVOL_PT_notes
from .smooth import TOLVOL_PT_smooth
from .tolerance import TOLVOL_PT_tolerance

_CLASSES = (
    TOLVOL_PT_tolerance,
    TOLVOL_PT_decimate,
    TOLVOL_PT_protect,
    TOLVOL_PT_advanced,
    TOLVOL_PT_deviation,
    TOLVOL_PT_objects,
    TOLVOL_UL_labels,
    TOLVOL_PT_labels,
    TOLVOL_PT_statistics,
    TOLVOL_PT_show_deviation,
    TOLVOL_PT_appearance,
    TOLVOL_PT_lod,
    TOLVOL_PT_smooth,
    TOLVOL_PT_modifiers,
    TOLVOL_PT_deform,
    TOLVOL_PT_guard,
    TOLVOL_PT_notes,  # the last one (see notes.py)
)

_register, _unregister = bpy.utils.register_classes_factory(_CLASSES)


def register():
    _register()
    menus.register()


def unregister():
    menus.unregister()
    _unregister()
