# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves the deviations of the selected objects from their references as a file."""

import datetime
import os
from dataclasses import dataclass
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from .. import native, preferences
from ..job import JobOperator
from ..mesh.mesh_io import triangle_count
from ..operation_settings import threads_setting
from ..proof import labels, last_run
from ..reference import measurements, tolerances
from ..shared.errors import Refused
from ..shared.files import safe_files
from ..shared.proof import deviation, deviation_pictures, deviation_units
from ..shared.surface import Surface
from ..units import chosen_unit
from .blocked import allowed, check_blocked
from .decimate import targets
from .mesh_and_reference import mesh_and_reference

# The report gives the share of the area in the bands between these shares of the tolerance.
_BANDS = (0.25, 0.5, 0.75)

_FORMATS = (
    (
        "HTML",
        "Page",
        "A page to read and to print (.html), with histograms, and pictures of the mesh and of the reference",
    ),
    (
        "CSV",
        "Table",
        "A table for a spreadsheet (.csv): each row has one number, and the ends of its range if it has one",
    ),
    ("JSON", "All Numbers", "All numbers for a program to read (.json)"),
)


@dataclass
class _Task:
    """The work on one object in the thread. It reads and returns no data of Blender."""

    name: str
    surface: Surface
    reference: Surface
    tolerance: float
    two_sided: bool
    given_in: str
    about: dict  # entries of the report that are known before
    unit: tuple  # the name of the unit, and the factor from world lengths to it
    drawn: bool  # whether pictures are needed
    threads: int

    def run(self, progress):
        bounds = [share * self.tolerance for share in _BANDS]
        run = deviation.deviation(
            self.surface,
            self.reference,
            self.reference.size(),
            self.tolerance,
            bounds,
            threads=self.threads,
            progress=progress,
            two_sided=self.two_sided,
            given_in=self.given_in,
        )
        name, factor = self.unit
        pictures = self._pictures(run, factor, progress) if self.drawn else []
        return run, deviation_units.in_unit(run | self.about, factor, name), pictures

    def _pictures(self, run, factor, progress):
        names = [self.about[key]["name"] for key in ("a", "b")]
        captions = [f"{own}, coloured by its distance from {other}" for own, other in (names, names[::-1])]
        try:
            return deviation_pictures.drawn(
                self.surface, self.reference, run, captions, factor, threads=self.threads, progress=progress
            )
        except native.module.GlUnavailable:
            return []


