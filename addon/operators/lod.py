# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a chain of levels of detail. Each level is decimated from the original, never from another level, and proved against
the reference in both directions."""

import contextlib
import math
from dataclasses import replace

import bpy
from bpy.props import IntProperty

from .. import preferences
from ..files.gltf_extras import GEOMETRIC_ERROR
from ..job import WRITE, JobOperator, breathe
from ..mesh import mesh_io, transfer
from ..operation_settings import lod_settings, threads_setting
from ..proof import verdict
from ..properties import automatic_placement
from ..reference import originals, snapshots, tolerances
from ..shared.decimation import seen_as
from ..shared.errors import Refused
from ..shared.numbers import shortest, three_digits
from ..shared.proof import report
from ..units import length, typed
from . import decimation
from . import settings as shared
from .blocked import allowed, surface_blocked
from .original import twin_of

# A level by count may deviate by at most this share of the size.
_WIDEST = 0.1


def draw_lod_settings(layout, settings):
    """Draws the settings of the levels, for the panel and for Adjust Last Operation."""
    layout.prop(settings, "by")
    layout.prop(settings, "levels")
    if settings.by == "TOLERANCE":
        layout.prop(settings, "in_length")
        vector = "lengths" if settings.in_length else "percentages"
    else:
        vector = {"COUNT": "counts", "PIXELS": "pixels"}[settings.by]
    if settings.by == "PIXELS":
        column = layout.column(align=True)
        for name in ("distance", "fov", "height"):
            column.prop(settings, name)
    column = layout.column(align=True)
    for i in range(settings.levels):
        unit = " %" if vector == "percentages" else ""
        column.prop(settings, vector, index=i, text=f"LOD{i + 1}{unit}")


class TOLVOL_OT_make_lods(JobOperator, bpy.types.Operator):
    """Make 2 to 6 levels of detail as new objects in a collection. Each is decimated from the original with the settings of \
