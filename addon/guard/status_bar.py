# SPDX-License-Identifier: GPL-3.0-or-later
"""A line in Blender's status bar for some seconds: timers and handlers have no reports."""

import time

import bpy

_SECONDS = 4.0
_until = None


def say(text):
    """Shows the text; None gives the bar back."""
    global _until
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window):
        bpy.context.workspace.status_text_set(text)
    _until = text and time.monotonic() + _SECONDS


def look():
    """Gives the bar back in time; whether it still has to be."""
    if _until is not None and time.monotonic() > _until:
        say(None)
    return _until is not None


def clear():
    if _until is not None:
        say(None)
