# SPDX-License-Identifier: GPL-3.0-or-later
"""Goes through the places where the mesh and its reference are farthest from each other."""

import bpy
from bpy.props import BoolProperty
from bpy_extras.view3d_utils import region_2d_to_location_3d
from mathutils import Vector

from ..overlay import legend
from ..proof import places
from ..reference import snapshots
from .blocked import allowed
from .check import Comparison

# The eye is so many radii of a place away from it, or more: what is around has to be seen, too.
_AROUND = 3.0
# The eye is never nearer than the first share of the size of the reference, and never farther than the second one: a region
# may be most of the mesh.
_LEAST, _MOST = 0.3, 0.7
# The view is turned unless the surface at the place looks at the eye at least so much (a cosine).
_FACING = 0.3
_CLEAR = 24  # pixels at an interface scale of 1 around a place that the legend leaves free


def _frame(context, ob):
    """Turns and moves the 3D view so that the present place is in its middle."""
    space = context.space_data
    if space is None or space.type != "VIEW_3D" or space.region_3d is None:
        return
    found, at, _ = places.shown(ob)
    place, view = found[at], space.region_3d
    if view.view_perspective == "CAMERA":
        view.view_perspective = "PERSP"
    normal = Vector(place.normal)
    towards = view.view_rotation @ Vector((0, 0, 1))
    if normal.length and not view.lock_rotation and normal.dot(towards) < _FACING:
        view.view_rotation = normal.to_track_quat("Z", "Y")
    view.view_location = Vector(place.position)
    size = snapshots.snapshot_size(ob)
    view.view_distance = min(max(_AROUND * place.radius, _LEAST * size), _MOST * size)
    regions = [each for each in context.area.regions if each.type == "WINDOW"] if context.area else []
    if len(regions) == 1:  # In a quad view, each region looks in another direction.
        _move_from_legend(context, regions[0], view)


def _move_from_legend(context, region, view):
    """Moves what is in the middle of the 3D view beside the legend, if the legend lies there."""
    box = legend.box(region)
    middle = Vector((region.width / 2, region.height / 2))
    if box is None or not legend.reaches(box, middle, _CLEAR * context.preferences.system.ui_scale):
        return
    left, right, _ = legend.free_part(context, region)
    before, after = (left + box[0]) / 2, (box[0] + box[2] + right) / 2
    beside = Vector((before if box[0] - left >= right - box[0] - box[2] else after, middle.y))
    view.update()
    view.view_location += view.view_location - region_2d_to_location_3d(region, view, beside, view.view_location)


class TOLVOL_OT_worst_point(Comparison, bpy.types.Operator):
    """Measure as Check does, mark the places where the mesh or the reference is beyond the tolerance, or else nearest to it, \
and bring the one with the largest distance into view"""

    bl_idname = "tolvol.worst_point"
    bl_label = "Worst Point"
    bl_options = {"REGISTER"}

    def compare(self, surface, reference, tolerance, threads, progress):
        found = self.judge(surface, reference, tolerance, threads, progress)
        return surface, found, places.find(surface, reference, found, threads, progress)

    def finish(self, context, outcome):
        surface, found, (of_mesh, regions) = outcome
        self.remember(surface, found)
        places.show(self.ob, of_mesh, regions)
        _frame(context, self.ob)
        self.say(
            {"INFO" if found.passed else "WARNING"}, f"{found.word}: {'. '.join(places.described(context, self.ob))}"
        )


class TOLVOL_OT_next_place(bpy.types.Operator):
    """Bring the next of the marked places into view, in the order of their distances"""

    bl_idname = "tolvol.next_place"
    bl_label = "Go to Place"

    back: BoolProperty(name="Back", description="Go to the previous place", options={"SKIP_SAVE"})

    @classmethod
    def description(cls, _context, properties):
        which = "previous" if properties.back else "next"
        return f"Bring the {which} of the marked places into view, in the order of their distances"

    @classmethod
    def poll(cls, context):
        return allowed(cls, None if places.shown(context.active_object)[0] else "Press Worst Point first")

    def execute(self, context):
        places.step(-1 if self.back else 1)
        _frame(context, context.active_object)
        self.report({"INFO"}, ". ".join(places.described(context, context.active_object)))
        return {"FINISHED"}


class TOLVOL_OT_clear_places(bpy.types.Operator):
    """Remove the marks of the places from the 3D view"""

    bl_idname = "tolvol.clear_places"
    bl_label = "Clear Places"

    @classmethod
    def poll(cls, context):
        return allowed(cls, None if places.shown(context.active_object)[0] else "No places are marked")

    def execute(self, _context):
        places.forget()
        return {"FINISHED"}
