# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws into all 3D views by a handler that is there only while it is wanted."""

import bpy

from . import reasons


class ViewDrawing:
    """A draw handler. After the first refusal by the graphics driver it ends, and the panel says why."""

    def __init__(self, draw):
        """draw: a function of the context, which draws in pixels over a 3D view."""
        self._draw = draw
        self._handler = None

    def __bool__(self):
        """Whether the handler is there."""
        return self._handler is not None

    def show(self, wanted):
        """Adds the handler if it is wanted, and removes it otherwise."""
        if not wanted:
            self.end()
        elif not self:
            self._handler = bpy.types.SpaceView3D.draw_handler_add(self._call, (), "WINDOW", "POST_PIXEL")

    def end(self):
        if self:
            bpy.types.SpaceView3D.draw_handler_remove(self._handler, "WINDOW")
            self._handler = None

    def _call(self):
        try:
            self._draw(bpy.context)
        except (RuntimeError, SystemError) as error:
            reasons.broken[:] = [str(error)]
            bpy.app.timers.register(self.end, first_interval=0)
