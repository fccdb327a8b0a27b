# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and writes .glb and .3mf files by trimesh."""

import io
import zipfile
from pathlib import Path

import numpy as np

from ..shared.command.decimate import GEOMETRIC_ERROR
from ..shared.errors import Refused
from ..shared.files import gltf_check
from ..shared.files.content import require_finite
from .mesh import Attribute, Mesh, joined, split, weld

EXTENSIONS = (".3mf", ".glb")
HOLDS = {".3mf": (), ".glb": ("UVs", "normals", "colours")}


def read(name, extension, data, folder):
    """Returns (Mesh, remarks, extras). Raises Refused, which does not name the file."""
    import trimesh

    extras, others = {}, ()
    if extension == ".glb":
        gltf_check.check(data, folder)
        extras = gltf_check.extras(data)
        others = _unknown(data)
    elif not zipfile.is_zipfile(io.BytesIO(data)):
        raise Refused("this is not a 3MF file, or it is truncated: it is no zip archive")
    # Whatever fails in another reader is damage of the file, or something that this reader does not know.
    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type=extension[1:], process=False)
    except Exception as error:
        raise Refused(f"trimesh cannot read it: {type(error).__name__}: {error}") from None
    meshes = []
    for node in scene.graph.nodes_geometry:
        matrix, geometry = scene.graph[node]
        found = scene.geometry[geometry]
        if isinstance(found, trimesh.Trimesh) and len(found.faces):
            meshes.append(_mesh(str(node), found, matrix, extension))
    if not meshes:
        raise Refused("the file has no faces")
    whole = joined(name, meshes)
    whole.others, whole.unit = (*whole.others, *others), str(scene.units or "") if extension == ".3mf" else ""
    before = len(whole.vertices)
    whole = weld(whole)
    welded = before - len(whole.vertices)
    remarks = [(welded, f"{welded:,} vertices were welded to others at their position")] if welded else []
    return whole, remarks, extras


def _unknown(data):
    """Returns words for what a .glb file holds and trimesh leaves out. Raises Refused for what it cannot unpack."""
    document, _ = gltf_check.parts(data)
    required = set(document.get("extensionsRequired", ()))
    if compressed := sorted(required & {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}):
        raise Refused(f"its meshes are compressed by {compressed[0]}: save it again without compression")
    primitives = [primitive for mesh in document.get("meshes", ()) for primitive in mesh.get("primitives", ())]
    bare = any(
        "TEXCOORD_0" in primitive.get("attributes", {}) and "material" not in primitive for primitive in primitives
    )
    return ("the UVs of meshes without a material",) * bare


def _mesh(name, found, matrix, extension):
    # trimesh holds every coordinate as a double. glTF stores float32, so that no digit is lost.
    vertices = found.vertices.view(np.ndarray)
    triangles = found.faces.view(np.ndarray).astype(np.int32)
    require_finite(vertices)
    identity = np.array_equal(matrix, np.eye(4))
    mirrored = np.linalg.det(matrix[:3, :3]) < 0
    order = [2, 1, 0] if mirrored else [0, 1, 2]
    kept = {}
    if extension == ".glb":
        vertices = vertices.astype(np.float32)
        for kind, values in _values(found).items():
            if kind == "normals" and not identity:
                values = values @ np.linalg.inv(matrix[:3, :3])
                values /= np.maximum(np.linalg.norm(values, axis=1, keepdims=True), 1e-12)
            values = values if values.dtype == np.uint8 else values.astype(np.float32)
            kept[kind] = Attribute(values, triangles[:, order])
    if not identity:
        vertices = vertices.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return Mesh(name, vertices, triangles[:, order], kept, material=getattr(found.visual, "material", None))


def _values(found):
    """Returns the attributes of the vertices of a mesh of trimesh."""
    values = {}
    if "vertex_normals" in found._cache:
        values["normals"] = np.asarray(found.vertex_normals, np.float64)
    if getattr(found.visual, "uv", None) is not None:
        values["UVs"] = np.asarray(found.visual.uv)
    # Beside a material trimesh keeps the colours as an attribute.
    beside = getattr(found.visual, "vertex_attributes", {}).get("color")
    if found.visual.kind == "vertex" or beside is not None:
        values["colours"] = _bytes(np.asarray(found.visual.vertex_colors if beside is None else beside))
    return values


def write(path, mesh):
    """Writes a file, in the format of its extension. .glb holds float32, .3mf decimals that are read back exactly."""
    import trimesh

    extension = Path(path).suffix.lower()
    vertices, triangles, values = split(mesh, HOLDS[extension])
    made = trimesh.Trimesh(vertices, triangles, process=False, vertex_normals=values.get("normals"))
    colours = _bytes(values["colours"]) if "colours" in values else None
    if "UVs" in values or (mesh.material is not None and extension == ".glb"):
        material = mesh.material or trimesh.visual.material.PBRMaterial()
        made.visual = trimesh.visual.TextureVisuals(uv=values.get("UVs"), material=material)
        if colours is not None:
            made.visual.vertex_attributes["color"] = colours
    elif colours is not None:
        made.visual = trimesh.visual.ColorVisuals(made, vertex_colors=colours)
    scene = trimesh.Scene({mesh.name: made})
    if extension == ".3mf":
        data = scene.export(file_type="3mf")
        Path(path).write_bytes(_in_unit(data, mesh.unit) if mesh.unit else data)
        return

    def add_deviation(document):
        for node in document["nodes"]:
            if "mesh" in node and mesh.deviation is not None:
                node["extras"] = {GEOMETRIC_ERROR: mesh.deviation}

    Path(path).write_bytes(scene.export(file_type="glb", tree_postprocessor=add_deviation))


def _bytes(colours):
    """Returns colours as (n, 4) uint8."""
    whole = colours if colours.dtype == np.uint8 else np.rint(255 * np.clip(colours, 0, 1)).astype(np.uint8)
    return np.pad(whole, ((0, 0), (0, 4 - whole.shape[1])), constant_values=255)


def _in_unit(data, unit):
    """Returns a .3mf file in this unit. trimesh writes the numbers as they are, and says that they are millimetres."""
    changed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(changed, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            content = old.read(name)
            if name.lower() == "3d/3dmodel.model":
                content = content.replace(b' unit="millimeter"', f' unit="{unit.rstrip("s")}"'.encode(), 1)
            new.writestr(name, content)
    return changed.getvalue()
