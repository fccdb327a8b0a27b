# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and writes .ply, .stl, .obj and .off files by NumPy."""

import numpy as np

from ..shared.files import obj_file, ply_file, stl_file
from . import off_file
from .mesh import Attribute, Mesh, split, weld
from .polygons import triangulated

EXTENSIONS = (".obj", ".off", ".ply", ".stl")
# What each format holds besides vertices and faces.
HOLDS = {".obj": ("UVs", "normals", "colours"), ".off": (), ".ply": ("normals", "colours", "UVs"), ".stl": ()}

_UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_BLOCK = 1 << 13  # triangles of an STL file that are written at once, because they stay in the cache
_NORMALS, _COLOURS = ("nx", "ny", "nz"), ("red", "green", "blue", "alpha")


def read(name, extension, data):
    """Returns (Mesh, [remarks about what was done to the faces]). Raises Refused, which does not name the file."""
    content = _read(extension, data)
    corners = content.corners.astype(np.int32)
    places, polygons = triangulated(content.vertices, corners, content.sizes)
    triangles, remarks = corners[places], []
    sizes = np.broadcast_to(content.sizes, content.faces)
    if few := int((sizes < 3).sum()):
        remarks.append((few, f"{few:,} faces with fewer than three corners were left out"))
    if more := int((sizes > 3).sum()):
        remarks.append((more, f"{more:,} faces with more than three corners were cut into triangles"))
    attributes, others = _attributes(content, triangles, places)
    mesh = Mesh(name, content.vertices, triangles, attributes, polygons, others=(*content.others, *others))
    # A file with a vertex for each UV has its seams open, and a soup has nothing but seams.
    if extension == ".stl" or "UVs" in attributes:
        before = len(mesh.vertices)
        mesh = weld(mesh)
        if extension == ".stl":
            remarks.append((before, f"{before:,} corners were welded to {len(mesh.vertices):,} vertices by position"))
    return mesh, remarks


def _read(extension, data):
    if extension == ".obj":
        return obj_file.read(data, attributes=True)
    return {".off": off_file, ".ply": ply_file, ".stl": stl_file}[extension].read(data)


def _colours(channels):
    """Returns the colours of the vertices, uint8 if all channels are whole numbers, else float32 from 0 to 1.

    Whole numbers go from 0 to 255, others from 0 to 1. It returns None if a number is beyond that.
    """
    whole = [channel.dtype.kind in "iu" for channel in channels]
    for channel, is_whole in zip(channels, whole):
        if channel.min(initial=0) < 0 or channel.max(initial=0) > (255 if is_whole else 1 + 1 / 255):
            return None
    if all(whole):
        return np.stack(channels, 1).astype(np.uint8)
    return np.stack([channel / (255 if each else 1) for channel, each in zip(channels, whole)], 1).astype(np.float32)


def _attributes(content, triangles, places):
    """Returns (attributes, a list of words for what is left out)."""
    columns, found, others = dict(content.columns), {}, []
    for kind, *choices in (("normals", _NORMALS), ("colours", _COLOURS, _COLOURS[:3]), ("UVs", *_UVS)):
        names = next((names for names in choices if all(name in columns for name in names)), None)
        if names:
            channels = [columns.pop(name) for name in names]
            values = _colours(channels) if kind == "colours" else np.stack(channels, 1).astype(np.float32)
            if values is None:
                others.append("its colours, some of which are beyond their range")
            else:
                found[kind] = Attribute(values, triangles)
    for kind, pair in (("UVs", content.uvs), ("normals", content.normals)):
        if pair is not None:
            found[kind] = Attribute(pair[0], pair[1][places].astype(np.int32), split=True)
    if columns:
        others.append(f"the numbers {', '.join(columns)} of its vertices")
    return found, others


def write(path, mesh):
    """Writes a file, in the format of its extension. Coordinates are exact, except that .stl holds float32."""
    {".obj": _obj, ".off": _off, ".ply": _ply, ".stl": _stl}[path.suffix.lower()](path, mesh)


