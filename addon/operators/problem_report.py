# SPDX-License-Identifier: GPL-3.0-or-later
"""Puts what a report of a problem needs into the clipboard. It holds no path, and no name from the file."""

import os
import platform
import re
from pathlib import Path

import bpy
import gpu

from .. import bl_info, native
from ..overlay import reasons
from ..proof import kept_warnings, verdict
from .original import active

_CPUS = Path("/proc/cpuinfo")  # Linux names the processor only here.
_MODEL = re.compile(r"^model name\s*:\s*(.+)$", re.MULTILINE)
# What stands in a sentence in place of something private.
_PATH, _NAME = "<path>", "<name>"
_PATHS = re.compile(r"[^\s'\"();,]*[/\\][^\s'\"():;,]*")


class TOLVOL_OT_copy_problem_report(bpy.types.Operator):
    """Copy the versions of add-on, module, Blender, system and graphics driver, the processor, and the kept warnings of the \
active object to the clipboard, as text for a report of a problem. Paths and the names in the file are left out"""

    bl_idname = "tolvol.copy_problem_report"
    bl_label = "Copy Problem Report"

    def execute(self, context):
        context.window_manager.clipboard = problem_report(context)
        self.report({"INFO"}, "The problem report is in the clipboard: paste it into your message")
        return {"FINISHED"}


def problem_report(context):
    """Returns the report as lines of text."""
    module = native.module.__version__ if native.module else _without_paths(native.reason)
    lines = [
        f"Tolerance Volumes {'.'.join(map(str, bl_info['version']))}",
        f"Compiled module: {module}",
        f"Blender: {bpy.app.version_string}, {bpy.app.build_hash.decode(errors='replace')}",
        f"Python: {platform.python_version()}",
        f"System: {platform.platform()}",
        f"Processor: {_processor()}, {os.cpu_count()} cores",
        f"OpenGL: {_driver()}",
        *(f"The driver refuses to draw: {_without_paths(error)}" for error in reasons.broken),
        *_about(active(context)),
    ]
    return "\n".join(lines) + "\n"


def _processor():
    found = _MODEL.search(_CPUS.read_text()) if _CPUS.is_file() else None
    return found[1] if found else platform.processor() or platform.machine()


def _driver():
    if bpy.app.background:  # Without a window Blender crashes when it is asked for the driver.
        return "not known, because Blender runs without a window"
    told = gpu.platform
    return f"{told.renderer_get()}, {told.vendor_get()}, {told.version_get()}"


def _about(ob):
    """Yields what the panels say about the active object."""
    if ob is None or ob.type != "MESH":
        yield "No mesh is active"
        return
    yield f"Active mesh: {len(ob.data.vertices):,} vertices, {len(ob.data.polygons):,} faces, {verdict.word(ob)}"
    warnings, staying = kept_warnings.of(ob)
    yield from (f"Warning: {_without_names(_without_paths(text))}" for text in warnings)
    yield from (f"Vertices that had to stay: {count:,} by {cause}" for cause, count in staying.items())


def _without_paths(text):
    # A folder whose name has spaces has to be known to be found as a whole.
    for folder in sorted({str(folder) for folder in (*native.known_folders(), Path.home())}, key=len, reverse=True):
        text = text.replace(folder, _PATH)
    return _PATHS.sub(_PATH, text)


def _without_names(text):
    """Replaces the names of what the user has made in the file, where they are whole words."""
    made = [bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.images, bpy.data.collections]
    made += [items for ob in bpy.data.objects for items in (ob.vertex_groups, ob.modifiers)]
    made += [mesh.uv_layers for mesh in bpy.data.meshes]
    names = {item.name for items in made for item in items}
    if not names:
        return text
    either = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
    return re.sub(rf"(?<!\w)(?:{either})(?!\w)", _NAME, text)
