# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and writes mesh files. Coordinates stay as in the file: no axis is turned.

Blender's own importers and exporters do the work, except where plain_files.py reads a file in a fraction of their time.
"""

import contextlib
import ctypes
import functools
import os
import re
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..mesh import mesh_io
from ..shared.errors import Refused
from ..shared.files import file_check, gltf_check
from . import plain_files

_GLTF = (".gltf", ".glb")
EXTENSIONS = (".obj", ".ply", ".stl", *_GLTF)

# Blender's glTF reader turns the file's (x, y, z) to (x, -z, y). _TURN_BACK undoes this turn without rounding: it is the
# matrix between the objects of the file and their parent, which is named _AXES.
_AXES = "axes of the file"
_TURN_BACK = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)))

# Blender writes six decimals to an OBJ file. A coordinate below 16 is read back with an error of at most 1e-6: half a
# unit of the last decimal and the rounding to float32. A coordinate beyond 16 is read back exactly.
_OBJ_STEP = 1e-6


class MeshFile:
    """The mesh objects that a file brought into the scene, and a record of the faces that Blender's reader left out.

    extras: the number of things in the file that are not meshes, by kind, such as {"skins": 1}.
    """

    def __init__(self, path, objects, repairs, extras):
        self.path = path
        self.objects = objects
        self.repairs = repairs
        self.extras = extras

    @functools.cached_property
    def counts(self):
        """The numbers of vertices and triangles at the first access: a later change of the meshes does not change them."""
        meshes = [ob.data for ob in self.objects]
        return {
            "vertices": sum(len(mesh.vertices) for mesh in meshes),
            "triangles": sum(mesh_io.triangle_count(mesh) for mesh in meshes),
        }


def extension_of(path):
    """Returns the extension of a path. Raises Refused for one that is not in EXTENSIONS, and lists those."""
    extension = file_check.known_extension(path, EXTENSIONS)
    if extension in _GLTF and bpy.app.version < (4, 0) and "bool" not in vars(np):
        raise Refused(
            f"{path}: Blender {bpy.app.version_string} cannot read glTF with NumPy {np.__version__}; "
            "use .ply, .obj or .stl, or a newer Blender"
        )
    return extension


def read_file(path):
    """Adds the meshes of a file to the scene. Raises Refused, which names the file, if the file is damaged."""
    extension = extension_of(path)
    data = file_check.data_of(path)
    try:
        content = file_check.check(extension, data, Path(path).parent)
    except Refused as error:
        raise Refused(f"{path}: {error}") from None
    before = set(bpy.data.objects)
    try:
        with quiet():
            if not plain_files.read(path, content):
                _import(extension, str(path), b"\ng " in data)
            if extension in _GLTF:
                _turn_back([ob for ob in bpy.data.objects if ob not in before])
            # Exporters see the new objects, and the objects' matrices become valid, only after this update.
            bpy.context.view_layer.update()
    except RuntimeError as error:
        raise Refused(f"{path}: Blender cannot read it: {str(error).strip().splitlines()[-1]}") from None
    added = [ob for ob in bpy.data.objects if ob not in before and not _is_bone_shape(ob)]
    objects = [ob for ob in added if ob.type == "MESH" and ob.data.polygons]
    if not objects:
        raise Refused(f"{path}: the file has no faces")
    for ob in objects:
        ob.name = ob.name.replace(" ", "_")  # The OBJ exporter would do so: the name is the same in all reports.
    dropped = content.faces - sum(len(ob.data.polygons) for ob in objects)
    repairs = []
    if dropped > 0:
        message = (
            f"{dropped:,} faces that repeat a corner or another face were left out when {Path(path).name} was read"
        )
        repairs.append({"kind": "unreadable", "count": dropped, "message": message})
    return MeshFile(path, objects, repairs, gltf_check.extras(data) if extension in _GLTF else {})


def write_file(path, objects, textures_beside):
    """Exports mesh objects as they are, without modifiers.

    A .mtl file names a texture in the folder `textures_beside` relative to that folder, and any other texture by its full
    path. Raises OSError where the message of Blender's exporter holds the number of the system's error.
    """
    with quiet():
        bpy.context.view_layer.update()
        bpy.ops.object.select_all(action="DESELECT")
        for ob in objects:
            ob.select_set(True)
        try:
            _export(Path(path).suffix.lower(), str(path), objects)
        except RuntimeError as error:
            if refused := re.search(r"\[Errno (\d+)\]", str(error)):
                raise OSError(int(refused[1]), os.strerror(int(refused[1]))) from None
            raise
    for material in Path(path).parent.glob("*.mtl"):
        text = material.read_text(errors="surrogateescape")
        folder = str(Path(textures_beside).resolve()) + os.sep
        material.write_text(text.replace(f" {folder}", " "), errors="surrogateescape")


def rounding(path, objects):
    """Returns an upper bound of the distance between a vertex in the world and the same vertex as the file stores it."""
    extension = Path(path).suffix.lower()
    step = _OBJ_STEP if extension == ".obj" else 0.0
    for ob in objects:
        matrix = mesh_io.matrix_array(ob.matrix_world)
        # The exporter applies the matrix, or splits it into location, rotation and scale, in float32.
        if not np.array_equal(matrix, np.eye(4)):
            reach = np.abs(mesh_io.column(ob.data.vertices, "co", 3)).max(0, initial=0.0)
            largest = (np.abs(matrix[:3, :3]) @ reach + np.abs(matrix[:3, 3])).max()
            step = max(step, _OBJ_STEP * (extension == ".obj") + 4 * float(np.finfo(np.float32).eps) * largest)
    return step * 3**0.5


def _is_bone_shape(ob):
    """Whether the glTF reader made the object to draw bones with."""
    return any(collection.name.startswith("glTF_not_exported") for collection in ob.users_collection)


def _turn_back(objects):
    """Makes the objects that a glTF file brought children of another, by a matrix that undoes the reader's turn."""
    axes = bpy.data.objects.new(_AXES, None)
    bpy.context.collection.objects.link(axes)
    for ob in objects:
        if ob.parent is None:
            ob.parent, ob.matrix_parent_inverse = axes, _TURN_BACK