Decimate, and proved both ways. Its custom property geometricError is its deviation"""

    bl_idname = "tolvol.make_lods"
    bl_label = "Make LOD Chain"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = lod_settings({"SKIP_SAVE"})
    threads: threads_setting()

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        return allowed(cls, surface_blocked(ob if ob is None else chain(ob)[0]))

    def targets(self, context):
        return chain(context.active_object)[:1]

    def draw(self, _context):
        self.layout.use_property_split = True
        draw_lod_settings(self.layout, self)

    def steps(self, context):
        context.view_layer.update()
        shared.take(self, self.ob.tolvol.lod, lod_settings())
        names = [(f"Level {i + 1} of {self.levels}", f"Level {i + 1}") for i in range(self.levels)]
        outcomes = yield from self.each((yield from self._tasks(context)), names)
        with contextlib.ExitStack() as stack:
            writes = yield from decimation.prepared(self, stack, lambda: self._writes(outcomes))
            yield WRITE
            self._write(context, outcomes, writes)

    def _tasks(self, context):
        """A generator for steps(): returns the Task of each level."""
        ob = self.ob
        # If the object is moved while its meshes are read, they belong together all the same.
        reference, matrix = snapshots.reference_of(ob), mesh_io.matrix_array(ob.matrix_world)
        yield breathe
        limits = self._limits(context, reference.size())
        if self.by == "TOLERANCE":  # Choosing the other unit in Adjust Last Operation then keeps the tolerances.
            tolerances.convert_levels(self, reference.size(), "PERCENT" if self.in_length else "LENGTH")
        with _original(ob) as original:
            settings = ob.tolvol
            chosen = settings.placement_choice >= 0
            placement = settings.placement if chosen else automatic_placement(original.data)
            asked = decimation.options(settings, placement, self.threads or preferences.threads(context))
            asked |= {"two_sided": True, "target_triangles": None, "outside": "error"}
            surface, tasks = replace(snapshots.surface_of(original), matrix=matrix), []
            for limit in limits:
                yield breathe
                tasks.append(decimation.task(original, surface, reference, limit, settings, dict(asked)))
        if self.by == "COUNT":
            triangles = len(tasks[0].surface.arrays.triangles)
            for i, (task, count) in enumerate(zip(tasks, self.counts)):
                if count >= triangles:
                    raise Refused(f"Level {i + 1}: {count:,} triangles, but {ob.name} has {triangles:,}")
                task.options["target_triangles"] = count
        return tasks

    def _limits(self, context, size):
        """Returns the tolerance of each level as a length. Raises Refused, which names the level, for levels out of order."""
        if self.by == "COUNT":
            _require_order(self.counts[: self.levels], lambda count: f"{count:,} triangles", falling=True)
            return [_WIDEST * size] * self.levels
        if self.by == "PIXELS":
            pixels = [shortest(value) for value in self.pixels[: self.levels]]
            _require_order(pixels, lambda value: f"{value:g} pixels")
            distance, fov = typed(self.distance, context.scene.unit_settings), round(math.degrees(self.fov), 4)
            limits = [seen_as(value, distance, fov, self.height) for value in pixels]
        elif self.in_length:
            limits = [typed(value, context.scene.unit_settings) for value in self.lengths[: self.levels]]
            _require_order(limits, lambda value: length(context, value))
        else:
            percentages = [shortest(value) for value in self.percentages[: self.levels]]
            _require_order(percentages, lambda value: f"{value:g} %")
            limits = [value / 100 * size for value in percentages]
        for i, limit in enumerate(limits):
            if limit > size:
                share = three_digits(100 * limit / size)
                raise Refused(
                    f"Level {i + 1}: a tolerance of {share} % of the size of {self.ob.name} leaves nothing of it"
                )
        return limits

    def _writes(self, outcomes):
        source = _source(self.ob)
        return [transfer.Writing(source, arrays, result, compact=True) for arrays, _, result, _ in outcomes]

    def _write(self, context, outcomes, writes):
        """Makes the objects of all levels, or none of them."""
        ob = self.ob
        with contextlib.ExitStack() as undo:
            meshes = []
            undo.callback(lambda: [bpy.data.meshes.remove(mesh) for mesh in meshes])
            source = _source(ob)
            for write in writes:
                meshes.append(source.copy())
                write.write(meshes[-1])
            if ob.tolvol.snapshot is None:
                undo.callback(snapshots.clear_reference, ob)
                snapshots.set_reference(ob, outcomes[0][1])
            undo.pop_all()
        shared.give(self, ob.tolvol.lod, lod_settings())
        earlier = chain(ob)[1:]
        # An exporter that takes objects, or the collection, by name gets the new levels.
        if ob.tolvol.lods:
            _rename_earlier(ob, [ob.tolvol.lods, *earlier, *(level.data for level in earlier)])
        collection = bpy.data.collections.new(f"{ob.name}_LODs")
        context.scene.collection.children.link(collection)
        levels, runs = [], [run for _, _, _, run in outcomes]
        for i, (mesh, write, outcome, run) in enumerate(zip(meshes, writes, outcomes, runs)):
            level = ob.copy()
            levels.append(level)
            level.name = mesh.name = f"{ob.name}_LOD{i + 1}"
            level.data = mesh
            collection.objects.link(level)
            level.select_set(False)  # Otherwise the next Decimate would decimate the levels, too.
            self._set(level.tolvol, i, run["tolerance"]["absolute"])
            level[GEOMETRIC_ERROR] = max(run["forward"][1], run["backward"][1])
            context.view_layer.update()
            decimation.keep(self, level, outcome, write.layout, f"{level.name}: ")
        # An earlier level that is shown in place of the object gives way to it.
        if ob.hide_get() and any(level.visible_get() for level in earlier):
            ob.hide_render = False
            ob.hide_set(False)
        ob.tolvol.lods = collection
        _hide(context, [*earlier, *levels])
        context.view_layer.objects.active = ob
        before, after = runs[0]["input"]["triangles"], [f"{run['output']['triangles']:,}" for run in runs]
        passed = sum(verdict.word(level) == verdict.PASS for level in levels)
        seconds = report.duration(sum(sum(run["seconds"].values()) for run in runs))
        counts = f"{before:,} -> {', '.join(after)} triangles, {passed} of {len(levels)} {verdict.PASS}"
        self.say({"INFO"}, f"{len(levels)} levels of {ob.name}: {counts}, {seconds}")

    def _set(self, settings, level, tolerance):
        """Sets the copied settings of a level."""
        settings.labels.clear()
        settings.lods, settings.lod_of = None, self.ob
        settings.show_deviation = False
        settings.keep = "BOTH"
        if self.by == "COUNT" or self.by == "TOLERANCE" and not self.in_length:
            settings.tolerance_mode = "PERCENT"
            settings.tolerance_percent = 100 * _WIDEST if self.by == "COUNT" else self.percentages[level]
        else:
            tolerances.set_length(settings, tolerance)


class TOLVOL_OT_show_level(bpy.types.Operator):
    """Show this one of the object and its levels, hide the others in the views and in renders, and make it the active object"""

    bl_idname = "tolvol.show_level"
    bl_label = "Show Level"
    bl_options = {"REGISTER", "UNDO"}

    level: IntProperty(name="Level", description="The number of the level. The object itself is 0", min=0)

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        if ob is None or ob.type != "MESH" or len(chain(ob)) < 2:
            return allowed(cls, "Make the levels first")
        return allowed(cls, None if ob.mode == "OBJECT" else "Switch to Object Mode")

    def execute(self, context):
        active = context.active_object
        objects = chain(active)
        self.level = min(self.level, len(objects) - 1)
        chosen = objects[self.level]
        if not _show(context, chosen):
            self.report(
                {"ERROR"}, f"{chosen.name} is in a collection that is hidden or excluded: show the collection first"
            )
            return {"CANCELLED"}
        # A level of an earlier chain is none of the present levels.
        _hide(context, [ob for ob in (active, *objects) if ob != chosen])
        return {"FINISHED"}


def chain(ob):
    """Returns the object of which levels are made, and the levels. `ob` is that object or one of the levels."""
    source = ob.tolvol.lod_of
    if source is None or not source.users_scene:  # A level keeps an object that was deleted.
        source = ob
    made = source.tolvol.lods.objects if source.tolvol.lods else ()
    # A copy of the object has its collection, but the levels are not those of the copy.
    return [source, *(each for each in made if each.tolvol.lod_of == source)]


def _rename_earlier(ob, datablocks):
    """Renames those of the datablocks that have names of levels of `ob`, so that new levels can have these names."""
    for each in datablocks:
        if each.name.startswith(f"{ob.name}_LOD"):
            each.name = f"{each.name}_earlier"


def _show(context, ob):
    """Shows an object in the views and in renders, and makes it active: a panel shows nothing of a hidden object. Returns
    False, and changes nothing, if its collection hides it."""
    if ob.name not in context.view_layer.objects:
        return False
    was_hidden = ob.hide_get()
    ob.hide_set(False)
    if not ob.visible_get():
        ob.hide_set(was_hidden)
        return False
    ob.hide_render = False
    ob.select_set(True)
    context.view_layer.objects.active = ob
    return True


def _hide(context, objects):
    for ob in objects:
        ob.hide_render = True
        if ob.name in context.view_layer.objects:
            ob.hide_set(True)


def _source(ob):
    """Returns the mesh that the levels are made from: the original, if the object is its own reference."""
    own = ob.tolvol.snapshot is not None and ob.tolvol.snapshot_kind == "SELF"
    return originals.kept(ob) if own else ob.data


@contextlib.contextmanager
def _original(ob):
    """Gives an object with the mesh that the levels are made from, and removes it at the end unless it is `ob`."""
    source = _source(ob)
    if source == ob.data:
        yield ob
        return
    twin = twin_of(ob, source)
    try:
        yield twin
    finally:
        bpy.data.objects.remove(twin)


def _require_order(values, as_text, falling=False):
    for i, (before, value) in enumerate(zip(values, values[1:])):
        if (value >= before) if falling else (value <= before):
            than = "fewer" if falling else "more"
            raise Refused(
                f"Level {i + 2}: {as_text(value)}, which is not {than} than the {as_text(before)} of level {i + 1}"
            )
