# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe: reads the distance at the point under the mouse, and a click leaves a label."""

import functools

import bpy
from bpy.props import BoolProperty, FloatVectorProperty
from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d

from .. import native, preferences, status_bar
from ..background import Job
from ..job import JobOperator, breathe
from ..operation_settings import threads_setting
from ..proof import labels, probing
from ..reference import measurements, snapshots, tolerances
from ..shared.errors import Refused
from ..shared.proof import report
from ..units import length
from ..wrapping import popup_text
from .blocked import allowed, check_blocked, object_blocked
from .original import OF_THE_VIEW

_TICK = 0.1
_KEYS = "Click: Leave a Label    Esc: End"


def tolerance_of(ob):
    return tolerances.tolerance_length(ob.tolvol, snapshots.snapshot_size(ob))


def distance_text(context, reading):
    """Returns the distance of a Reading as text, with its side and the surface that it is on."""
    where = ", on the reference" if reading.on_reference else ""
    return f"{length(context, reading.distance)} {reading.side}".strip() + where


def described(context, ob, reading):
    """Returns what is known about a Reading as lines of text, the first without its tolerance."""
    tolerance = tolerance_of(ob)
    share = f"{report.percent(reading.distance, tolerance)} of the tolerance"
    lines = [f"{distance_text(context, reading)}, {share}"]
    beyond = "" if reading.within(tolerance) else ": beyond"
    lines.append(f"Tolerance {length(context, tolerance)}{beyond}")
    if reading.share < 1:
        lines.append(f"Decimate may use {100 * reading.share:.3g} % of it here, by the group of Protect")
    return lines


def reads_reference(context, ob):
    """Whether the reference is read and not the mesh: where it is coloured, it is drawn over everything else in the view."""
    settings = ob.tolvol
    return preferences.use_gl(context) and settings.show_deviation and settings.deviation_surface == "REFERENCE"


def what(context, ob):
    """Names the surface that is read."""
    if reads_reference(context, ob):
        return f"Reference of {ob.name}"
    on_top = measurements.on_top(ob)
    return f"Base mesh of {ob.name}, without its {' and '.join(on_top)}" if on_top else ob.name


