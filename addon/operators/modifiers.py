# SPDX-License-Identifier: GPL-3.0-or-later
"""Which modifiers can be applied within the tolerance, and what the operators that do so share.

A modifier that only moves vertices is applied (apply_modifier.py), and each vertex stops at the tolerance. A modifier that
changes the faces is fitted (fit_modifier.py): it is applied with the setting that leaves the fewest triangles within the
tolerance, which a search finds.
"""

from ..job import JobOperator
from ..operation_settings import modifier_settings
from ..shared.errors import Refused
from . import fit
from . import settings as shared
from .blocked import allowed, decimate_blocked

FITTED = {"DECIMATE", "REMESH", "WELD"}
_CHANGING = {
    *("ARRAY", "BEVEL", "BOOLEAN", "BUILD", "EDGE_SPLIT", "MASK", "MIRROR", "MULTIRES", "PARTICLE_INSTANCE", "SCREW"),
    *("SKIN", "SOLIDIFY", "SUBSURF", "TRIANGULATE", "VOLUME_TO_MESH", "WIREFRAME"),
}
_SIMULATIONS = {
    *("CLOTH", "COLLISION", "DYNAMIC_PAINT", "EXPLODE", "FLUID", "OCEAN", "PARTICLE_SYSTEM", "SOFT_BODY", "SURFACE"),
}


def modifier_blocked(ob, modifier):
    """Why this modifier can neither be applied nor fitted, or None."""
    if modifier.type in FITTED:
        if ob.data.shape_keys:
            return f"{modifier.name} changes the faces: remove the shape keys first"
        return fit.fit_blocked(modifier)
    if modifier.type in _CHANGING:
        return "This modifier changes the faces and has no setting to fit"
    if modifier.type in _SIMULATIONS:
        return "A simulation cannot be applied within the tolerance"
    return None


class ModifierOperator(JobOperator):
    """The parts that both operators share: choosing a modifier of the active object, and storing the result."""

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        reason = decimate_blocked(ob)
        if not reason and not ob.modifiers:
            reason = f"{ob.name} has no modifiers"
        return allowed(cls, reason)

    def chosen(self, fitted):
        """Returns the chosen modifier. Settings that were not given to the operator are taken from the object."""
        ob = self.ob
        shared.take(self, ob.tolvol.modifiers, modifier_settings())
        if not self.modifier:
            suitable = [m for m in ob.modifiers if (m.type in FITTED) == fitted and not modifier_blocked(ob, m)]
            self.modifier = suitable[0].name if suitable else ""
        modifier = ob.modifiers.get(self.modifier)
        if modifier is None:
            raise Refused(f"{ob.name} has no modifier {self.modifier}".rstrip() + " that can be used here")
        if reason := modifier_blocked(ob, modifier):
            raise Refused(f"{modifier.name} of {ob.name}: {reason}")
        if (modifier.type in FITTED) != fitted:
            other = "use Fit instead of Apply" if modifier.type in FITTED else "use Apply instead of Fit"
            raise Refused(f"{modifier.name} of {ob.name}: {other}")
        return modifier

    def target(self, context):
        """Returns the object that gets the result, a copy if Result is New Object, and removes the modifier from it."""
        ob = self.ob
        if self.result == "OBJECT":
            copy = ob.copy()
            copy.data = ob.data.copy()
            for collection in ob.users_collection:
                collection.objects.link(copy)
            for other in context.selected_objects:
                other.select_set(False)
            copy.select_set(True)
            context.view_layer.objects.active = ob = copy
        ob.modifiers.remove(ob.modifiers[self.modifier])
        return ob
