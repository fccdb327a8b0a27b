# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads, decimates and writes the mesh of a file without Blender.

shared/command/decimate.py describes the functions. All meshes of a file are read as one.
"""

import dataclasses
from pathlib import Path

import numpy as np

from ..shared import islands
from ..shared.decimation import Task, hole_options
from ..shared.errors import Refused
from ..shared.files import file_check
from ..shared.surface import MeshArrays, Surface
from . import plain_formats, scene_formats
from .mesh import Mesh, carried
from .progress_bar import followed

EXTENSIONS = tuple(sorted((*plain_formats.EXTENSIONS, *scene_formats.EXTENSIONS)))
FORMATS = f"Formats: {' '.join(EXTENSIONS)}. All meshes of a file are read as one."
_HOLDS = plain_formats.HOLDS | scene_formats.HOLDS
_FLOAT32 = (".glb", ".stl")  # the formats that hold no other coordinates
_PLACEMENT = {True: "subset", False: "optimal"}  # with and without UVs, as in Blender


@dataclasses.dataclass(frozen=True)
class MeshFile:
    """The mesh of a file, and a record of what was done to its faces when it was read."""

    path: str
    objects: list
    repairs: list
    extras: dict  # the number of things in the file that are not meshes, by kind, such as {"skins": 1}
    counts: dict


def extension_of(path):
    """Returns the extension of a path. Raises Refused for one that is not in EXTENSIONS, and lists those."""
    return file_check.known_extension(path, EXTENSIONS)


def clear():
    """There is no scene to empty: a mesh is forgotten when nothing names it any more."""


def read(path):
    """Returns the MeshFile of a file. Raises Refused, which names the file and what is wrong with it."""
    extension, name, extras = extension_of(path), Path(path).stem, {}
    data = file_check.data_of(path)
    try:
        if not data:
            raise Refused("the file is empty")
        if extension in plain_formats.EXTENSIONS:
            mesh, remarks = plain_formats.read(name, extension, data)
        else:
            mesh, remarks, extras = scene_formats.read(name, extension, data, Path(path).parent)
        if not len(mesh.triangles):
            raise Refused("the file has no faces")
    except Refused as error:
        raise Refused(f"{path}: {error}") from None
    repairs = [{"kind": "read", "count": count, "message": f"{Path(path).name}: {text}"} for count, text in remarks]
    counts = {"vertices": len(mesh.vertices), "triangles": len(mesh.triangles)}
    return MeshFile(str(path), [mesh], repairs, extras, counts)


def surface_of(mesh):
    corners = np.arange(3 * len(mesh.triangles), dtype=np.int32).reshape(-1, 3)
    polygons = np.arange(len(mesh.triangles), dtype=np.int32) if mesh.polygons is None else mesh.polygons
    return Surface(MeshArrays(mesh.vertices, mesh.triangles, corners, polygons), np.eye(4))


def object_of(surface):
    return Mesh("reference", surface.world(), surface.arrays.triangles)


def rounding(path, meshes):
    if Path(path).suffix.lower() not in _FLOAT32:
        return 0.0
    wide = [mesh.vertices for mesh in meshes if mesh.vertices.dtype == np.float64]
    # Rounding moves a coordinate by at most half an eps of itself; a whole one leaves room for vertices that move outwards.
    reach = max((float(np.abs(points).max(initial=0)) for points in wide), default=0.0)
    return 3**0.5 * float(np.finfo(np.float32).eps) * reach


def decimate(mesh, reference, tolerance, target, options, largest_perimeter):
    asked = {
        "placement": options.placement or _PLACEMENT["UVs" in mesh.attributes],
        "two_sided": not options.one_sided,
        "effort": options.effort,
        "crossings": options.crossings,
        "max_normal_angle": options.max_normal_angle,
        "max_seconds": options.max_seconds,
        "target_triangles": target,
        "outside": options.outside,
        "threads": options.threads,
    }
    task = Task(mesh.name, surface_of(mesh), surface_of(reference), tolerance, asked)
    if "UVs" in mesh.attributes:
        uvs = mesh.attributes["UVs"]
        task.uvs = islands.without_rounding(uvs.values[uvs.index.ravel()], mesh.triangles.ravel())
    if options.close_holes:
        task.close_holes = hole_options(largest_perimeter, options.max_normal_angle)
    arrays, _, result, run = followed(mesh.name, task.run)
    mesh.attributes = carried(mesh, arrays.corners, result)
    mesh.vertices, mesh.triangles, mesh.polygons = result.vertices, result.triangles, None
    holds = _HOLDS[extension_of(options.output)]
    lost = [*mesh.others, *(name for name in mesh.attributes if name not in holds)]
    if mesh.material is not None and extension_of(options.output) != ".glb":
        lost.append("materials")
    if lost:
        message = f"{Path(options.output).name} is without {', '.join(dict.fromkeys(lost))}"
        run["repairs"].append({"kind": "left out", "count": len(lost), "message": message})
    return run


def note_deviation(mesh, length):
    mesh.deviation = length


def write(path, meshes, folder):
    (mesh,) = meshes
    module = plain_formats if Path(path).suffix.lower() in plain_formats.EXTENSIONS else scene_formats
    module.write(Path(path), mesh)
