# SPDX-License-Identifier: GPL-3.0-or-later
"""Guards keep a mesh within the tolerance while Blender's own tools sculpt, edit or deform it.

Blender's brushes call no add-on. But after each dab and each step of a transform Blender evaluates the scene and calls
depsgraph_update_post before it draws, and the guards work in that handler.
"""

import time

import bpy
from bpy.app.handlers import persistent

from .. import handlers, status_bar
from . import edit, lattice, sculpt, undo

# Setting of Object.tolvol.guard -> the module that does it. Each has wanted(ob), blocked(ob),
# follow(ob, restored, depsgraph), rest(ob) and watches.
MODULES = {"sculpting": sculpt, "editing": edit, "lattice": lattice}

_TICK = 0.1

_restored = None  # "undo" or "redo" until the guards have looked at the mesh that it brought back


def states(ob):
    """Yields (setting, text, on) for each guard of `ob` that is switched on.

    on: whether it guards the mesh now; None while there is nothing to guard or the guard is being prepared.
    """
    for setting, module in MODULES.items():
        if getattr(ob.tolvol.guard, setting):
            yield setting, *_state(ob, module)


def _state(ob, module):
    watch = module.watches.shown(ob)
    if reason := module.blocked(ob):
        return reason, False
    if watch is None:
        return None, None
    if watch.on:
        return watch.said() or f"Guarding {'both ways' if watch.two_sided else 'one way'}", True
    return (watch.reason, False) if watch.reason else ("The guard is being prepared", None)


@persistent
def _after_update(_scene, depsgraph):
    global _restored
    _sweep()
    objects = [update.id.original for update in depsgraph.updates if isinstance(update.id, bpy.types.Object)]
    followed = False
    for ob in objects:
        if ob.type == "MESH":
            for module in MODULES.values():
                followed |= _follow(module, ob, depsgraph)
    if followed:
        _restored = None


def _follow(module, ob, depsgraph):
    if not module.wanted(ob):
        return False
    if module.blocked(ob):
        module.watches.drop(ob.name)
        return False
    module.follow(ob, _restored, depsgraph)
    _redraw_panels()
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_TICK)
    return True


def _sweep():
    """Drops watches that are no longer wanted: the mode or the setting changed, or the object was removed or renamed."""
    for module in MODULES.values():
        for name, _ in module.watches:
            ob = bpy.data.objects.get(name)
            if ob is None or ob.type != "MESH" or not module.wanted(ob):
                module.watches.drop(name)


def _tick():
    """A timer for work that cannot be done in a handler. Returns the seconds to its next call, None to end the timer."""
    _sweep()
    busy = undo.expect()
    for module in MODULES.values():
        for name, watch in module.watches:
            busy |= _look_after(module, bpy.data.objects[name], watch)
    return _TICK if busy else None


def _look_after(module, ob, watch):
    """Whether the timer has to call again for this watch."""
    if watch.preparing:
        if watch.settled():
            _follow(module, ob, bpy.context.evaluated_depsgraph_get())
        return True
    if watch.rest_at is None:
        return False
    if time.monotonic() > watch.rest_at:
        watch.rest_at = None
        if said := watch.said():
            status_bar.say(f"{ob.name}: {said}")
        module.rest(ob)
    return True


def _redraw_panels():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions:
                if area.type == "VIEW_3D" and region.type == "UI":
                    region.tag_redraw()


@persistent
def _before_undo(*_):
    global _restored
    _restored = "undo"


@persistent
def _before_redo(*_):
    global _restored
    _restored = "redo"


@persistent
def _forget(*_):
    global _restored
    _restored = None
    for module in MODULES.values():
        for name, _ in module.watches:
            module.watches.drop(name)


_HANDLERS = (
    ("depsgraph_update_post", _after_update),
    ("undo_pre", _before_undo),
    ("redo_pre", _before_redo),
    ("load_pre", _forget),
)


def register():
    undo.register()
    handlers.add(_HANDLERS)


def unregister():
    handlers.remove(_HANDLERS)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _forget()
    undo.unregister()