class TOLVOL_OT_save_report(JobOperator, bpy.types.Operator):
    """Measure the distances from each selected mesh to its reference and back, and save them as a page to read (.html), \
a table (.csv) or all numbers (.json)"""

    bl_idname = "tolvol.save_report"
    bl_label = "Save Report"

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(
        default=";".join(f"*{extension}" for extension in deviation.EXTENSIONS), options={"HIDDEN", "SKIP_SAVE"}
    )
    check_existing: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    format: EnumProperty(
        name="Format",
        description="The kind of file. Another choice changes the ending of the file's name, and a typed ending the choice",
        items=_FORMATS,
        options={"SKIP_SAVE"},
    )
    threads: threads_setting()

    _browsing = False
    _named_for = ""  # the format that the file's name has an ending for

    @classmethod
    def poll(cls, context):
        return allowed(cls, check_blocked(context.active_object))

    def draw(self, _context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "format")

    def invoke(self, context, event):
        if self.filepath:
            return super().invoke(context, event)
        self._browsing = True
        # The folder of the .blend file may have been removed meanwhile.
        folder = Path(bpy.data.filepath).parent
        if not bpy.data.filepath or not folder.is_dir():
            folder = Path.home()
        # A page of several objects is not named after one of them.
        about = context.active_object.name if len(targets(context)) == 1 else "objects"
        self.filepath = str(folder / f"{bpy.path.clean_name(about)} deviation{_ending(self.format)}")
        self._named_for = self.format
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def check(self, _context):
        """Called by the file browser after each change: makes the ending of the name and the format agree."""
        path = Path(self.filepath)
        before = self.filepath, self.format
        ending = path.suffix.lower()
        if not os.path.basename(self.filepath):  # A Path would take the folder for the name.
            return False
        if self.format != self._named_for:  # The format was chosen.
            known = ending in deviation.EXTENSIONS
            self.filepath = f"{path.with_suffix('') if known else path}{_ending(self.format)}"
        elif ending in deviation.EXTENSIONS:  # The name was typed.
            self.format = ending[1:].upper()
        else:
            self.filepath += _ending(self.format)
        self._named_for = self.format
        return before != (self.filepath, self.format)

    def execute(self, context):
        if self._browsing:  # The user has chosen a file. A new invoke measures with progress and Esc.
            self.check(context)
            return bpy.ops.tolvol.save_report("INVOKE_DEFAULT", filepath=self.filepath, threads=self.threads)
        return super().execute(context)

    def targets(self, context):
        return targets(context)

    def steps(self, context):
        context.view_layer.update()
        self._prepare_file()
        blocked = {ob.name: reason for ob in self.objects if (reason := check_blocked(ob))}
        measured = [ob for ob in self.objects if ob.name not in blocked]
        tasks = []
        for ob in measured:
            tasks.append((yield from self._task(context, ob)))
        about = {
            "date": datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
            "blend_file": Path(bpy.data.filepath).name or None,
        }
        outcomes = yield from self.each(tasks)
        runs, pictures = [run for _, run, _ in outcomes], [drawn for _, _, drawn in outcomes]
        if len(self.objects) == 1:
            document, pictures = runs[0] | about, pictures[0]
        else:
            others = [{"name": name, "reason": reason} for name, reason in blocked.items()]
            document = deviation.several(runs, others, about)
        with safe_files.Staged() as staged:
            staged.write(self._target, deviation.content(document, self._target.name, pictures))
            staged.publish()
        for ob, task, (run, _, _) in zip(measured, tasks, outcomes):
            certified = {way: run[way]["largest"] for way in ("forward", "backward")}
            share = next(entry["share"] for entry in run["forward"]["beyond"] if entry["bound"] == task.tolerance)
            measurements.remember(ob, task.surface, certified, task.tolerance, share)
        self.say({"INFO"}, f"Saved {self._target.name}: {document['verdict']}")

    def _prepare_file(self):
        """Refuses before the work begins what could not be written at its end."""
        path = Path(bpy.path.abspath(self.filepath))
        if path.suffix.lower() not in deviation.EXTENSIONS:
            raise Refused(f"{path.name} does not end in {', '.join(deviation.EXTENSIONS)}")
        self._target = safe_files.Target(path)
        used = [path for path in (bpy.data.filepath, *bpy.utils.blend_paths(absolute=True)) if path]
        safe_files.require_apart([(str(path), path)], [(path, path) for path in used])
        with safe_files.Staged() as staged:  # This refuses a folder that cannot be written to.
            if not self._target.is_device:
                staged.folder(self._target)

    def _task(self, context, ob):
        """A generator for steps(): returns the _Task of an object."""
        settings = ob.tolvol
        surface, reference = yield from mesh_and_reference(ob)
        size = reference.size()
        tolerance = tolerances.required(ob, size)
        of_object = settings.snapshot_kind == "OBJECT" and settings.snapshot_object is not None
        reference_name = settings.snapshot_object.name if of_object else "its reference"
        about = {"a": _counted(ob.name, ob.data), "b": _counted(reference_name, settings.snapshot)}
        holes = last_run.remembered_holes(settings.last_run)
        if holes and last_run.stays(ob):
            about["a"]["holes"] = holes
        if settings.labels:
            about["labels"] = labels.listed(ob, tolerance)
        return _Task(
            ob.name,
            surface,
            reference,
            tolerance,
            settings.keep == "BOTH",
            settings.tolerance_mode.lower(),
            about,
            chosen_unit(context, size),
            self._target.path.suffix.lower() == ".html",
            self.threads or preferences.threads(context),
        )


def _ending(format_):
    return f".{format_.lower()}"


def _counted(name, mesh):
    return {"name": name, "vertices": len(mesh.vertices), "triangles": triangle_count(mesh)}
