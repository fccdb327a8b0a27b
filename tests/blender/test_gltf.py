# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF files: written files are read by a small reader in this file, not by Blender; and bad files are refused."""

import base64
import json
import stat
import struct
from urllib.parse import unquote

import bpy
import numpy as np
import pytest

from addon import native
from addon.shared.errors import Refused
from addon.shared.files import file_check, side_files
from commands import READS_GLTF, command, decimate, save, succeeded, world
from scenes import assert_within, torus_arrays

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


def judged(surface, reference, tolerance):
    for pair in ((surface, reference), (reference, surface)):
        assert native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance).upper <= tolerance


def picture(path, colour):
    image = bpy.data.images.new(path.name, 4, 4)
    image.pixels.foreach_set(np.tile(np.array([*colour, 1], np.float32), 16))
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    return path.read_bytes()


# Reading and writing ------------------------------------------------------------------------------------------------


@needs_gltf
@pytest.mark.parametrize(("into", "out"), [(".glb", ".gltf"), (".gltf", ".glb")])
def test_gltf_in_and_out(tmp_path, into, out):
    """The file has two instances of a mesh that are moved, turned and scaled, below nodes that are so, too."""
    nodes = [
        {"name": "root", "translation": [5, -3, 2], "rotation": TURN, "children": [1, 2]},
        {"name": "first", "mesh": 0, "scale": [1, 2, 0.5]},
        {"name": "second", "mesh": 0, "translation": [0, 4, 0], "rotation": [0.6, 0, 0, 0.8]},
    ]
    source, target = write(tmp_path / f"in{into}", *torus_document(nodes=nodes)), tmp_path / f"out{out}"
    match = succeeded(decimate(source, target, "--tolerance", "1%", "--report", tmp_path / "r.json"))
    reference, stored = parsed(source), parsed(target)
    assert len(reference[1]) == 2 * 2304 and len(stored[1]) == int(match[2].replace(",", "")) < 700
    run = json.loads((tmp_path / "r.json").read_text())
    assert run["tolerance"]["absolute"] == pytest.approx(0.01 * native.module.diagonal(*reference), rel=1e-5)
    # Blender stores the placement of nodes in float32.
    judged(stored, reference, run["tolerance"]["absolute"] * (1 + 1e-5))
    assert sorted(part["name"] for part in run["objects"]) == ["first", "second"] and not run["repairs"]


@needs_gltf
@pytest.mark.parametrize(("into", "out"), [(".glb", ".ply"), (".ply", ".glb"), (".obj", ".gltf"), (".gltf", ".stl")])
def test_no_format_turns_the_axes(tmp_path, into, out):
    vertices, quads = torus_arrays()
    if into in (".glb", ".gltf"):
        source = write(tmp_path / f"in{into}", *torus_document())
    else:
        source = save(tmp_path / f"in{into}", ("torus", vertices, quads))
    target = tmp_path / f"out{out}"
    succeeded(decimate(source, target, "--tolerance", "1%"))
    reference, stored = (parsed(path) if path.suffix in (".glb", ".gltf") else world(path) for path in (source, target))
    judged(stored, reference, 0.01 * native.module.diagonal(*reference) * (1 + 1e-5))
    assert_within(stored, (vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])), 0.037)
    code, out, err = command("report.py", target, source, "--tolerance", "1.001%")
    assert (code, err) == (0, "") and out.count("0.000 % beyond") == 2