@contextlib.contextmanager
def _as_imported():
    """Undoes _turn_back() while the context lasts. Yields whether there was anything to undo."""
    turned = [(ob, ob.parent) for ob in bpy.data.objects if ob.parent and ob.parent.name.startswith(_AXES)]
    try:
        for ob, _ in turned:
            ob.parent = None
        bpy.context.view_layer.update()
        yield bool(turned)
    finally:
        for ob, axes in turned:
            ob.parent, ob.matrix_parent_inverse = axes, _TURN_BACK
        bpy.context.view_layer.update()


@contextlib.contextmanager
def _known_to_the_exporter():
    """Enters this add-on in the preferences while the context lasts if it was not installed: there the exporter of glTF looks
    for gltf_extras.py."""
    name, addons = __package__.removesuffix(".files"), bpy.context.preferences.addons
    if name in addons:
        yield
        return
    entry = addons.new()
    entry.module = name
    try:
        yield
    finally:
        addons.remove(entry)


def _import(extension, path, groups):
    operators = dir(bpy.ops.wm)
    if extension == ".obj":
        bpy.ops.wm.obj_import(
            filepath=path, forward_axis="Y", up_axis="Z", validate_meshes=True, import_vertex_groups=groups
        )
    elif extension == ".ply" and "ply_import" in operators:
        bpy.ops.wm.ply_import(filepath=path, forward_axis="Y", up_axis="Z", merge_verts=False)
    elif extension == ".ply":
        bpy.ops.import_mesh.ply(filepath=path)
    elif extension == ".stl" and "stl_import" in operators:
        bpy.ops.wm.stl_import(filepath=path, forward_axis="Y", up_axis="Z", use_mesh_validate=True)
    elif extension == ".stl":
        bpy.ops.import_mesh.stl(filepath=path, axis_forward="Y", axis_up="Z")
    else:
        # Packed images would lose the folder that they came from.
        bpy.ops.import_scene.gltf(filepath=path, import_pack_images=False)


def _export(extension, path, objects):
    operators = dir(bpy.ops.wm)
    meshes = [ob.data for ob in objects]
    if extension == ".obj":
        bpy.ops.wm.obj_export(
            filepath=path,
            forward_axis="Y",
            up_axis="Z",
            export_selected_objects=True,
            apply_modifiers=False,
            export_uv=any(mesh.uv_layers for mesh in meshes),
            export_normals=any(mesh.has_custom_normals for mesh in meshes),
            export_colors=any(mesh.color_attributes for mesh in meshes),
            export_materials=any(mesh.materials for mesh in meshes),
            export_smooth_groups=True,
            export_vertex_groups=any(ob.vertex_groups for ob in objects),
            path_mode="ABSOLUTE",
        )
    elif extension == ".ply" and "ply_export" in operators:
        bpy.ops.wm.ply_export(
            filepath=path,
            forward_axis="Y",
            up_axis="Z",
            export_selected_objects=True,
            apply_modifiers=False,
            export_normals=False,
            export_uv=any(mesh.uv_layers for mesh in meshes),
        )
    elif extension == ".ply":
        bpy.ops.export_mesh.ply(
            filepath=path,
            use_selection=True,
            use_mesh_modifiers=False,
            use_normals=False,
            axis_forward="Y",
            axis_up="Z",
        )
    elif extension == ".stl" and "stl_export" in operators:
        bpy.ops.wm.stl_export(
            filepath=path, forward_axis="Y", up_axis="Z", export_selected_objects=True, apply_modifiers=False
        )
    elif extension == ".stl":
        bpy.ops.export_mesh.stl(
            filepath=path, use_selection=True, use_mesh_modifiers=False, axis_forward="Y", axis_up="Z"
        )
    else:
        form = "GLB" if extension == ".glb" else "GLTF_SEPARATE"
        with _as_imported() as turned, _known_to_the_exporter():
            bpy.ops.export_scene.gltf(
                filepath=path, export_format=form, use_selection=True, export_apply=False, export_yup=turned
            )


@contextlib.contextmanager
def quiet():
    """Keeps Blender's own messages off stdout and stderr, whose lines belong to the command."""
    # The C library buffers output: it must be flushed before each change of the descriptors to land on the right side.
    flush = ctypes.CDLL(None).fflush if sys.platform != "win32" else lambda _: None

    def flush_all():
        sys.stdout.flush()
        sys.stderr.flush()
        flush(None)

    flush_all()
    kept = [os.dup(descriptor) for descriptor in (1, 2)]
    try:
        with tempfile.TemporaryFile() as sink:
            os.dup2(sink.fileno(), 1)
            os.dup2(sink.fileno(), 2)
            try:
                yield
            finally:
                flush_all()
                os.dup2(kept[0], 1)
                os.dup2(kept[1], 2)
    finally:
        for descriptor in kept:
            os.close(descriptor)
