# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves the deviation of an object and its reference as a file."""

from pathlib import Path

import bpy
from bpy.props import StringProperty

from ..errors import Refused
from ..files import safe_files
from ..proof import deviation, labels, last_run, report
from ..reference import snapshots, tolerances
from .check import Comparison

# The report gives the share of the area in the bands between these shares of the tolerance.
_BANDS = (0.25, 0.5, 0.75)


class TOLVOL_OT_save_report(Comparison, bpy.types.Operator):
    """Measure the distances from the mesh to the reference and from the reference to the mesh, and save them as a page to \
read (.html), a table (.csv) or all numbers (.json)"""

    bl_idname = "tolvol.save_report"
    bl_label = "Save Report"

    filepath: StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(
        default=";".join(f"*{extension}" for extension in deviation.EXTENSIONS), options={"HIDDEN", "SKIP_SAVE"}
    )
    check_existing: bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})

    _browsing = False

    def invoke(self, context, event):
        if self.filepath:
            return super().invoke(context, event)
        self._browsing = True
        # The folder of the .blend file may have been removed meanwhile.
        folder = Path(bpy.data.filepath).parent
        if not bpy.data.filepath or not folder.is_dir():
            folder = Path.home()
        self.filepath = str(folder / f"{bpy.path.clean_name(context.active_object.name)} deviation.html")
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        if self._browsing:  # The user has chosen a file. A new invoke measures with progress and Esc.
            return bpy.ops.tolvol.save_report("INVOKE_DEFAULT", filepath=self.filepath, threads=self.threads)
        return super().execute(context)

    def prepare(self, context):
        path = Path(bpy.path.abspath(self.filepath))
        if path.suffix.lower() not in deviation.EXTENSIONS:
            raise Refused(f"{path.name} does not end in {', '.join(deviation.EXTENSIONS)}")
        self._target = safe_files.Target(path)
        used = [path for path in (bpy.data.filepath, *bpy.utils.blend_paths(absolute=True)) if path]
        safe_files.require_apart([(str(path), path)], [(path, path) for path in used])
        with safe_files.Staged() as staged:  # This refuses a folder that cannot be written to before the work begins.
            if not self._target.is_device:
                staged.folder(self._target)
        self._about = {
            "a": _counted(self.ob.name, self.ob.data),
            "b": _counted("its reference", self.ob.tolvol.snapshot),
        }
        holes = report.remembered_holes(self.ob.tolvol.last_run)
        if holes and last_run.stays(self.ob):
            self._about["a"]["holes"] = holes
        if self.ob.tolvol.labels:
            tolerance = tolerances.tolerance_length(self.ob.tolvol, snapshots.snapshot_size(self.ob))
            self._about["labels"] = labels.listed(self.ob, tolerance)
        units = context.scene.unit_settings
        self._unit = "m" if units.system != "NONE" and units.scale_length == 1 else "units"
        return super().prepare(context)

    def compare(self, surface, reference, tolerance, threads, progress):
        bounds = [share * tolerance for share in _BANDS]
        return deviation.deviation(
            surface, reference, reference.size(), tolerance, bounds, self._unit, threads, progress, self.two_sided
        )

    def finish(self, context, outcome):
        with safe_files.Staged() as staged:
            staged.write(self._target, deviation.content(outcome | self._about, self._target.name))
            staged.publish()
        self.say({"INFO"}, f"{outcome['verdict']}: saved {self._target.name}")


def _counted(name, mesh):
    mesh.calc_loop_triangles()
    return {"name": name, "vertices": len(mesh.vertices), "triangles": len(mesh.loop_triangles)}
