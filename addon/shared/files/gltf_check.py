# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds damage in a glTF 2.0 file (.gltf or .glb) that Blender's reader does not report or reports by a traceback.

The checks follow the specification: https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
"""

import base64
import binascii
import json
import math
import struct
from urllib.parse import unquote

import numpy as np

from ..errors import Refused

_JSON, _BIN = 0x4E4F534A, 0x004E4942
_COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_INDICES = (5121, 5123, 5125)
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_LARGEST = float(np.finfo(np.float32).max)


def check(data, folder):
    """Returns the number of faces that the nodes show. `folder` holds the files that buffers name.

    Raises Refused with a message that says what is wrong and does not name the file.
    """
    document, binary = parts(data)
    try:
        return _Document(document, binary, folder).faces()
    except (AttributeError, KeyError, TypeError, ValueError, MemoryError) as error:
        raise Refused(f"its JSON does not have the form of glTF ({type(error).__name__}: {error})") from None


def parts(data):
    """Returns (the JSON document, the binary chunk or None) of a .gltf or .glb file."""
    binary = None
    if data[:4] == b"glTF":
        data, binary = _chunks(data)
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise Refused(f"this is not a glTF file, or it is truncated: {error}") from None
    if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
        raise Refused("this is not a glTF file: its JSON has no asset")
    version = document["asset"].get("version")
    if not str(version).startswith("2."):
        raise Refused(f"its glTF version is {version}, not 2.0")
    return document, binary


def extras(data):
    """Returns the numbers of skins, animations and cameras in a file."""
    document, _ = parts(data)
    return {kind: len(document.get(kind, ())) for kind in ("skins", "animations", "cameras")}


def _chunks(data):
    found, offset = {}, 12
    if len(data) < 20:
        raise Refused("the file ends inside its glTF header")
    _, version, length = struct.unpack_from("<4sII", data)
    if version != 2:
        raise Refused(f"its glTF version is {version}, not 2.0")
    if length > len(data):
        raise Refused(f"the file is truncated: it has {len(data):,} of the {length:,} bytes that its header declares")
    while offset + 8 <= length:
        size, kind = struct.unpack_from("<II", data, offset)
        if offset + 8 + size > length:
            raise Refused("the file ends inside one of its glTF chunks")
        found.setdefault(kind, data[offset + 8 : offset + 8 + size])
        offset += 8 + size
    if _JSON not in found:
        raise Refused("this is not a glTF file: it has no JSON chunk")
    return found[_JSON], found.get(_BIN)


class _Document:
    def __init__(self, document, binary, folder):
        self._document = document
        self._binary = binary
        self._folder = folder
        self._buffers = {}
        self._meshes = {}

    def faces(self):
        nodes = self._document.get("nodes", [])
        self._require_tree(nodes)
        count = 0
        for number, node in enumerate(nodes):
            numbers = [x for key in ("matrix", "translation", "rotation", "scale") for x in node.get(key, ())]
            if not all(math.isfinite(x) for x in numbers):
                raise Refused(f"the matrix, translation, rotation or scale of node {number} is not finite")
            if "mesh" in node:
                count += self._mesh(node["mesh"])
        return count

    def _entry(self, kind, index, asker):
        entries = self._document.get(kind, [])
        if not isinstance(index, int) or not 0 <= index < len(entries):
            raise Refused(f"{asker} names entry {index} of its {kind}, but there are only {len(entries)}")
        return entries[index]

    def _require_tree(self, nodes):
        """Requires that no node is its own descendant: Blender's reader would never end."""
        parents = {}
        for number, node in enumerate(nodes):
            for child in node.get("children", ()):
                self._entry("nodes", child, f"node {number}")
                if parents.setdefault(child, number) != number:
                    raise Refused(f"node {child} is a child of two nodes, {parents[child]} and {number}")
        safe = set()
        for start in range(len(nodes)):
            path, node = [], start
            while node is not None and node not in safe:
                if len(path) > len(nodes):
                    raise Refused(f"node {node} is its own descendant")
                path.append(node)
                node = parents.get(node)
            safe.update(path)

    def _mesh(self, index):
        if index not in self._meshes:
            mesh = self._entry("meshes", index, "a node")
            self._meshes[index] = sum(
                self._primitive(primitive, f"mesh {index}") for primitive in mesh.get("primitives", ())
            )
        return self._meshes[index]

    def _primitive(self, primitive, mesh):
        mode = primitive.get("mode", 4)
        places = primitive.get("attributes", {}).get("POSITION")
        if places is None or mode not in (4, 5, 6):  # The other modes are points and lines, which have no faces.
            return 0
        if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):  # Only Blender's reader can unpack Draco.
            corners = self._entry("accessors", primitive.get("indices", places), mesh)["count"]
        else:
            corners = self._geometry(primitive, places, mesh)
        return corners // 3 if mode == 4 else max(corners - 2, 0)

    def _geometry(self, primitive, places, mesh):
        """Checks coordinates and indices of a primitive and returns the number of corners that it lists."""
        for index in (places, *(target["POSITION"] for target in primitive.get("targets", ()) if "POSITION" in target)):
            coordinates = self._accessor(index, mesh, "VEC3", (5126,))
            bad = np.flatnonzero(~(np.abs(coordinates) <= _LARGEST).all(1))
            if len(bad):
                shown = ", ".join(f"{value:g}" for value in coordinates[bad[0]])
                raise Refused(f"vertex {bad[0] + 1} of {mesh} is not finite ({shown})")
        count = self._entry("accessors", places, mesh)["count"]
        if "indices" not in primitive:
            return count
        indices = self._accessor(primitive["indices"], mesh, "SCALAR", _INDICES)
        if len(indices) and indices.max() >= count:
            raise Refused(f"a face of {mesh} names vertex {indices.max()}, but there are only {count} vertices")
        return len(indices)

    def _accessor(self, index, asker, kind, components):
        """Returns the values of an accessor, (count, width)."""
        accessor = self._entry("accessors", index, asker)
        name = f"accessor {index}"
        if accessor.get("type") != kind or accessor.get("componentType") not in components:
            raise Refused(
                f"{name} of {asker} has type {accessor.get('type')} with component type "
                f"{accessor.get('componentType')}; type {kind} is needed, with a component type that glTF permits there"
            )
        dtype, width, count = np.dtype(_COMPONENTS[accessor["componentType"]]), _WIDTHS[kind], accessor["count"]
        if not isinstance(count, int) or count < 0:
            raise Refused(f"{name} has a count of {count}")
        if "bufferView" in accessor:
            start = accessor.get("byteOffset", 0)
            values = self._view(accessor["bufferView"], start, count, dtype, width, name)
        else:
            values = np.zeros((count, width), dtype)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            where, new = sparse["indices"], sparse["values"]
            kind = np.dtype(_COMPONENTS[where["componentType"]])
            rows = self._view(where["bufferView"], where.get("byteOffset", 0), sparse["count"], kind, 1, name)[:, 0]
            if len(rows) and rows.max() >= count:
                raise Refused(f"{name} replaces its entry {rows.max()}, but it has only {count} entries")
            values = values.copy()
            values[rows] = self._view(new["bufferView"], new.get("byteOffset", 0), sparse["count"], dtype, width, name)
        return values

    def _view(self, index, start, count, dtype, width, asker):
        view = self._entry("bufferViews", index, asker)
        buffer = self._buffer(view["buffer"], f"buffer view {index}")
        row = dtype.itemsize * width
        stride = view.get("byteStride", row)
        begin, length = view.get("byteOffset", 0), view["byteLength"]
        needed = start + stride * (count - 1) + row if count else 0
        if min(begin, start, length, count) < 0 or stride < row or needed > length or begin + length > len(buffer):
            raise Refused(f"{asker} reaches beyond the end of its buffer: the file is truncated or damaged")
        return np.ndarray((count, width), dtype, buffer, begin + start, (stride, dtype.itemsize))

    def _buffer(self, index, asker):
        if index not in self._buffers:
            buffer = self._entry("buffers", index, asker)
            data = self._content(buffer.get("uri"), index)
            if len(data) < buffer["byteLength"]:
                raise Refused(
                    f"its buffer {index} is truncated: it has {len(data):,} of {buffer['byteLength']:,} bytes"
                )
            self._buffers[index] = data
        return self._buffers[index]

    def _content(self, uri, index):
        if uri is None:
            if index or self._binary is None:
                raise Refused(f"its buffer {index} is missing")
            return self._binary
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2])
            except binascii.Error as error:
                raise Refused(f"its buffer {index} cannot be read: {error}") from None
        try:
            return (self._folder / unquote(uri)).read_bytes()
        except OSError as error:
            raise Refused(f"its buffer {unquote(uri)} cannot be read: {error.strerror}") from None
