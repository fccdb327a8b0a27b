# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets Adjust Last Operation and Repeat Last show progress and take Esc.

Blender repeats an operator by execute() alone, which receives no events, and then stores an undo step if the operator makes
one. If the work takes longer than PATIENCE (run.py), execute() leaves the mesh as it was and hands its run over to a
helper: an operator that does receive events. Once the outcome is there, the helper has Blender repeat the operator again,
and this time execute() writes the outcome: so there is one undo step, and the panel of Adjust Last Operation stays.

If something else has happened meanwhile, that would be undone, too. Then the helper itself writes the outcome, and its
undo step replaces the one that Blender has stored if no other has followed. Blender closes the panel at that. So it is
after Fit, too, whose new mesh would be lost with the step that is undone.
"""

import functools

import bpy

_handed_over = None  # the run that the next helper takes over
_classes = []  # the helpers


def hand_over(run):
    """Lets the run go on in the helper of its operator."""
    global _handed_over
    _handed_over = run
    getattr(bpy.ops.tolvol, _name(type(run.operator)))("INVOKE_DEFAULT")
    return {"FINISHED"}


def _rewind(run):
    """Has Blender undo the step of the operator of the run and repeat it, so that it writes. Returns whether it has done so."""
    bpy.context.view_layer.update()  # Blender may not have reported the last change yet.
    if run.something_else or not _is_last(run.operator) or not bpy.ops.ed.undo_redo.poll():
        return False
    run.rewinding = True
    try:
        bpy.ops.ed.undo_redo("EXEC_DEFAULT", True)  # True: with an undo step
    finally:
        run.rewinding = False
    return run.has_written


def _is_last(operator):
    """Whether Adjust Last Operation would repeat this operator."""
    adjustable = (each for each in bpy.context.window_manager.operators if {"REGISTER", "UNDO"} <= each.bl_options)
    last = next(reversed([*adjustable]), None)
    return last is not None and last.as_pointer() == operator.as_pointer()


class _GoOn:
    def invoke(self, context, _event):
        global _handed_over
        self._run, _handed_over = _handed_over, None
        self._run.voice = self
        self._run.before_writing = functools.partial(_rewind, self._run)
        context.window_manager.modal_handler_add(self)
        return self._run.begin_modal(context)

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
