# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF files: what decimate.py reads and writes, and the files beside them."""

import json
import stat
from urllib.parse import unquote

import numpy as np
import pytest

from addon import native
from addon.shared.files import side_files
from commands import command, decimate, save, succeeded, world
from gltf_files import TURN, document, glb, needs_gltf, parsed, picture, torus_document, write
from scenes import assert_within, torus_arrays


def judged(surface, reference, tolerance):
    for pair in ((surface, reference), (reference, surface)):
        assert native.module.directed_hausdorff(*pair[0], *pair[1], bound=tolerance).upper <= tolerance


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
