# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows a line in Blender's status bar.

Blender keeps a text for each workspace. While a job runs, the user may go to another workspace: the text is removed from
all that got one.
"""

import bpy

_SECONDS = 4.0

_given = set()  # names of the workspaces that have a text


def show(text):
    """Shows the text in all windows until clear()."""
    _stay()
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            window.workspace.status_text_set(text)
        _given.add(window.workspace.name)


def say(text, seconds=_SECONDS):
    """Shows the text for so many seconds: timers and handlers cannot report messages."""
    show(text)
    bpy.app.timers.register(_remove, first_interval=seconds, persistent=True)


def showing():
    """Whether all windows show a text now. Others may have removed it, and the user may have gone to another workspace."""
    return all(window.workspace.name in _given for window in bpy.context.window_manager.windows)


def clear():
    """Removes the text from all workspaces that have one."""
    _stay()
    _remove()


def _remove():
    for workspace in bpy.data.workspaces:
        if workspace.name in _given:
            # Blender takes the workspace from the context.
            with bpy.context.temp_override(workspace=workspace):
                workspace.status_text_set(None)
    _given.clear()


def _stay():
    """Ends the time of the text that is shown now."""
    if bpy.app.timers.is_registered(_remove):
        bpy.app.timers.unregister(_remove)
