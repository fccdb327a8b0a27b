# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws panels without a window into lists of what they show."""

import bpy

from addon.panels import deviation


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

    def _draw_verdict(self, context, found):
        pass


def deviation_panel(monkeypatch):
    """Returns ({operator: label}, [texts]) of the panel Deviation for the active object."""
    texts = []
    monkeypatch.setattr(deviation, "text_lines", lambda _context, _layout, text, _icon: texts.append(text))
    panel = _Panel()
    deviation.TOLVOL_PT_deviation.draw(panel, bpy.context)
    return panel.layout.buttons, texts
