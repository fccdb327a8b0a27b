# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws panels without a window into lists of what they show."""

from types import SimpleNamespace

import bpy


class Layout:
    """Takes the calls of a panel, and so do all layouts made of it.

    `buttons`: {operator: label}. `shown`: (name of the call, its arguments, its options) of all calls that show something.
    """

    def __init__(self, within=None):
        self.buttons, self.shown = (within.buttons, within.shown) if within else ({}, [])

    def operator(self, name, text=None, **options):
        kind = getattr(bpy.types, f"TOLVOL_OT_{name.partition('.')[2]}", None)
        self.buttons[name] = kind and kind.bl_label if text is None else text
        self.shown.append(("operator", (name,), options))
        return SimpleNamespace()

    def __getattr__(self, name):
        if name in {"row", "column", "split", "box", "grid_flow"}:
            return lambda *_arguments, **_options: Layout(self)
        return lambda *arguments, **options: self.shown.append((name, arguments, options))

    def labels(self):
        """Returns (text, icon) of all labels with a text."""
        found = [options for name, _, options in self.shown if name == "label"]
        return [(options["text"], options.get("icon", "NONE")) for options in found if options.get("text")]

    def properties(self):
        """Returns the names of all properties that are shown."""
        return [arguments[1] for name, arguments, _ in self.shown if name == "prop"]


def drawn(panel, context=None, **more):
    """Returns the Layout into which a panel has drawn. more: further attributes of the panel."""
    layout = Layout()
    panel.draw(SimpleNamespace(layout=layout, **more), context or bpy.context)
    return layout


def buttons(panel):
    """Returns {operator: label} of a panel for the active object."""
    return drawn(panel).buttons


def sidebar(width=400):
    """Returns a context whose region is as wide as this. In Blender without a window the scale is 0."""
    preferences = SimpleNamespace(
        system=SimpleNamespace(ui_scale=1),
        ui_styles=bpy.context.preferences.ui_styles,
        addons=bpy.context.preferences.addons,
    )
    return SimpleNamespace(
        region=SimpleNamespace(width=width),
        preferences=preferences,
        **{name: getattr(bpy.context, name) for name in ("scene", "active_object", "selected_objects", "mode")},
        window_manager=bpy.context.window_manager,
    )
