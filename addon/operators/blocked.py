# SPDX-License-Identifier: GPL-3.0-or-later
"""Says why an operator cannot run on an object, for the panel, the tooltip of the greyed button, and scripts."""

from .. import native
from ..reference import snapshots

_OBJECT_MODE = {"OBJECT"}


def settings_blocked(ob):
    """Why the settings of `ob` cannot be changed, or None."""
    if native.module is None:
        return native.reason
    if ob is None or ob.type != "MESH":
        return "Select a mesh object"
    if ob.library is not None or ob.override_library is not None:
        return f"{ob.name} is linked from another file: Object > Relations > Make Local > All"
    return None


def object_blocked(ob, modes=_OBJECT_MODE):
    """Why no operator can run on `ob` now, or None. modes: Blender's modes in which the operator can run."""
    if reason := settings_blocked(ob):
        return reason
    if not ob.matrix_world.determinant():
        return f"{ob.name} has no extent along an axis: Object > Clear > Scale"
    if ob.mode not in modes:
        return "Switch to Object Mode"
    return None


def reference_blocked(ob, modes=_OBJECT_MODE):
    """Why no reference can be set for `ob` now, or None."""
    if reason := object_blocked(ob, modes):
        return reason
    source = snapshots.source_object(ob)
    if source is None:
        return "Choose the reference object"
    if source.type != "MESH":
        return f"{source.name} is not a mesh: Object > Convert > Mesh"
    if not source.data.polygons:
        return f"{source.name} has no faces"
    return None


def check_blocked(ob, modes=_OBJECT_MODE):
    """Why `ob` cannot be compared with its reference now, or None."""
    if reason := object_blocked(ob, modes):
        return reason
    if ob.tolvol.snapshot is None and (reason := reference_blocked(ob, modes)):
        return reason  # Otherwise the message would name Set Reference, which is greyed.
    if reason := snapshots.reference_missing(ob):
        return reason
    if not ob.data.polygons:
        return f"{ob.name} has no faces"
    return None


def mesh_blocked(ob, modes=_OBJECT_MODE):
    """Why the mesh of `ob` cannot be replaced now, or None."""
    if reason := object_blocked(ob, modes):
        return reason
    mesh = ob.data
    if mesh.library is not None or mesh.override_library is not None:
        return f"The mesh {mesh.name} is linked from another file: Object > Relations > Make Local > All"
    users = mesh.users - mesh.use_fake_user
    if users > 1:
        # The number comes first: one line of a narrow panel shows no more than the beginning.
        return f"{users} users share the mesh {mesh.name}: Object > Relations > Make Single User > Object & Data"
    return None


def decimate_blocked(ob, modes=_OBJECT_MODE):
    """Why the mesh of `ob` cannot be changed within the tolerance now, or None."""
    return mesh_blocked(ob, modes) or surface_blocked(ob, modes)


def surface_blocked(ob, modes=_OBJECT_MODE):
    """Why no new mesh can be made of the mesh of `ob` within the tolerance now, or None."""
    if reason := object_blocked(ob, modes):
        return reason
    if not ob.data.polygons:
        return f"{ob.name} has no faces"
    if any(modifier.type == "MULTIRES" for modifier in ob.modifiers):
        return "Apply the Multiresolution modifier first"
    return (check_blocked if ob.tolvol.snapshot else reference_blocked)(ob, modes)


def allowed(cls, reason):
    """Returns the result of an operator's poll(). If there is a reason, the result is False, and the tooltip shows it."""
    if reason:
        cls.poll_message_set(reason)
    return not reason
