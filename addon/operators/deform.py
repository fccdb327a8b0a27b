# SPDX-License-Identifier: GPL-3.0-or-later
"""Deforms a mesh by a Lattice object within the tolerance."""

from functools import partial

import bpy
import numpy as np
from bpy.props import StringProperty

from .. import native, preferences
from ..job import WRITE, JobOperator
from ..mesh import mesh_io
from ..operation_settings import threads_setting
from ..proof import kept_warnings
from ..properties import deform_mode_setting
from ..shared.errors import Refused
from .blocked import allowed, decimate_blocked
from .motion import Motion

# What faces would do that stop a deformation, by the entry of the report.
_WOULD = {"leaving": "leave the tolerance", "turning": "turn away from the reference", "crossing": "cross others"}


def _permitted(share):
    """Returns what can be done about the whole deformation. A share below 0.1 % would be shown as none."""
    if share < 0.001:
        return "Hardly any of the way is permitted: "
    return f"{100 * share:.1f} % of the way is permitted: choose As Far as Permitted, or "


class TOLVOL_OT_deform(JobOperator, bpy.types.Operator):
    """Deform the mesh by a lattice, as a B-spline of degree 3, within the tolerance of the reference. Vertices outside \
the lattice stay. An object without a reference gets one first, as by Set Reference"""

    bl_idname = "tolvol.deform"
    bl_label = "Deform in Tolerance"
    bl_options = {"REGISTER", "UNDO"}

    lattice: StringProperty(
        name="Lattice",
        description="The lattice object. If none is given, the one of the panel is used, or else the selected one",
        options={"SKIP_SAVE"},
    )
    mode: deform_mode_setting(options={"SKIP_SAVE"})
    threads: threads_setting()

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        # A script may name any lattice of the file in the call, so that none needs to be chosen.
        return allowed(
            cls, decimate_blocked(ob) or (None if bpy.data.lattices else "Add a lattice first: Add > Lattice")
        )

    def draw(self, _context):
        self.layout.use_property_split = True
        self.layout.prop_search(self, "lattice", bpy.data, "objects")
        self.layout.prop(self, "mode")

    def steps(self, context):
        context.view_layer.update()
        ob = self.ob
        cage = self._chosen(context)
        self.lattice = cage.name
        if not self.properties.is_property_set("mode"):
            self.mode = ob.tolvol.deform_mode
        motion = yield from Motion.of(ob, self.threads or preferences.threads(context))
        lattice, mode = native_lattice(cage), self.mode.lower()

        def deform(faces, progress):
            return native.module.deform(
                motion.before,
                lattice,
                faces,
                motion.volume(progress),
                to_world=motion.surface.matrix,
                mode=mode,
                two_sided=motion.two_sided,
                crossings=motion.crossings,
                threads=motion.threads,
                progress=progress,
            )

        try:
            result = yield partial(deform, motion.faces)
        except native.module.InvalidInput as error:
            # A bent quad may be beyond the tolerance from the start in the triangulation that Blender does not show.
            shown = motion.surface.arrays.triangles
            if motion.faces is shown or not native.says_outside(error):
                raise
            result = yield partial(deform, shown)
        run = result.report
        self._require_motion(run)
        vertices, certified = yield from motion.settle(result.vertices, may_hold=self.mode == "PULL_BACK")
        if np.array_equal(vertices, motion.before):
            raise Refused(f"{self.lattice} does not move {ob.name}: the tolerance permits no movement")
        yield WRITE
        ob = self.ob
        motion.write(ob, vertices, certified, "deform")
        ob.tolvol.lattice, ob.tolvol.deform_mode = bpy.data.objects[self.lattice], self.mode
        warnings = [*run["warnings"], *_twice(ob)]
        kept_warnings.keep(ob, warnings)
        for warning in warnings:
            self.say({"WARNING"}, warning)
        remarks = [*motion.moved(vertices, vertices), *_remarks(run)]
        if bent := int((vertices != result.vertices).any(1).sum()):
            remarks.append(f"{bent:,} held back because Blender would cut their faces otherwise")
        self.say({"INFO"}, motion.line(remarks, certified))

    def _require_motion(self, run):
        """Raises Refused if the deformation moves no vertex."""
        name, stopped = self.ob.name, _stopped(run)
        if self.mode == "BLOCKED" and stopped:
            why, count = stopped
            raise Refused(
                f"{count:,} faces of {name} would {_WOULD[why]}. "
                f"{_permitted(run['permitted_fraction'])}choose Pull Back to hold back only the vertices of these faces"
            )
        if not run["moved"]:
            why = (
                "the tolerance permits no movement, or faces would turn over or cross"
                if stopped
                else "the lattice is at rest, or the mesh is outside it"
            )
            raise Refused(f"{self.lattice} does not move {name}: {why}")

    def _chosen(self, context):
        selected = [ob for ob in context.selected_objects if ob.type == "LATTICE"]
        if self.properties.is_property_set("lattice"):
            chosen = bpy.data.objects.get(self.lattice)
        else:
            chosen = self.ob.tolvol.lattice or (selected[0] if len(selected) == 1 else None)
        if chosen is None or chosen.type != "LATTICE":
            raise Refused(f"{self.lattice or self.ob.name}: choose a lattice object, or select one with the mesh")
        return chosen


def _stopped(run):
    """Returns what stopped the deformation and the number of faces that do it, or None."""
    return next(((why, run[why]["faces"]) for why in _WOULD if run[why]["faces"]), None)


def native_lattice(cage):
    """Returns the tolvol.Lattice of a Lattice object, in world coordinates."""
    data = cage.data
    shape = (data.points_u, data.points_v, data.points_w)
    # Blender's array of control points runs along u first. The undeformed control points are a regular grid.
    rest, now = (
        mesh_io.column(data.points, name, 3).astype(np.float64).reshape(*shape[::-1], 3).transpose(2, 1, 0, 3)
        for name in ("co", "co_deform")
    )
    box = np.diag([*(rest[-1, -1, -1] - rest[0, 0, 0]), 1.0])
    box[:3, 3] = rest[0, 0, 0]
    matrix = mesh_io.matrix_array(cage.matrix_world)
    try:
        # Adding the offset to the native control point at rest keeps a point that was not moved exactly at rest. A vertex
        # with only such points around it then stays bit for bit.
        points = native.module.lattice_points(shape, matrix @ box) + (now - rest) @ matrix[:3, :3].T
        return native.module.Lattice(points, matrix @ box)
    except native.module.TolvolError as error:
        raise Refused(f"{cage.name}: {error}") from None


def _twice(ob):
    """Yields a warning for each modifier that deforms the mesh by the same lattice once more."""
    for modifier in ob.modifiers:
        if modifier.type == "LATTICE" and modifier.object == ob.tolvol.lattice:
            yield (
                f"The modifier {modifier.name} of {ob.name} deforms the mesh by {modifier.object.name} again: remove it"
            )


def _remarks(run):
    remarks = []
    if _stopped(run):
        if run["permitted_fraction"] is None:
            remarks.append(f"{run['held_back']:,} held back")
            if run["kept_from_crossing"]:
                remarks.append(f"{run['kept_from_crossing']:,} of them so that no faces cross")
        else:
            remarks.append(f"{100 * run['permitted_fraction']:.1f} % of the way")
    if run["outside_lattice"]:
        remarks.append(f"{run['outside_lattice']:,} are outside the lattice")
    return remarks
