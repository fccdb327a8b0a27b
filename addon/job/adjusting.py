# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets Adjust Last Operation and Repeat Last show progress and take Esc.

Blender repeats an operator by execute() alone, which receives no events, and then stores an undo step if the operator makes
one. If the work takes longer than PATIENCE (run.py), execute() leaves the mesh as it was and hands its run over to a
helper: an operator that does receive events, and writes the outcome. The undo step of the helper replaces the one that
Blender has stored, so that there is one.
"""

import bpy

_handed_over = None  # the run that the next helper takes over
_classes = []  # the helpers


def hand_over(run):
    """Lets the run go on in the helper of its operator."""
    global _handed_over
    _handed_over = run
    getattr(bpy.ops.tolvol, _name(type(run.operator)))("INVOKE_DEFAULT")
    return {"FINISHED"}


class _GoOn:
    def invoke(self, context, _event):
        global _handed_over
        self._run, _handed_over = _handed_over, None
        self._run.voice = self
        return self._run.begin_modal(context, self)

    def modal(self, context, event):
        return self._run.on_event(context, event)

    def cancel(self, context):
        self._run.close(context)


def _name(cls):
    return f"go_on_{cls.bl_idname.removeprefix('tolvol.')}"


def _operators(base):
    """Yields the operators with this base class that Blender repeats."""
    for sub in base.__subclasses__():
        yield from _operators(sub)
        if issubclass(sub, bpy.types.Operator) and "REGISTER" in getattr(sub, "bl_options", ()):
            yield sub


def register(base):
    """Registers a helper for each operator with this base class that Blender repeats."""
    for cls in _operators(base):
        options = {"INTERNAL", "UNDO_GROUPED"} if "UNDO" in cls.bl_options else {"INTERNAL"}
        name, doc = _name(cls), f"Go on with {cls.bl_label} after Adjust Last Operation"
        about = {"bl_idname": f"tolvol.{name}", "bl_label": "Go On", "bl_undo_group": cls.bl_label, "__doc__": doc}
        about["bl_options"] = options
        _classes.append(type(f"TOLVOL_OT_{name}", (_GoOn, bpy.types.Operator), {"__module__": __name__, **about}))
        bpy.utils.register_class(_classes[-1])


def unregister():
    while _classes:
        bpy.utils.unregister_class(_classes.pop())
