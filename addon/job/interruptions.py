# SPDX-License-Identifier: GPL-3.0-or-later
"""The runs of operators that are under way while Blender goes on, and what the user does meanwhile that ends them."""

from bpy.app.handlers import persistent

from .. import handlers, status_bar
from . import refusals

# Only the main thread uses these.
runs = []  # each a Run (see run.py); more than one only until the next event, after Adjust Last Operation
to_say = []  # messages for the status bar, to be shown once the next file is open
_undone = 0  # how many steps were undone or redone
_edited = False  # whether Blender has reported a change of a run's mesh since the last call of take_edited()


def under_way():
    """Returns the run that goes on now, or None."""
    return runs[0] if runs else None


def take_edited():
    """Returns whether the mesh of a run was changed since the last call."""
    global _edited
    edited, _edited = _edited, False
    return edited


def undo_count():
    """Returns how many steps were undone or redone in this session."""
    return _undone


def _interrupt(happens):
    for run in runs:
        run.interrupt(happens)


@persistent
def _before_load(*_):
    _interrupt("another file was opened")
    refusals.forget_all()


@persistent
def _before_undo(*_):
    global _undone
    _undone += 1
    _interrupt("a step was undone")


@persistent
def _before_redo(*_):
    global _undone
    _undone += 1
    _interrupt("a step was redone")


@persistent
def _after_load(*_):
    for text in to_say:
        status_bar.say(text)
    to_say.clear()


@persistent
def _after_update(_scene, depsgraph):
    """Notes that something has changed, and whether it is a mesh that a run works on: it then looks what has changed."""
    global _edited
    for run in runs:
        run.something_else = True
    for update in depsgraph.updates:
        if update.is_updated_geometry and any(run.concerns(update.id.original) for run in runs):
            _edited = True


_HANDLERS = (
    ("depsgraph_update_post", _after_update),
    ("load_pre", _before_load),
    ("undo_pre", _before_undo),
    ("redo_pre", _before_redo),
    ("load_post", _after_load),
)


def register():
    handlers.add(_HANDLERS)


def unregister():
    handlers.remove(_HANDLERS)
