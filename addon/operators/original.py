# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the original while a key or a button is held, brings it back, or makes an object of it.

The original is the mesh of the reference as it was when the reference was set (reference/originals.py).
"""

import contextlib

import bpy
from bpy.app.handlers import persistent
from bpy.props import BoolProperty
from mathutils import Matrix

from .. import status_bar
from ..proof import last_run
from ..reference import instances, originals, snapshots
from .asking import ask
from .blocked import allowed, mesh_blocked, object_blocked

_SHOWN_IN = {"OBJECT", "SCULPT"}
# While the original is shown, these events go on to Blender, so that the view can be turned and moved.
OF_THE_VIEW = {
    *("MIDDLEMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE", "TRACKPADPAN", "TRACKPADZOOM", "MOUSEROTATE", "MOUSESMARTZOOM"),
    *("LEFT_SHIFT", "RIGHT_SHIFT", "LEFT_CTRL", "RIGHT_CTRL"),
}
_KEY = "Y"  # Blender uses it neither in Object Mode nor in Sculpt Mode.


def _blocked(ob, modes):
    """Why there is no original of `ob` to be shown or taken, or None."""
    if reason := object_blocked(ob, modes):
        return reason
    if ob.tolvol.snapshot is None:
        return "Set the reference first"
    if not originals.kept(ob).polygons:
        return "The snapshot in the file is damaged"
    return None


def restore_blocked(ob):
    """Why the original cannot replace the mesh of `ob`, or None."""
    if reason := _blocked(ob, {"OBJECT"}) or mesh_blocked(ob):
        return reason
    if ob.tolvol.snapshot_kind != "SELF":
        return "The reference is the mesh of another object: take Original as New Object"
    if ob.tolvol.original is None:
        return "An earlier version kept only the shape of this reference: take Original as New Object"
    return None


def twin_of(ob, mesh):
    """Returns a new object with `mesh` at the place of the reference of `ob`, in no collection yet.

    If the reference is the object's own mesh, the new object has the object's modifiers and materials, too.
    """
    if ob.tolvol.snapshot_kind == "SELF":
        twin = ob.copy()
        twin.data = mesh
        twin.property_unset("tolvol")
    else:
        twin = bpy.data.objects.new(f"{ob.name} original", mesh)
        twin.matrix_world = Matrix(snapshots.reference_matrix(ob))
    return twin


def _link(context, ob, twin):
    collection = next((found for found in ob.users_collection if found.library is None), context.scene.collection)
    collection.objects.link(twin)
    space = context.space_data
    if space is not None and space.type == "VIEW_3D" and space.local_view:
        twin.local_view_set(space, True)


class _Shown:
    """Shows the original of an object in its place until end() is called. What is saved meanwhile is the object."""

    def __init__(self, context, ob):
        self.ob = ob
        self._was_hidden, self._was_selected = ob.hide_get(), ob.select_get()
        self.twin = twin_of(ob, originals.kept(ob))
        self.twin.name = f".{ob.name} original"
        self.twin[instances.SHOWN] = True
        _link(context, ob, self.twin)
        ob.hide_set(True)
        for handlers in _handlers():
            handlers.append(_end_before)

    def end(self):
        for handlers in _handlers():
            if _end_before in handlers:
                handlers.remove(_end_before)
        for act in (self._remove, self._bring_back):
            with contextlib.suppress(ReferenceError):  # The object may have been removed meanwhile.
                act()

    def _remove(self):
        bpy.data.objects.remove(self.twin)

    def _bring_back(self):
        self.ob.hide_set(self._was_hidden)
        self.ob.select_set(self._was_selected)


_shown = []  # at most one _Shown


def shown():
    """Whether an original is shown now."""
    return bool(_shown)


def active(context):
    """Returns the active object also while its original is shown: in Object Mode Blender counts no hidden object as active."""
    return context.active_object or (_shown[0].ob if _shown else None)


def stand_in():
    """Returns the object that shows the original now, or None. It is no object of the user's."""
    return _shown[0].twin if _shown else None


def _end():
    while _shown:
        _shown.pop().end()


@persistent
def _end_before(*_):
    """Called before a file is saved or opened, or a step is undone: the stored file has the object itself."""
    _end()


def _handlers():
    handlers = bpy.app.handlers
    return handlers.save_pre, handlers.load_pre, handlers.undo_pre, handlers.redo_pre


