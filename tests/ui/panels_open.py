# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows a panel of the sidebar open that is closed at first."""

import contextlib

import bpy

from addon import panels
from addon.panels.layout import SubPanel


def _replace(classes, others):
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
    for cls in others:
        bpy.utils.register_class(cls)


def _opened(panel):
    """Returns the panel under another name: for each name Blender remembers whether the panel was last open."""
    name = panel.__name__.replace("TOLVOL_PT", "TOLVOL_TEST_PT")
    told = {"bl_idname": name, "bl_label": panel.bl_label, "bl_parent_id": panel.bl_parent_id, "draw": panel.draw}
    return type(name, (SubPanel, bpy.types.Panel), told)


@contextlib.contextmanager
def _registered(shown):
    shipped = panels._CLASSES
    _replace(shipped, shown)
    try:
        yield
    finally:
        _replace(shown, shipped)


def unfolded(panel):
    """Registers a panel open while the context lasts."""
    return _registered([_opened(panel) if cls is panel else cls for cls in panels._CLASSES])


def alone(*chosen):
    """Registers panels open, and none beside them, while the context lasts."""
    return _registered([panels._CLASSES[0], *map(_opened, chosen)])
