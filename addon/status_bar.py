# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows a line in Blender's status bar for some seconds: timers and handlers cannot report messages."""

import bpy

_SECONDS = 4.0


def say(text):
    """Shows the text for _SECONDS."""
    clear()
    _set(text)
    bpy.app.timers.register(_give_back, first_interval=_SECONDS, persistent=True)


def clear():
    """Removes the text before its time is over."""
    if bpy.app.timers.is_registered(_give_back):
        bpy.app.timers.unregister(_give_back)
        _give_back()


def _give_back():
    _set(None)


def _set(text):
    windows = bpy.context.window_manager.windows
    if len(windows):
        with bpy.context.temp_override(window=windows[0]):
            bpy.context.workspace.status_text_set(text)