def _ply(path, mesh):
    vertices, triangles, values = split(mesh, HOLDS[".ply"])
    kind = "double" if vertices.dtype == np.float64 else "float"
    row = [(name, "<f8" if kind == "double" else "<f4", kind) for name in "xyz"]
    columns = list(vertices.T)
    for attribute, names in (("normals", _NORMALS), ("colours", _COLOURS), ("UVs", _UVS[0])):
        if attribute in values:
            byte = values[attribute].dtype == np.uint8
            width = values[attribute].shape[1]
            row += [(name, "u1" if byte else "<f4", "uchar" if byte else "float") for name in names[:width]]
            columns += list(values[attribute].T[: len(names)])
    rows = np.empty(len(vertices), np.dtype([(name, dtype) for name, dtype, _ in row]))
    for (name, _, _), column in zip(row, columns):
        rows[name] = column
    faces = np.empty(len(triangles), np.dtype([("size", "u1"), ("corners", "<i4", 3)]))
    faces["size"], faces["corners"] = 3, triangles
    header = "\n".join(
        [
            "ply\nformat binary_little_endian 1.0",
            f"element vertex {len(rows)}",
            *(f"property {kind} {name}" for name, _, kind in row),
            f"element face {len(faces)}",
            "property list uchar int vertex_indices\nend_header\n",
        ]
    )
    with open(path, "wb") as file:
        file.write(header.encode())
        file.write(rows.tobytes())
        file.write(faces.tobytes())


def _stl(path, mesh):
    with open(path, "wb") as file:
        file.write(b"Tolerance Volumes".ljust(80))
        file.write(np.uint32(len(mesh.triangles)).tobytes())
        for first in range(0, len(mesh.triangles), _BLOCK):
            file.write(_facets(mesh.vertices[mesh.triangles[first : first + _BLOCK]].astype(np.float32)))


def _facets(corners):
    """Returns the rows of an STL file for triangles, (m, 3, 3) float32. The normal of one without an area is zero."""
    rows = np.zeros(len(corners), stl_file.TRIANGLE)
    wide = corners.astype(np.float64)
    normals = np.cross(wide[:, 1] - wide[:, 0], wide[:, 2] - wide[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    rows["corners"], rows["normal"] = corners, np.divide(normals, length, where=length > 0, out=np.zeros_like(normals))
    return rows


def _off(path, mesh):
    with open(path, "w") as file:
        file.write(f"OFF\n{len(mesh.vertices)} {len(mesh.triangles)} 0\n")
        file.writelines(f"{x!r} {y!r} {z!r}\n" for x, y, z in mesh.vertices.tolist())
        file.writelines(f"3 {a} {b} {c}\n" for a, b, c in mesh.triangles.tolist())


def _obj(path, mesh):
    """Writes each number as the shortest decimal that is read back as the same double."""
    uvs, normals, colours = (mesh.attributes.get(name) for name in ("UVs", "normals", "colours"))
    rows = mesh.vertices.astype(np.float64)
    if colours is not None:  # OBJ has them after the coordinates, from 0 to 1, and without transparency.
        values = colours.values[:, :3] / (255 if colours.values.dtype == np.uint8 else 1)
        at = np.zeros((len(rows), 3))
        at[mesh.triangles.ravel()] = values[colours.index.ravel()]
        rows = np.concatenate([rows, at.round(6)], 1)
    indices = [mesh.triangles + 1] + [None if kept is None else kept.index + 1 for kept in (uvs, normals)]
    form = {(0, 0): "{0}", (1, 0): "{0}/{1}", (0, 1): "{0}//{2}", (1, 1): "{0}/{1}/{2}"}
    form = form[uvs is not None, normals is not None]
    columns = [np.zeros(3 * len(mesh.triangles), int) if index is None else index.ravel() for index in indices]
    corners = [form.format(*corner) for corner in zip(*(column.tolist() for column in columns))]
    with open(path, "w") as file:
        for key, values in (("v", rows), ("vt", uvs and uvs.values), ("vn", normals and normals.values)):
            if values is not None:
                file.writelines(f"{key} {' '.join(map(repr, row))}\n" for row in values.tolist())
        file.writelines(f"f {' '.join(corners[i : i + 3])}\n" for i in range(0, len(corners), 3))
