# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets Adjust Last Operation and Repeat Last show progress and take Esc.

Blender repeats an operator by execute() alone, which receives no events, and then stores an undo step. If the work takes
longer than that, execute() therefore leaves the mesh as it was and hands its run over to another operator, which does
receive events. What this one writes replaces the undo step, so that there is one.
"""

import bpy

_handed_over = None  # the run that the next operator takes over
_classes = []


def hand_over(run):
    """Lets the run go on in an operator of its own."""
    global _handed_over
    _handed_over = run
    getattr(bpy.ops.tolvol, _name(type(run.operator)))("INVOKE_DEFAULT")
    return {"FINISHED"}


class _GoOn:
    bl_options = {"INTERNAL", "UNDO_GROUPED"}

    def invoke(self, context, _event):
        global _handed_over
        self._run, _handed_over = _handed_over, None
        self._run.operator.voice = self
        return self._run.begin_modal(context, self)

    def modal(self, context, event):
        return self._run.on_event(context, event)

    def cancel(self, context):
        self._run.close(context)


def _name(cls):
    return f"go_on_{cls.bl_idname.removeprefix('tolvol.')}"


def _operators(base):
    """Yields the operators with this base class that Adjust Last Operation offers."""
    for sub in base.__subclasses__():
        yield from _operators(sub)
        if issubclass(sub, bpy.types.Operator) and "UNDO" in getattr(sub, "bl_options", ()):
            yield sub


def register(base):
    """Registers an operator for each of those with this base class."""
    for cls in _operators(base):
        name, doc = _name(cls), f"Go on with {cls.bl_label} after Adjust Last Operation"
        about = {"bl_idname": f"tolvol.{name}", "bl_label": "Go On", "bl_undo_group": cls.bl_label, "__doc__": doc}
        _classes.append(type(f"TOLVOL_OT_{name}", (_GoOn, bpy.types.Operator), {"__module__": __name__, **about}))
        bpy.utils.register_class(_classes[-1])


def unregister():
    while _classes:
        bpy.utils.unregister_class(_classes.pop())
