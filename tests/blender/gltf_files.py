# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes glTF files, and reads them by a small reader in this file, not by Blender."""

import json
import struct
from urllib.parse import unquote

import bpy
import numpy as np
import pytest

from commands import READS_GLTF
from scenes import torus_arrays

needs_gltf = pytest.mark.skipif(not READS_GLTF, reason="this Blender cannot read glTF with its NumPy")
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
TURN = [0, np.sin(0.3), 0, np.cos(0.3)]


def document(vertices=SQUARE, triangles=((0, 1, 2), (0, 2, 3)), nodes=None, uvs=None, image=None):
    """Returns (the JSON document of a mesh, its buffer)."""
    arrays = [np.asarray(triangles, np.uint32).ravel(), np.asarray(vertices, np.float32)]
    attributes = {"POSITION": 1}
    if uvs is not None:
        arrays.append(np.asarray(uvs, np.float32))
        attributes["TEXCOORD_0"] = 2
    views, accessors, binary = [], [], b""
    for array in arrays:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes})
        accessors.append(
            {
                "bufferView": len(accessors),
                "componentType": 5125 if array.ndim == 1 else 5126,
                "count": len(array),
                "type": "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}",
            }
        )
        binary += array.tobytes()
    accessors[1] |= {"min": arrays[1].min(0).tolist(), "max": arrays[1].max(0).tolist()}
    primitive = {"attributes": attributes, "indices": 0}
    found = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "nodes": nodes or [{"mesh": 0, "name": "part"}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    below = {child for node in found["nodes"] for child in node.get("children", ())}
    found["scenes"] = [{"nodes": [number for number in range(len(found["nodes"])) if number not in below]}]
    if image:
        primitive["material"] = 0
        found |= {
            "images": [{"uri": image}],
            "textures": [{"source": 0}],
            "materials": [{"name": "red", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        }
    return found, binary


def glb(found, binary):
    text = json.dumps(found).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def write(path, found, binary):
    if path.suffix == ".glb":
        path.write_bytes(glb(found, binary))
    else:
        path.with_suffix(".bin").write_bytes(binary)
        found["buffers"][0]["uri"] = path.with_suffix(".bin").name
        path.write_text(json.dumps(found))
    return path


def matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = turn * node.get("scale", (1, 1, 1)), node.get("translation", (0, 0, 0))
    return found


def parsed(path):
    """Returns (vertices, triangles) of all nodes, in the coordinates of the file."""
    data = path.read_bytes()
    if data[:4] == b"glTF":
        size = struct.unpack_from("<I", data, 12)[0]
        found, binary = json.loads(data[20 : 20 + size]), data[28 + size :]
    else:
        found = json.loads(data)
        binary = (path.parent / unquote(found["buffers"][0]["uri"])).read_bytes()

    def array(index):
        accessor = found["accessors"][index]
        view = found["bufferViews"][accessor["bufferView"]]
        kind = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(binary, kind, accessor["count"] * width, start).reshape(-1, width)

    vertices, triangles, count = [], [], 0

    def visit(number, above):
        nonlocal count
        node = found["nodes"][number]
        place = above @ matrix(node)
        for primitive in found["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            corners = array(primitive["attributes"]["POSITION"]).astype(np.float64)
            vertices.append(corners @ place[:3, :3].T + place[:3, 3])
            triangles.append(array(primitive["indices"]).reshape(-1, 3).astype(np.int64) + count)
            count += len(corners)
        for child in node.get("children", ()):
            visit(child, place)

    for number in found["scenes"][found.get("scene", 0)]["nodes"]:
        visit(number, np.eye(4))
    return np.concatenate(vertices), np.concatenate(triangles)


def torus_document(**options):
    vertices, quads = torus_arrays()
    return document(vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), **options)


def picture(path, colour):
    image = bpy.data.images.new(path.name, 4, 4)
    image.pixels.foreach_set(np.tile(np.array([*colour, 1], np.float32), 16))
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    return path.read_bytes()