class TOLVOL_OT_show_original(bpy.types.Operator):
    """Show the mesh as it was when the reference was set, as long as the key or the mouse button is held. Nothing is \
changed. The view can be turned meanwhile"""

    bl_idname = "tolvol.show_original"
    bl_label = "Show Original"

    @classmethod
    def poll(cls, context):
        return allowed(cls, _blocked(context.active_object, _SHOWN_IN))

    def execute(self, _context):
        self.report({"ERROR"}, "Show Original needs a key or a mouse button that is held")
        return {"CANCELLED"}

    def invoke(self, context, event):
        if event.value != "PRESS":  # Blender sets the property of the button once more when it is released.
            return {"CANCELLED"}
        _end()
        self._held = event.type
        ob = context.active_object
        _shown.append(_Shown(context, ob))
        status_bar.show(f"The original of {ob.name}")
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type in OF_THE_VIEW:
            return {"PASS_THROUGH"}
        held = event.type == self._held
        over = held and event.value == "RELEASE" or not held and event.value == "PRESS"
        if over or not _shown:
            self.cancel(context)
            # The button in the sidebar waits for the release, too.
            return {"FINISHED", "PASS_THROUGH"}
        return {"RUNNING_MODAL"}

    def cancel(self, _context):
        _end()
        status_bar.clear()


class TOLVOL_OT_restore_original(bpy.types.Operator):
    """Bring the mesh back as it was when the reference was set, with its UV maps, materials, vertex groups, shape keys and \
normals. The present mesh and all edits of it are discarded, after a question"""

    bl_idname = "tolvol.restore_original"
    bl_label = "Restore Original"
    bl_options = {"REGISTER", "UNDO"}

    sure: BoolProperty(
        name="Sure",
        description="Discard the present mesh without asking",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        return allowed(cls, restore_blocked(context.active_object))

    def invoke(self, context, _event):
        if self.sure:
            return self.execute(context)
        ob = context.active_object
        original = ob.tolvol.original
        lines = [
            f"The present mesh of {len(ob.data.polygons):,} faces and all edits of it are discarded.",
            f"The original of {len(original.polygons):,} faces comes back{originals.with_its_data(original)}.",
        ]

        def draw_entry(layout):
            layout.operator(self.bl_idname, text="Restore Original", icon="LOOP_BACK").sure = True

        ask(context, f"Restore the original of {ob.name}?", lines, draw_entry)
        return {"CANCELLED"}

    def execute(self, context):
        ob = context.active_object
        before, mesh = ob.data, ob.tolvol.original.copy()
        name, mesh.use_fake_user = before.name, before.use_fake_user
        ob.data = mesh
        bpy.data.meshes.remove(before)  # mesh_blocked() has seen to it that no other object has this mesh.
        mesh.name = name
        ob.tolvol.warnings = ""
        last_run.clear(ob)
        snapshots.notify()
        self.report({"INFO"}, f"{ob.name} is the original again: {len(mesh.polygons):,} faces")
        return {"FINISHED"}


class TOLVOL_OT_new_original(bpy.types.Operator):
    """Make a new object of the mesh as it was when the reference was set. The present object stays as it is"""

    bl_idname = "tolvol.new_original"
    bl_label = "Original as New Object"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return allowed(cls, _blocked(context.active_object, {"OBJECT"}))

    def execute(self, context):
        ob = context.active_object
        mesh = originals.kept(ob).copy()
        mesh.name = f"{ob.name} original"
        twin = twin_of(ob, mesh)
        twin.name = f"{ob.name} original"
        _link(context, ob, twin)
        for other in context.selected_objects:
            other.select_set(False)
        twin.select_set(True)
        context.view_layer.objects.active = twin
        only_shape = "" if ob.tolvol.original else ", of which an earlier version kept only the shape"
        self.report({"INFO"}, f"{twin.name} is the original of {ob.name}{only_shape}")
        return {"FINISHED"}


def _hold(_manager, held):
    if held and TOLVOL_OT_show_original.poll(bpy.context):
        bpy.ops.tolvol.show_original("INVOKE_DEFAULT")


_keys = []


def register():
    # A property of the window manager is neither saved nor part of an undo step. Its button acts when it is pressed; the
    # button of an operator acts only when it is released.
    bpy.types.WindowManager.tolvol_show_original = BoolProperty(
        name="Show Original",
        description="Show the mesh as it was when the reference was set, as long as the mouse button is held here, or the "
        f"key {_KEY} over the 3D view. Nothing is changed. The view can be turned meanwhile",
        get=lambda _manager: shown(),
        set=_hold,
        options={"SKIP_SAVE"},
    )
    keymaps = bpy.context.window_manager.keyconfigs.addon
    if keymaps is not None:  # Blender without a window has none.
        keymap = keymaps.keymaps.new("3D View", space_type="VIEW_3D")
        _keys.append((keymap, keymap.keymap_items.new(TOLVOL_OT_show_original.bl_idname, _KEY, "PRESS")))


def unregister():
    _end()
    for keymap, item in _keys:
        keymap.keymap_items.remove(item)
    _keys.clear()
    del bpy.types.WindowManager.tolvol_show_original