@needs_gltf
def test_in_may_be_out_with_its_buffer(tmp_path):
    source = write(tmp_path / "in.gltf", *torus_document())
    reference = parsed(source)
    source.chmod(0o640)
    succeeded(decimate(source, source, "--tolerance", "1%"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.bin", "in.gltf"]
    judged(parsed(source), reference, 0.01 * native.module.diagonal(*reference) * (1 + 1e-5))
    assert stat.S_IMODE(source.stat().st_mode) == 0o640


@needs_gltf
def test_textures_beside_out_are_never_overwritten(tmp_path):
    vertices, quads = torus_arrays()
    uvs = vertices[:, :2] / 4 + 0.5
    source = write(tmp_path / "in.gltf", *torus_document(uvs=uvs, image="my%20skin.png"))
    skin = picture(tmp_path / "my skin.png", (1, 0, 0))
    other = tmp_path / "other"
    other.mkdir()
    strange = picture(other / "my skin.png", (0, 0, 1))
    inode = (tmp_path / "my skin.png").stat().st_ino
    for _ in range(2):  # In the second run all files exist already.
        for folder, texture in ((tmp_path, "my skin.png"), (other, "my skin-2.png")):
            succeeded(decimate(source, folder / "out.gltf", "--tolerance", "1%"))
            (uri,) = [image["uri"] for image in json.loads((folder / "out.gltf").read_text())["images"]]
            assert unquote(uri) == texture and (folder / texture).read_bytes() == skin
    assert (other / "my skin.png").read_bytes() == strange
    assert (tmp_path / "my skin.png").stat().st_ino == inode
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "in.bin", "in.gltf", "my skin.png", "other", "out.bin", "out.gltf"
    ]  # fmt: skip
    assert sorted(path.name for path in other.iterdir()) == ["my skin-2.png", "my skin.png", "out.bin", "out.gltf"]


@needs_gltf
def test_bones_are_no_meshes_and_what_is_lost_is_said(tmp_path):
    """Blender's reader adds meshes of its own to draw bones: they are not written."""
    found, binary = torus_document(nodes=[{"mesh": 0, "skin": 0, "name": "part"}, {"name": "bone"}])
    attributes, count = found["meshes"][0]["primitives"][0]["attributes"], found["accessors"][1]["count"]
    for name, kind, array in (
        ("JOINTS_0", 5121, np.zeros((count, 4), "u1")),
        ("WEIGHTS_0", 5126, np.eye(4)[[0] * count]),
    ):
        data = array.astype("<f4" if kind == 5126 else "u1").tobytes()
        found["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        attributes[name] = len(found["accessors"])
        found["accessors"].append(
            {"bufferView": attributes[name], "componentType": kind, "count": count, "type": "VEC4"}
        )
        binary += data
    found["buffers"][0]["byteLength"] = len(binary)
    found |= {"skins": [{"joints": [1]}], "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]}
    source = write(tmp_path / "in.glb", found, binary)
    done = decimate(source, tmp_path / "out.glb", "--tolerance", "1%", "--report", tmp_path / "r.json")
    succeeded(done)
    judged(parsed(tmp_path / "out.glb"), parsed(source), 0.01 * native.module.diagonal(*parsed(source)) * (1 + 1e-5))
    run = json.loads((tmp_path / "r.json").read_text())
    assert [part["name"] for part in run["objects"]] == ["part"]
    assert {"note: 1 of the 1 skins of IN are not in OUT", "note: 1 of the 1 cameras of IN are not in OUT"} <= set(
        done[1].splitlines()
    )


@needs_gltf
def test_the_buffer_of_in_is_not_that_of_out(tmp_path):
    source = write(tmp_path / "data.gltf", *torus_document())
    source.rename(tmp_path / "in.gltf")
    before = (tmp_path / "data.bin").read_bytes()
    code, _, err = decimate(tmp_path / "in.gltf", tmp_path / "data.gltf", "--tolerance", "1%")
    assert code == 2 and "data.bin" in err and "which is read" in err and len(err.splitlines()) == 1
    assert (tmp_path / "data.bin").read_bytes() == before


@needs_gltf
def test_a_bad_file_is_refused(tmp_path):
    (tmp_path / "in.glb").write_bytes(glb(*torus_document())[:-100])
    code, _, err = decimate(tmp_path / "in.glb", tmp_path / "out.glb", "--tolerance", "1%")
    assert code == 2 and "in.glb: the file is truncated" in err and len(err.splitlines()) == 1


@needs_gltf
def test_an_obj_names_the_textures_of_a_gltf(tmp_path):
    source = write(tmp_path / "in.gltf", *torus_document(uvs=torus_arrays()[0][:, :2] / 4 + 0.5, image="skin.png"))
    picture(tmp_path / "skin.png", (1, 0, 0))
    (tmp_path / "other").mkdir()
    for folder, name in ((tmp_path, "skin.png"), (tmp_path / "other", tmp_path / "skin.png")):
        succeeded(decimate(source, folder / "out.obj", "--tolerance", "1%"))
        assert f"map_Kd {name}\n" in (folder / "out.mtl").read_text()


# Names of textures --------------------------------------------------------------------------------------------------


def test_textures_take_free_names(tmp_path):
    folder, exported = tmp_path / "folder", tmp_path / "exported"
    folder.mkdir(), exported.mkdir()
    for name in ("a.png", "b.png", "c.png", "d.png"):
        (exported / name).write_bytes(b"new " + name.encode())
    (folder / "a.png").write_bytes(b"another")
    (folder / "a-2.png").symlink_to("nowhere")
    (folder / "b.png").write_bytes(b"new b.png")
    uris = ["a.png", "b.png", "c.png", "d.png", "a.png", "data:image/png;base64,AAAA"]
    (exported / "out.gltf").write_text(json.dumps({"images": [{"uri": uri} for uri in uris] + [{"bufferView": 0}]}))
    textures = side_files.keep_textures(exported / "out.gltf", folder, lambda path: path == folder / "c.png")
    assert [path.name for path in textures] == ["a-3.png", "c-2.png", "d.png"]
    assert textures[0].read_bytes() == b"new a.png"
    images = json.loads((exported / "out.gltf").read_text())["images"]
    assert [image.get("uri") for image in images] == ["a-3.png", "b.png", "c-2.png", "d.png", "a-3.png", uris[-1], None]


def test_the_files_that_a_file_names(tmp_path):
    for name in ("my skin.png", "in.bin", "bump map.png", "two.mtl"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "my.mtl").write_text(
        "newmtl a\nmap_Kd -s 1 1 1 my skin.png\nbump -bm 0.5 bump map.png\nmap_Ks no.png\n"
    )
    (tmp_path / "in.obj").write_text("mtllib my.mtl two.mtl\nv 0 0 0\n")
    found, binary = document(image="my%20skin.png")
    write(tmp_path / "in.gltf", found, binary)
    for name, files in (
        ("in.obj", {"my.mtl", "two.mtl", "my skin.png", "bump map.png"}),
        ("in.gltf", {"in.bin", "my skin.png"}),
        ("missing.obj", set()),
        ("in.bin", set()),
    ):
        assert {path.name for path in side_files.read_with(tmp_path / name)} == files


# Bad files ----------------------------------------------------------------------------------------------------------


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
