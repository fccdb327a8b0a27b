# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds functions to Blender's lists of handlers and removes them: pairs (name in bpy.app.handlers, function)."""

import bpy


def add(pairs):
    for name, handler in pairs:
        getattr(bpy.app.handlers, name).append(handler)


def remove(pairs):
    for name, handler in reversed(pairs):
        getattr(bpy.app.handlers, name).remove(handler)
