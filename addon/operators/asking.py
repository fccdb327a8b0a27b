# SPDX-License-Identifier: GPL-3.0-or-later
"""Asks before something is lost."""


def ask(context, title, lines, draw_entry):
    """Opens a menu that says what would be lost. draw_entry(layout) draws the entry that does it all the same."""

    def draw(menu, _context):
        for line in lines:
            menu.layout.label(text=line)
        menu.layout.separator()
        menu.layout.operator_context = "INVOKE_DEFAULT"
        draw_entry(menu.layout)

    context.window_manager.popup_menu(draw, title=title, icon="QUESTION")
