# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF files are checked before Blender reads them: faces are counted, and bad files refused."""

import base64
import json
import struct

import numpy as np
import pytest

from addon.shared.errors import Refused
from addon.shared.files import file_check
from gltf_files import SQUARE, document, glb


def checked(found, binary, tmp_path):
    return file_check.check(".glb", glb(found, binary), tmp_path).faces


def test_faces_are_counted(tmp_path):
    found, binary = document()
    assert checked(found, binary, tmp_path) == 2
    found["nodes"] = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0}]
    assert checked(found, binary, tmp_path) == 4
    found["nodes"] = [{"mesh": 0}]
    for mode, faces in ((0, 0), (1, 0), (4, 2), (5, 4), (6, 4)):
        found["meshes"][0]["primitives"][0]["mode"] = mode
        assert checked(found, binary, tmp_path) == faces
    del found["meshes"][0]["primitives"][0]["indices"]
    assert checked(found, binary, tmp_path) == 2
    found["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    assert file_check.check(".gltf", json.dumps(found).encode(), tmp_path).faces == 2
    found["buffers"][0]["uri"] = "a%20b.bin"
    (tmp_path / "a b.bin").write_bytes(binary)
    assert file_check.check(".gltf", json.dumps(found).encode(), tmp_path).faces == 2


def set_at(path, value):
    def change(found):
        place = found
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = value

    return change


BAD_DOCUMENTS = {
    "no asset": (lambda found: found.pop("asset"), "no asset"),
    "old": (set_at(["asset", "version"], "1.0"), "version is 1.0"),
    "no buffer": (set_at(["buffers", 0, "uri"], "no.bin"), "no.bin cannot be read: No such file"),
    "bad data": (set_at(["buffers", 0, "uri"], "data:;base64,A"), "buffer 0 cannot be read"),
    "short buffer": (set_at(["buffers", 0, "byteLength"], 999), "is truncated"),
    "short view": (set_at(["bufferViews", 1, "byteLength"], 9), "accessor 1 reaches beyond"),
    "long view": (set_at(["bufferViews", 1, "byteLength"], 9999), "accessor 1 reaches beyond"),
    "many": (set_at(["accessors", 1, "count"], 10**12), "accessor 1 reaches beyond"),
    "negative": (set_at(["accessors", 1, "count"], -1), "count of -1"),
    "stride": (set_at(["bufferViews", 1, "byteStride"], 4), "accessor 1 reaches beyond"),
    "no accessor": (set_at(["meshes", 0, "primitives", 0, "indices"], 7), "mesh 0 names entry 7 of its accessors"),
    "no view": (set_at(["accessors", 0, "bufferView"], 7), "accessor 0 names entry 7 of its bufferViews"),
    "no mesh": (set_at(["nodes", 0, "mesh"], 3), "a node names entry 3 of its meshes"),
    "no node": (set_at(["nodes", 0, "children"], [5]), "node 0 names entry 5 of its nodes"),
    "below itself": (set_at(["nodes"], [{"children": [1]}, {"children": [0]}]), "node . is its own descendant"),
    "two above": (
        set_at(["nodes"], [{"children": [2]}, {"children": [2]}, {}]),
        "node 2 is a child of two nodes, 0 and 1",
    ),
    "far node": (
        set_at(["nodes", 0, "translation"], [0, 1e999, 0]),
        "translation, rotation or scale of node 0 is not finite",
    ),
    "kind": (
        set_at(["accessors", 1, "type"], "VEC2"),
        "accessor 1 of mesh 0 has type VEC2 with component type 5126; type VEC3",
    ),
    "form": (set_at(["meshes", 0, "primitives"], 3), "form of glTF"),
    "few vertices": (set_at(["accessors", 1, "count"], 3), "a face of mesh 0 names vertex 3, but there are only 3"),
}


@pytest.mark.parametrize("name", BAD_DOCUMENTS)
def test_bad_documents(tmp_path, name):
    change, words = BAD_DOCUMENTS[name]
    found, binary = document()
    change(found)
    with pytest.raises(Refused, match=words):
        checked(found, binary, tmp_path)


@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_vertices_are_finite(tmp_path, value):
    vertices = SQUARE.copy()
    vertices[2, 1] = value
    found, binary = document(vertices)
    found["accessors"][1] |= {"min": [0, 0, 0], "max": [1, 1, 0]}
    with pytest.raises(Refused, match="vertex 3 of mesh 0 is not finite"):
        checked(found, binary, tmp_path)
    # The bad coordinate may also be in a sparse accessor, whose entries replace others.
    found, binary = document()
    binary += np.array([1], np.uint32).tobytes() + np.array([0, value, 0], np.float32).tobytes()
    found["buffers"][0]["byteLength"] = len(binary)
    start = len(binary) - 16
    found["bufferViews"] += [{"buffer": 0, "byteOffset": start + at, "byteLength": 12} for at in (0, 4)]
    sparse = {"count": 1, "indices": {"bufferView": 2, "componentType": 5125}, "values": {"bufferView": 3}}
    found["accessors"][1]["sparse"] = sparse
    with pytest.raises(Refused, match="vertex 2 of mesh 0 is not finite"):
        checked(found, binary, tmp_path)


def test_truncated_and_foreign_files(tmp_path):
    whole = glb(*document())
    for data, words in (
        (b"", "empty"),
        (whole[:10], "ends inside its glTF header"),
        (whole[:-1], "is truncated"),
        (whole[:8] + struct.pack("<I", 60) + whole[12:60], "ends inside one of its glTF chunks"),
        (whole[:4] + struct.pack("<I", 1) + whole[8:], "version is 1"),
        (bytes(range(256)), "not a glTF file"),
        (b"[1, 2]", "no asset"),
        (b'{"asset": {"version": "2.0"', "not a glTF file, or it is truncated"),
        (b"[" * 100_000, "not a glTF file"),
    ):
        with pytest.raises(Refused, match=words):
            file_check.check(".gltf", data, tmp_path)
    assert file_check.check(".gltf", b'{"asset": {"version": "2.0"}}', tmp_path).faces == 0
