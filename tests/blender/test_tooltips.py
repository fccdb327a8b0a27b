# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender cuts the tooltip of an operator after 239 characters; no text of the add-on may be longer."""

import inspect

import bpy

_MOST = 239


def classes():
    for base in (
        bpy.types.Operator,
        bpy.types.Panel,
        bpy.types.Menu,
        bpy.types.PropertyGroup,
        bpy.types.AddonPreferences,
    ):
        for cls in base.__subclasses__():
            if cls.__module__.startswith("addon."):
                yield cls


def rna(cls):
    """Returns what Blender has stored about a class."""
    if not issubclass(cls, bpy.types.Operator):
        return cls.bl_rna
    return getattr(bpy.ops.tolvol, cls.bl_idname.removeprefix("tolvol.")).get_rna_type()


def texts():
    """Yields (name, tooltip) of all classes, properties and choices of the add-on."""
    for cls in classes():
        yield cls.__name__, getattr(cls, "bl_description", None) or inspect.cleandoc(cls.__doc__ or "")
        for name, prop in rna(cls).properties.items():
            yield f"{cls.__name__}.{name}", prop.description
            for item in getattr(prop, "enum_items", ()):
                yield f"{cls.__name__}.{name}.{item.identifier}", item.description
    held = "tolvol_show_original"
    yield held, bpy.types.WindowManager.bl_rna.properties[held].description


def test_no_tooltip_is_cut():
    found = dict(texts())
    assert len(found) > 150 and "TOLVOL_OT_decimate" in found and "TOLVOL_OT_decimate.placement.SUBSET" in found
    assert {name: len(text) for name, text in found.items() if len(text) > _MOST} == {}


def test_no_tooltip_ends_in_a_full_stop():
    ours = {name: text for name, text in texts() if name.startswith("TOLVOL_OT_")}
    assert [name for name, text in ours.items() if text.endswith(".")] == []


def test_every_operator_says_what_it_does_in_full():
    """What Blender has stored is the whole text."""
    for cls in classes():
        if issubclass(cls, bpy.types.Operator):
            assert rna(cls).description == inspect.cleandoc(cls.__doc__), cls.__name__