class TOLVOL_OT_probe(bpy.types.Operator):
    """Show the exact distance, its side and the tolerance at the point under the mouse: a point of the reference if the \
reference is coloured, else of the mesh. A click leaves a label there. Esc, or another click on this button, ends it"""

    bl_idname = "tolvol.probe"
    bl_label = "Probe"

    _running = None  # the operator that is at work

    @classmethod
    def poll(cls, context):
        return allowed(cls, None if cls._running else check_blocked(context.active_object))

    @classmethod
    def running(cls):
        return cls._running is not None

    def execute(self, _context):
        self.report({"ERROR"}, "Probe needs the mouse: press its button in a 3D view. A script uses Add Label")
        return {"CANCELLED"}

    def invoke(self, context, event):
        if TOLVOL_OT_probe._running is not None:
            TOLVOL_OT_probe._running._over = True
            return {"CANCELLED"}
        if context.area is None or context.area.type != "VIEW_3D":
            self.report({"ERROR"}, "Probe reads points in a 3D view: press its button in the sidebar of one")
            return {"CANCELLED"}
        self._name = context.active_object.name
        self._probe, self._job, self._source, self._over, self._area = None, None, None, False, None
        self._mouse = event.mouse_x, event.mouse_y
        self._said = None
        TOLVOL_OT_probe._running = self
        self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        probing.show_hover(probing.Hover(0, (0, 0), []))
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        try:
            return self._handle(context, event)
        except BaseException:
            self._end(context)
            raise

    def _handle(self, context, event):
        if self._over:
            return self._end(context)
        # A step that is undone replaces all objects: only the name stays.
        ob = bpy.data.objects.get(self._name)
        if reason := f"{self._name} was removed or renamed" if ob is None else check_blocked(ob):
            self.report({"WARNING"}, f"The probe has ended: {reason}")
            return self._end(context)
        if event.type in {"MOUSEMOVE", "LEFTMOUSE"}:
            self._mouse = event.mouse_x, event.mouse_y
        area, region, view = _under(context.window, *self._mouse)
        if event.type == "ESC" and event.value == "PRESS":
            return self._end(context)
        if region is not None and event.type == "RIGHTMOUSE" and event.value == "PRESS":
            return self._end(context)
        if event.type in {"MOUSEMOVE", "TIMER", "LEFTMOUSE"}:
            try:
                reading = self._read(context, ob, area, region, view)
            except (Refused, native.module.TolvolError) as error:
                self.report({"ERROR"}, popup_text(native.said(error)))
                return self._end(context)
            if event.type == "LEFTMOUSE" and event.value == "PRESS" and reading is not None and not event.alt:
                labels.add(ob, reading)
                bpy.ops.ed.undo_push(message="Add Label")
                return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"} if region is None or _of_the_view(event) else {"RUNNING_MODAL"}

    def cancel(self, context):
        self._end(context)

    def _read(self, context, ob, area, region, view):
        """Shows what is under the mouse, and returns its Reading or None."""
        reading, lines = None, []
        if self._ready(context, ob):
            if region is not None:
                at = self._mouse[0] - region.x, self._mouse[1] - region.y
                reading = self._probe.along(
                    region_2d_to_origin_3d(region, view, at), region_2d_to_vector_3d(region, view, at)
                )
            if reading is not None:
                lines = described(context, ob, reading)
            status = f"{what(context, ob)}: {', '.join(lines) or 'no point under the mouse'}    {_KEYS}"
        else:
            lines, status = ["Preparing"], "Preparing    Esc: End"
        self._show(area, region, lines, reading, status)
        return reading

    def _ready(self, context, ob):
        """Whether the probe reads the object, or its reference, as it is now. Else it is being made in a thread."""
        on_reference = reads_reference(context, ob)
        if self._job is not None:
            if not self._job.done():
                return False
            job, self._job = self._job, None
            found = job.outcome()
            if self._source.fits(ob):
                self._probe = probing.Probe(self._source, found, ob)
        if self._probe is not None and self._source.fits(ob) and self._source.on_reference == on_reference:
            return True
        self._probe = None
        self._source = probing.Source(ob, on_reference)
        self._job = Job(functools.partial(self._source.look_up, preferences.threads(context)), native.module.Progress())
        return False

    def _show(self, area, region, lines, reading, status):
        place = (0, (0, 0)) if region is None else (region.as_pointer(), _within(region, self._mouse))
        found = probing.Hover(*place, lines if region is not None else [], reading.position if reading else None)
        before = probing.hover()
        same = before.region == found.region and before.mouse == found.mouse and before.lines == found.lines
        probing.show_hover(found)
        if not same:
            probing.redraw(self._area)
            probing.redraw(area)
        self._area = area
        if status != self._said or not status_bar.showing():  # A job that ends removes its text and this one.
            self._said = status
            status_bar.show(status)

    def _end(self, context):
        TOLVOL_OT_probe._running = None
        if self._job is not None:
            self._job.progress.cancel()
        context.window_manager.event_timer_remove(self._timer)
        status_bar.clear()
        probing.show_hover(None)
        return {"FINISHED"}


def _within(region, mouse):
    return mouse[0] - region.x, mouse[1] - region.y


def _of_the_view(event):
    """Whether Blender itself has to handle an event over the 3D view: to turn it, or to undo a label."""
    if event.type in OF_THE_VIEW or event.type.startswith(("NUMPAD_", "NDOF_")) or event.type == "HOME":
        return True
    return event.type == "Z" and (event.ctrl or event.oskey) or event.type == "LEFTMOUSE" and event.alt


