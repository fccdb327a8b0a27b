# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws a panel without a window into a list of what it shows."""

import bpy


class _Layout:
    """Takes the calls of a panel. `buttons`: {operator: label}."""

    def __init__(self, buttons):
        self.buttons = buttons

    def operator(self, name, text=None, **_options):
        kind = getattr(bpy.types, f"TOLVOL_OT_{name.partition('.')[2]}")
        self.buttons[name] = kind.bl_label if text is None else text
        return _Any()

    def __getattr__(self, name):
        return lambda *_arguments, **_options: _Layout(self.buttons)


class _Any:
    pass


class _Panel:
    def __init__(self):
        self.layout = _Layout({})


def buttons(panel):
    """Returns {operator: label} of a panel for the active object."""
    drawn = _Panel()
    panel.draw(drawn, bpy.context)
    return drawn.layout.buttons
