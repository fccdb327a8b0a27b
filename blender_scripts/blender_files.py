# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads, decimates and writes the meshes of a file by Blender and the operators of the add-on.

addon/shared/command/decimate.py describes the functions.
"""

import json
import math

import bpy

import command_line as cli
from addon.files import file_io
from addon.files.file_io import extension_of, rounding  # noqa: F401
from addon.files.file_io import read_file as read  # noqa: F401
from addon.files.file_io import write_file as write  # noqa: F401
from addon.mesh import mesh_io
from addon.reference.snapshots import surface_of  # noqa: F401
from addon.shared.command.arguments import NOT_PROVED
from addon.shared.command.decimate import GEOMETRIC_ERROR
from addon.shared.errors import NOT_PROVED as BEGINNING

FORMATS = "Formats: .obj .ply .stl, and .gltf and .glb where Blender can read them."


def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)


def object_of(surface):
    arrays = surface.arrays
    ob = bpy.data.objects.new("reference", mesh_io.new_mesh("reference", arrays.vertices, arrays.triangles))
    bpy.context.collection.objects.link(ob)
    return ob


def decimate(ob, reference, tolerance, target, options, largest_perimeter):
    if ob.data.users > 1:  # Objects of a glTF file may share a mesh.
        ob.data = ob.data.copy()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == ob)
    bpy.context.view_layer.objects.active = ob
    if reference is not ob:
        ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", reference
    asked = {"target_triangles": target} if target else {"use_target": False}
    if options.placement:
        asked["placement"] = options.placement.upper()
    try:
        with file_io.quiet():
            bpy.ops.tolvol.decimate(
                tolerance_length=tolerance,
                # The property is a float32. The text gives the operator the number in double precision.
                tolerance_length_converted=repr(tolerance),
                keep="ONE" if options.one_sided else "BOTH",
                effort=options.effort.upper(),
                crossings=options.crossings.upper(),
                max_normal_angle=math.radians(options.max_normal_angle),
                max_seconds=options.max_seconds or 0,
                close_holes=options.close_holes,
                largest_perimeter=largest_perimeter,
                outside=options.outside.upper(),
                threads=options.threads or 0,
                **asked,
            )
    except RuntimeError as error:
        message = str(error).removeprefix("Error: ").strip()
        if "Traceback" in message:
            raise
        raise cli.Stop(f"{ob.name}: {message}", NOT_PROVED if BEGINNING in message else cli.USAGE) from None
    return json.loads(ob.tolvol.last_run)


def followed(_title, work):
    return work(None)


def note_deviation(ob, length):
    ob[GEOMETRIC_ERROR] = length