def _under(window, x, y):
    """Returns (area, region, its RegionView3D) of the 3D view under a place of the window; None for what is not there."""
    for area in window.screen.areas:
        if area.type != "VIEW_3D" or not _contains(area, x, y):
            continue
        views = [region for region in area.regions if region.type == "WINDOW"]
        if any(region not in views and region.width > 1 and _contains(region, x, y) for region in area.regions):
            return area, None, None  # The sidebar or another part lies over the view.
        space = area.spaces.active
        cameras = list(space.region_quadviews) or [space.region_3d]
        for region, camera in zip(views[-len(cameras) :], cameras):
            if _contains(region, x, y):
                return area, region, camera
    return None, None, None


def _contains(part, x, y):
    return part.x <= x < part.x + part.width and part.y <= y < part.y + part.height


class _Measuring(JobOperator):
    """Makes the probes of an object in a thread, then calls read(context, {on_reference: Probe})."""

    threads: threads_setting()

    def prepare(self, context):
        context.view_layer.update()
        sources = []
        for on_reference in self.surfaces():
            sources.append(probing.Source(self.ob, on_reference))
            yield breathe
        threads = self.threads or preferences.threads(context)

        def work(progress):
            return [(source, source.look_up(threads, progress)) for source in sources]

        return work

    def finish(self, context, outcome):
        self.read(context, {source.on_reference: probing.Probe(source, found, self.ob) for source, found in outcome})


class TOLVOL_OT_add_label(_Measuring, bpy.types.Operator):
    """Leave a label with the exact distance at the point of the mesh, or of its reference, that is nearest to a position"""

    bl_idname = "tolvol.add_label"
    bl_label = "Add Label"
    bl_options = {"REGISTER", "UNDO"}

    position: FloatVectorProperty(
        name="Position", description="A point in the world", size=3, subtype="XYZ", options={"SKIP_SAVE"}
    )
    on_reference: BoolProperty(
        name="On the Reference",
        description="Read a point of the reference, and its distance from the mesh, instead of a point of the mesh",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context):
        return allowed(cls, check_blocked(context.active_object))

    def surfaces(self):
        return [self.on_reference]

    def read(self, context, probes):
        reading = probes[self.on_reference].nearest_to(self.position)
        labels.add(self.ob, reading)
        self.say({"INFO"}, ", ".join(described(context, self.ob, reading)))


class TOLVOL_OT_renew_labels(_Measuring, bpy.types.Operator):
    """Measure again at all labels that are out of date: at the points of the mesh, or of the reference, that are now nearest \
to them"""

    bl_idname = "tolvol.renew_labels"
    bl_label = "Measure Labels Again"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        reason = check_blocked(ob)
        if not reason and all(labels.current(ob, label) for label in ob.tolvol.labels):
            reason = "No label is out of date" if ob.tolvol.labels else "There are no labels"
        return allowed(cls, reason)

    def surfaces(self):
        ob = self.ob
        return sorted({label.on_reference for label in ob.tolvol.labels if not labels.current(ob, label)})

    def read(self, context, probes):
        ob, count = self.ob, 0
        for label in ob.tolvol.labels:
            if not labels.current(ob, label):
                labels.write(ob, label, probes[label.on_reference].nearest_to(labels.reading(ob, label).position))
                count += 1
        labels.notify()
        self.say({"INFO"}, f"Measured again at {count} label{'s' * (count != 1)}")


class TOLVOL_OT_remove_label(bpy.types.Operator):
    """Remove the chosen label"""

    bl_idname = "tolvol.remove_label"
    bl_label = "Remove Label"
    bl_options = {"REGISTER", "UNDO"}

    everything: BoolProperty(name="All", description="Remove all labels of the object", options={"SKIP_SAVE"})

    @classmethod
    def description(cls, _context, properties):
        return "Remove all labels of the object" if properties.everything else "Remove the chosen label"

    @classmethod
    def poll(cls, context):
        ob = context.active_object
        return allowed(cls, object_blocked(ob) or (None if ob.tolvol.labels else "There are no labels"))

    def execute(self, context):
        settings = context.active_object.tolvol
        if self.everything:
            settings.labels.clear()
        else:
            settings.labels.remove(min(settings.label_index, len(settings.labels) - 1))
        settings.label_index = max(0, min(settings.label_index, len(settings.labels) - 1))
        labels.notify()
        return {"FINISHED"}
