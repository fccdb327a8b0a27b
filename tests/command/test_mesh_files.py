# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of every format, there and back, with what the formats hold, and files that are damaged."""

import io
import json
import struct
import zipfile

import numpy as np
import pytest
import tolvol
import trimesh
from tolvol.command import mesh_files, plain_formats, polygons
from tolvol.command.mesh import Attribute, Mesh, joined, weld
from tolvol.shared.errors import Refused
from tolvol.shared.files import ply_file, stl_file
from tolvol.tiles.mapped import MappedMesh

import meshes
from commands import command, read, scan, succeeded, write

ALL = [".3mf", ".glb", ".obj", ".off", ".ply", ".stl"]
CUBE = (
    "OFF\n8 6 12\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
    "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n"
)


def corners(mesh):
    """Returns the triangles by the positions of their corners: it does not depend on the order of vertices."""
    return mesh.vertices.astype(np.float64)[mesh.triangles]


@pytest.mark.parametrize("extension", ALL)
def test_there_and_back_every_coordinate_is_the_same(tmp_path, extension):
    vertices, triangles = meshes.torus(columns=12, rows=6, noise=0.01)
    found = read(write(tmp_path / f"a{extension}", vertices.astype(np.float32), triangles))
    assert np.array_equal(corners(found), vertices.astype(np.float32).astype(np.float64)[triangles])
    assert len(found.vertices) == len(vertices) and found.triangles.dtype == np.int32
    exact = extension in (".3mf", ".obj", ".off", ".ply")
    double = read(write(tmp_path / f"b{extension}", vertices.astype(np.float64), triangles))
    assert np.array_equal(corners(double), vertices.astype(np.float64)[triangles]) == exact
    assert (double.vertices.dtype == np.float64) == exact


@pytest.mark.parametrize("extension", ALL)
def test_each_format_is_decimated_and_certified(tmp_path, extension):
    source, target = scan(tmp_path / f"in{extension}"), tmp_path / f"out{extension}"
    match = succeeded(command("decimate", source, target, "--tolerance", "0.02"))
    one, other = (corners(read(path)).reshape(-1, 3) for path in (target, source))
    count = len(one) // 3
    assert match[2] == str(count) and count < 600
    soups = [(points, np.arange(len(points), dtype=np.int32).reshape(-1, 3)) for points in (one, other)]
    both = tolvol.hausdorff(*soups[0], *soups[1], bound=0.02)
    assert max(both.forward.upper, both.backward.upper) <= 0.02


def test_a_double_stays_a_double(tmp_path):
    source, target = scan(tmp_path / "in.ply", np.float64), tmp_path / "out.ply"
    before = read(source)
    assert not np.array_equal(before.vertices.astype(np.float32), before.vertices)
    succeeded(command("decimate", source, target, "--tolerance", "1%", "--placement", "subset"))
    assert b"property double x" in target.read_bytes()
    assert {row.tobytes() for row in read(target).vertices} < {row.tobytes() for row in before.vertices}
    # A format of float32 rounds, within the tolerance.
    succeeded(command("decimate", source, tmp_path / "out.stl", "--tolerance", "1%"))


def test_a_rounding_beyond_the_tolerance_is_refused(tmp_path):
    vertices, triangles = meshes.torus(columns=24, rows=12)
    far = write(tmp_path / "far.ply", vertices.astype(np.float64) + 1e6, triangles)
    code, _, err = command("decimate", far, tmp_path / "out.stl", "--tolerance", "1%")
    assert code == 2 and "is less than the rounding when .stl is written; use .ply" in err
    succeeded(command("decimate", far, tmp_path / "out.ply", "--tolerance", "1%"))


def plain_ply(form):
    vertices, faces = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.5)], [(0, 1, 2), (0, 2, 3)]
    header = (
        f"ply\nformat {form} 1.0\ncomment made by a test\nelement vertex 4\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\n"
        "end_header\n"
    )
    if form == "ascii":
        rows = [f"{x} {y} {z} {10 * i} 2 3" for i, (x, y, z) in enumerate(vertices)] + [
            f"3 {a} {b} {c}" for a, b, c in faces
        ]
        return (header + "\n".join(rows) + "\n").encode()
    order = "<" if "little" in form else ">"
    body = b"".join(struct.pack(order + "3f3B", *place, 10 * i, 2, 3) for i, place in enumerate(vertices))
    return header.encode() + body + b"".join(struct.pack(order + "B3i", 3, *face) for face in faces)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_all_forms_of_ply(tmp_path, form):
    (tmp_path / "a.ply").write_bytes(plain_ply(form))
    mesh = read(tmp_path / "a.ply")
    assert mesh.vertices.dtype == np.float32 and mesh.vertices[3].tolist() == [0, 1, 0.5]
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    colours = mesh.attributes["colours"]
    assert colours.values.dtype == np.uint8 and colours.values[:, 0].tolist() == [0, 10, 20, 30]


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("lengths", ["333", "444", "345", "3343"], ids=["triangles", "quads", "mixed", "one quad"])
@pytest.mark.parametrize("counted, index", [("uchar", "int"), ("uint", "uint"), ("char", "short"), ("ushort", "uchar")])
@pytest.mark.parametrize("extra", [False, True])
def test_lists_of_any_type_among_other_numbers(order, lengths, counted, index, extra):
    codes = {"uchar": "B", "char": "b", "ushort": "H", "short": "h", "uint": "I", "int": "i"}
    sizes = [int(length) for length in lengths]
    faces = [[(7 * i + k) % 12 for k in range(size)] for i, size in enumerate(sizes)]
    points = np.random.default_rng(1).normal(size=(12, 3)).astype("f4")
    before, after = ("property short before\n", "property list uchar float texcoord\n") if extra else ("", "")
    quality = [100 - i for i in range(12)]
    head = (
        f"ply\nformat binary_{'little' if order == '<' else 'big'}_endian 1.0\nelement vertex 12\n"
        "property double ignored\nproperty float x\nproperty float y\nproperty float z\nproperty char quality\n"
        f"element face {len(faces)}\n{before}property list {counted} {index} vertex_indices\n{after}end_header\n"
    )
    body = b"".join(struct.pack(order + "d3fb", 0.5, *point, value) for point, value in zip(points, quality))
    for face in faces:
        row = struct.pack(order + codes[counted], len(face)) + struct.pack(f"{order}{len(face)}{codes[index]}", *face)
        if extra:
            row = (
                struct.pack(order + "h", -2)
                + row
                + struct.pack(f"{order}B{2 * len(face)}f", 2 * len(face), *face, *face)
            )
        body += row
    found = ply_file.read(head.encode() + body)
    assert np.array_equal(found.vertices, points) and found.vertices.dtype == np.float32
    assert found.corners.tolist() == sum(faces, []) and found.faces == len(faces)
    assert found.sizes == sizes[0] if len(set(sizes)) == 1 else found.sizes.tolist() == sizes
    assert found.columns["quality"].tolist() == quality and bool(found.others) == extra
    for cut in (1, 9, len(row)):
        with pytest.raises(Refused, match="the file ends inside its list of face elements"):
            ply_file.read(head.encode() + body[:-cut])
    with pytest.raises(Refused, match="2 bytes are left"):
        ply_file.read(head.encode() + body + b"ab")


def one_triangle(path, form, kinds, rows):
    """Writes a PLY file of one triangle. rows: its vertices, a structured array; kinds: the types as PLY names them."""
    properties = "".join(f"property {kind} {name}\n" for name, kind in zip(rows.dtype.names, kinds))
    head = f"ply\nformat {form} 1.0\nelement vertex 3\n{properties}"
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    if form == "ascii":
        body = "".join(" ".join(f"{value}" for value in row) + "\n" for row in rows.tolist()).encode() + b"3 0 1 2\n"
    else:
        body = rows.tobytes() + b"\3" + np.arange(3, dtype="<i4").tobytes()
    path.write_bytes(head.encode() + body)
    return path


@pytest.mark.parametrize(
    "types, exact",
    [("float float float", False), ("short uchar char", False)]
    + [(types, True) for types in ("int int int", "float double double", "uint float float", "float float int")],
)
@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_positions_are_held_exactly_whatever_types_they_have(tmp_path, types, exact, form):
    types = types.split()
    large = 2**24 + 1  # float32 cannot hold it.
    rows = np.zeros(3, [(axis, ply_file._PLY_TYPES[kind]) for axis, kind in zip("xyz", types)])
    for i, (axis, kind) in enumerate(zip("xyz", types)):
        rows[axis][i] = large if kind in ("int", "uint", "double") else 3
    vertices = read(one_triangle(tmp_path / "a.ply", form, types, rows)).vertices
    assert vertices.dtype == (np.float64 if exact else np.float32)
    assert vertices.tolist() == [list(row) for row in rows.tolist()]
    if form != "ascii":
        assert MappedMesh(tmp_path / "a.ply").corners(0, 1)[0].tolist() == vertices.tolist()


@pytest.mark.parametrize(
    "kind, values, found",
    [
        ("float", [0.25, 0.5, 1.002], np.float32),
        ("uchar", [0, 128, 255], np.uint8),
        ("ushort", [0, 128, 255], np.uint8),
        ("int", [0, 128, 255], np.uint8),
        ("double", [0, 0.5, 1], np.float32),
        ("ushort", [300, 65535, 255], None),
        ("int", [-1, 0, 255], None),
        ("float", [0, 128, 255], None),
    ],
)
@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_colours_keep_their_values_or_are_left_out(tmp_path, form, kind, values, found):
    names = ("red", "green", "blue")
    types = [(axis, "<f4") for axis in "xyz"] + [(name, ply_file._PLY_TYPES[kind]) for name in names]
    rows = np.zeros(3, types)
    for i, axis in enumerate("xyz"):
        rows[axis][i] = 1
    for name, value in zip(names, values):
        rows[name] = value
    mesh = read(one_triangle(tmp_path / "a.ply", form, ["float"] * 3 + [kind] * 3, rows))
    if found is None:
        assert not mesh.attributes and mesh.others == ("its colours, some of which are beyond their range",)
    else:
        colours = mesh.attributes["colours"].values
        assert colours.dtype == found and np.allclose(colours, values, rtol=1e-6)


def test_lists_of_vertices_are_said_to_be_left_out(tmp_path):
    text = ply_text().replace(b"property float z\n", b"property float z\nproperty list uchar int adj\n")
    for row in (b"1 0 0\n", b"1 1 0\n", b"1 0 1\n"):
        text = text.replace(row, row[:-1] + b" 2 0 1\n")
    (tmp_path / "a.ply").write_bytes(text)
    assert read(tmp_path / "a.ply").others == ("the lists adj of its vertices",)


@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\r"])
def test_a_ply_header_may_end_its_lines_in_any_way(tmp_path, newline):
    head = ply_text().replace(b"ply\n", b"ply\ncomment \xc3\x85 property x\n").replace(b"\n", newline)
    (tmp_path / "a.ply").write_bytes(head)
    assert len(read(tmp_path / "a.ply").triangles) == 1
    # The first byte of the data is 10, which would be a part of the line's end if lines did not end with 13 alone.
    points = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1)], "<f4")
    points[0, 0] = np.frombuffer(b"\x0a\x00\x80\x3f", "<f4")[0]
    binary = ply_text().split(b"end_header\n")[0].replace(b"ascii", b"binary_little_endian") + b"end_header\n"
    body = points.tobytes() + b"\3" + np.arange(3, dtype="<i4").tobytes()
    (tmp_path / "b.ply").write_bytes(binary.replace(b"\n", newline) + body)
    assert np.array_equal(read(tmp_path / "b.ply").vertices, points)


@pytest.mark.parametrize(
    "change, said",
    [
        ((b"element vertex 3", b"element vertex -1"), "declares -1 elements vertex"),
        ((b"property float z\n", b"property float z\nproperty float x\n"), "several properties of its vertex"),
        ((b"element face 1", b"element face 0\nelement face 1"), "several of its elements are named face"),
    ],
)
def test_a_header_that_contradicts_itself_is_refused(tmp_path, change, said):
    for form in (b"ascii", b"binary_little_endian"):
        path = tmp_path / "a.ply"
        path.write_bytes(ply_text().replace(b"ascii", form).replace(*change))
        with pytest.raises(Refused, match=said):
            read(path)
    with pytest.raises(Refused, match=said):
        MappedMesh(path)


@pytest.mark.parametrize("counted, code, length", [("char", "b", -1), ("uint", "I", 2**32 - 1), ("float", "f", 2.5)])
def test_a_list_of_an_impossible_length_is_refused_before_it_takes_memory(counted, code, length):
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    )
    head += f"element face 2\nproperty list {counted} int vertex_indices\nend_header\n"
    body = bytes(36) + struct.pack(f"<{code}3i", 3, 0, 1, 2) + struct.pack(f"<{code}3i", length, 0, 1, 2)
    with pytest.raises(Refused, match="the file ends inside its list of face elements"):
        ply_file.read(head.encode() + body)


def test_vertices_with_lists_of_different_lengths_keep_their_numbers():
    head = (
        "ply\nformat binary_big_endian 1.0\nelement vertex 4\nproperty float x\nproperty list uchar short tags\n"
        "property float y\nproperty float z\nproperty uchar quality\nend_header\n"
    )
    points = np.random.default_rng(1).normal(size=(4, 3)).astype("f4").tolist()
    body = b"".join(struct.pack(f">fB{i}h2fB", x, i, *range(i), y, z, 9 * i) for i, (x, y, z) in enumerate(points))
    found = ply_file.read(head.encode() + body)
    assert found.vertices.tolist() == points
    assert {name: column.tolist() for name, column in found.columns.items()} == {"quality": [0, 9, 18, 27]}


def test_stl_holds_the_corners_and_normals_of_all_triangles(tmp_path, monkeypatch):
    monkeypatch.setattr(plain_formats, "_BLOCK", 5)  # The triangles of the box are written in three parts.
    vertices, triangles = meshes.box()
    triangles = np.concatenate([triangles, [[0, 0, 1]]])
    mesh_files.write(tmp_path / "a.stl", [Mesh("a", vertices, triangles)], tmp_path)
    data = (tmp_path / "a.stl").read_bytes()
    rows = np.frombuffer(data, stl_file.TRIANGLE, offset=84)
    assert struct.unpack_from("<I", data, 80) == (13,) and np.array_equal(
        rows["corners"], vertices[triangles].astype("f4")
    )
    outwards = rows["corners"].mean(1) - vertices.mean(0)
    assert ((rows["normal"] * outwards).sum(1)[:12] > 0).all() and not rows["normal"][12].any()
    assert np.allclose(np.linalg.norm(rows["normal"][:12], axis=1), 1)


def test_stl_as_text_is_welded_and_says_so(tmp_path):
    vertices, triangles = meshes.box()
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in face)
        + "endloop\nendfacet\n"
        for face in vertices[triangles]
    )
    (tmp_path / "box.stl").write_text(f"solid box\n{facets.replace('vertex 0 ', 'vertex -0.0 ', 5)}endsolid box\n")
    found = mesh_files.read(tmp_path / "box.stl")
    assert found.counts == {"vertices": 8, "triangles": 12}
    assert found.repairs[0]["message"] == "box.stl: 36 corners were welded to 8 vertices by position"
    assert tolvol.solidity(found.objects[0].vertices, found.objects[0].triangles)["closed"]


# What formats hold ----------------------------------------------------------------------------------------------------


def plate(split=False):
    """A slightly curved plate whose attributes are linear in x and y, so that every interpolation of them is exact."""
    vertices, triangles = meshes.plate(n=17, bump=0.01)
    x, y = vertices[:, 0], vertices[:, 1]
    colours = np.stack([40 + 100 * x, 200 - 100 * y, 50 + 0 * x], 1)
    normals = np.tile(np.float32([0, 0, 1]), (len(vertices), 1))
    values = {
        "UVs": np.stack([x, y], 1).astype(np.float32),
        "normals": normals,
        "colours": np.rint(colours).astype(np.uint8),
    }
    index = triangles.astype(np.int32)
    return (
        vertices.astype(np.float32),
        triangles,
        {name: Attribute(rows, index, split) for name, rows in values.items()},
    )


@pytest.mark.parametrize("extension", [".glb", ".obj", ".ply"])
@pytest.mark.parametrize("placement", ["optimal", "subset"])
def test_uvs_normals_and_colours_follow_the_decimation(tmp_path, extension, placement):
    vertices, triangles, attributes = plate()
    source = write(tmp_path / f"in{extension}", vertices, triangles, **attributes)
    target = tmp_path / f"out{extension}"
    done = command("decimate", source, target, "--tolerance", "1%", "--placement", placement)
    succeeded(done)
    assert "without" not in done[1]
    mesh = read(target)
    assert len(mesh.triangles) < 100 and mesh.attributes.keys() == attributes.keys()
    places = mesh.vertices[mesh.triangles]
    at = {name: kept.values[kept.index] for name, kept in mesh.attributes.items()}
    assert np.allclose(at["UVs"], places[..., :2], atol=1e-5)
    assert np.allclose(at["normals"], [0, 0, 1], atol=1e-6)
    scale = 255 if at["colours"].dtype == np.float32 else 1
    wanted = np.stack([40 + 100 * places[..., 0], 200 - 100 * places[..., 1]], -1)
    assert np.abs(scale * at["colours"][..., :2].astype(float) - wanted).max() < 1.6


def test_seams_of_uvs_stay_seams(tmp_path):
    vertices, triangles, attributes = plate(split=True)
    uvs = attributes["UVs"]
    left = (vertices[triangles][:, :, 0].mean(1) < vertices[:, 0].mean())[:, None]
    moved = Attribute(
        np.concatenate([uvs.values, uvs.values + 5]), np.where(left, uvs.index, uvs.index + len(vertices)), True
    )
    for extension in (".glb", ".obj", ".ply"):
        source = write(tmp_path / f"in{extension}", vertices, triangles, UVs=moved)
        before = read(source)
        assert len(before.vertices) == len(vertices), "the vertices of the seam are one vertex again"
        succeeded(command("decimate", source, tmp_path / f"out{extension}", "--tolerance", "1%"))
        mesh = read(tmp_path / f"out{extension}")
        at, places = mesh.attributes["UVs"], mesh.vertices[mesh.triangles]
        shift = (at.values[at.index] - places[..., :2]).round(4)
        assert (shift == shift[:, :1]).all() and {0.0, 5.0} == set(np.unique(shift)), extension
        assert len(mesh.vertices) < len(at.values)


def test_uvs_that_differ_by_rounding_are_no_seam(tmp_path):
    vertices, triangles, attributes = plate()
    at = attributes["UVs"].values[attributes["UVs"].index].reshape(-1, 2)
    noise = np.random.default_rng(1).uniform(-1, 1, at.shape) * 2e-7
    own = Attribute(at + noise, np.arange(len(at)).reshape(-1, 3).astype(np.int32), True)
    source = write(tmp_path / "in.obj", vertices, triangles, UVs=own)
    succeeded(command("decimate", source, tmp_path / "out.obj", "--tolerance", "1%"))
    assert len(read(tmp_path / "out.obj").triangles) < 100


def test_what_is_left_out_is_said_on_one_line(tmp_path):
    vertices, triangles, attributes = plate()
    source = write(tmp_path / "in.ply", vertices, triangles, **attributes)
    code, out, _ = command("decimate", source, tmp_path / "out.stl", "--tolerance", "1%")
    assert code == 0 and "note: out.stl is without normals, colours, UVs\n" in out
    text = source.read_bytes().replace(
        b"property float s\nproperty float t", b"property float quality\nproperty float age"
    )
    (tmp_path / "scalars.ply").write_bytes(text)
    _, out, _ = command("decimate", tmp_path / "scalars.ply", tmp_path / "out.ply", "--tolerance", "1%")
    assert "note: out.ply is without the numbers quality, age of its vertices\n" in out


def test_texture_of_a_glb_file_stays(tmp_path):
    vertices, triangles, attributes = plate()
    source = write(tmp_path / "plain.glb", vertices, triangles, UVs=attributes["UVs"])
    scene = trimesh.load_scene(source, process=False)
    from PIL import Image

    for mesh in scene.geometry.values():
        image = Image.new("RGB", (2, 2), (1, 2, 250))
        mesh.visual.material = trimesh.visual.material.PBRMaterial(baseColorTexture=image)
    (tmp_path / "in.glb").write_bytes(scene.export(file_type="glb"))
    succeeded(command("decimate", tmp_path / "in.glb", tmp_path / "out.glb", "--tolerance", "1%"))
    (kept,) = trimesh.load_scene(tmp_path / "out.glb", process=False).geometry.values()
    assert kept.visual.material.baseColorTexture.getpixel((0, 0)) == (1, 2, 250)
    _, out, _ = command("decimate", tmp_path / "in.glb", tmp_path / "out.obj", "--tolerance", "1%")
    assert "note: out.obj is without materials\n" in out


def test_several_meshes_of_a_scene_are_one_at_their_places(tmp_path):
    box = trimesh.Trimesh(*meshes.box(), process=False)
    scene = trimesh.Scene()
    scene.add_geometry(box)
    mirror = np.diag([-2.0, 1, 1, 1])
    mirror[:3, 3] = -5, 0, 0
    scene.add_geometry(box, transform=mirror)
    for extension in ("glb", "3mf"):
        (tmp_path / f"two.{extension}").write_bytes(scene.export(file_type=extension))
        mesh = read(tmp_path / f"two.{extension}")
        facts = tolvol.solidity(mesh.vertices, mesh.triangles)
        assert facts["shells"] == 2 and facts["volume"] == pytest.approx(3), "the mirrored box looks outwards, too"
        assert mesh.vertices[:, 0].min() == pytest.approx(-7)
        assert "the division into 2 meshes" in mesh.others


def test_the_unit_of_a_3mf_file_stays(tmp_path):
    source = scan(tmp_path / "in.3mf")
    with zipfile.ZipFile(source) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(source, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content.replace(b'unit="millimeter"', b'unit="inch"'))
    succeeded(command("decimate", source, tmp_path / "out.3mf", "--tolerance", "1%"))
    with zipfile.ZipFile(tmp_path / "out.3mf") as archive:
        assert b'unit="inch"' in archive.read("3D/3dmodel.model")


def test_a_level_of_a_glb_file_has_its_deviation(tmp_path):
    code, out, err = command("decimate", scan(tmp_path / "in.ply"), tmp_path / "out.glb", "--lod", "0.5%,2%")
    assert (code, err) == (0, "")
    for level, line in zip(range(2), out.splitlines()[-2:]):
        data = (tmp_path / f"out_LOD{level}.glb").read_bytes()
        size = struct.unpack_from("<I", data, 12)[0]
        (node,) = [node for node in json.loads(data[20 : 20 + size])["nodes"] if "mesh" in node]
        assert line.startswith(f"out_LOD{level}.glb: ") and node["extras"]["geometricError"] > 0


def test_joining_leaves_out_what_not_all_have():
    vertices, triangles, attributes = plate()
    one = Mesh("one", vertices, triangles, dict(attributes))
    other = Mesh("other", vertices + np.float32(3), triangles, {"UVs": attributes["UVs"]})
    whole = joined("both", [one, other])
    assert whole.attributes.keys() == {"UVs"} and "colours, which not all of its meshes have" in whole.others
    assert np.array_equal(
        whole.attributes["UVs"].values[whole.attributes["UVs"].index][len(triangles) :],
        attributes["UVs"].values[triangles],
    )
    assert weld(whole) is whole


# Polygons ---------------------------------------------------------------------------------------------------------------


def area(points, found):
    one, two, three = (points[found[:, k]] for k in range(3))
    return np.cross(two - one, three - one)[:, 2] / 2


@pytest.mark.parametrize("block", [1, 3, polygons._BLOCK])
def test_each_polygon_among_others_is_cut_as_it_is_alone(monkeypatch, block):
    monkeypatch.setattr(polygons, "_BLOCK", block)
    random = np.random.default_rng(1)
    sizes = random.integers(1, 7, 60)
    # The corners of each polygon are in order around a centre, at distances by which many polygons have dents.
    angles = np.concatenate([np.sort(random.random(size)) * 2 * np.pi for size in sizes])
    away = random.uniform(0.1, 1, len(angles))
    vertices = np.stack([away * np.cos(angles), away * np.sin(angles), np.zeros(len(angles))], 1)
    corners, ends = np.arange(len(angles), dtype=np.int32), np.cumsum(sizes)
    places, of = polygons.triangulated(vertices, corners, sizes)
    alone = [
        end - size + polygons.triangulated(vertices, corners[end - size : end], np.array([size]))[0]
        for size, end in zip(sizes, ends)
    ]
    assert places.tolist() == np.concatenate(alone).tolist()
    assert of.tolist() == np.repeat(np.arange(60), np.maximum(sizes - 2, 0)).tolist()
    quads = np.flatnonzero(sizes == 4)
    second = places[np.searchsorted(of, quads) + 1, 0] - (ends - sizes)[quads]
    assert set(second.tolist()) == {0, 1}  # with and without a dent at the cut from the first corner to the third


@pytest.mark.parametrize(
    "outline",
    [
        [(0, 0), (2, 0), (2, 2), (0, 2)],
        [(0, 0), (4, -1), (1, 1), (-1, 4)],
        [(0, 0), (4, 0), (0, 4), (1, 1)][::-1],
        [(0, 0), (4, 0), (4, 3), (2, 1), (0, 3)],
        [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)],
        [(0, 0), (1, 0), (2, 0), (2, 2), (0, 2)],
        [(0, 0), (4, 0), (4, 4), (2, 1), (2, 1), (0, 4)],
        [(2, 1), (2, 1), (2, 1), (0, 4), (0, 0), (4, 0), (4, 4)],
        [(0, 0), (4, 0), (4, 3), (2, 1), (2, 0.5), (2, 1), (0, 3)],
        [(0, 0), (2, 0), (4, 0), (4, 4), (2, 1), (1, 2.5), (0, 4), (0, 4)],
    ],
)
def test_polygons_with_dents_are_covered_once(outline):
    points = np.array([(*place, 0.0) for place in outline])
    for turned in (points, points[::-1]):
        found, _ = polygons.triangulated(turned, np.arange(len(points)), np.array([len(points)]))
        x, y, _ = turned.T
        whole = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
        areas = area(turned, found)
        assert len(found) == len(points) - 2 and areas.sum() == pytest.approx(whole)
        assert (areas * np.sign(whole) > -1e-12).all(), "no triangle is turned over"


def test_a_polygon_that_repeats_a_corner_is_the_same_surface(tmp_path):
    corners = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\n"
    (tmp_path / "one.obj").write_text(f"{corners}f 1 2 3 4 5\n")
    (tmp_path / "other.obj").write_text(f"{corners}f 1 2 3 4 4 5\n")
    one, other = (read(tmp_path / f"{name}.obj") for name in ("one", "other"))
    found = tolvol.hausdorff(one.vertices, one.triangles, other.vertices, other.triangles)
    assert max(found.forward.upper, found.backward.upper) < 1e-12


def test_polygons_are_said_to_be_cut(tmp_path):
    (tmp_path / "cube.off").write_text(CUBE)
    found = mesh_files.read(tmp_path / "cube.off")
    assert found.counts["triangles"] == 12
    assert found.repairs[0]["message"] == "cube.off: 6 faces with more than three corners were cut into triangles"
    assert tolvol.solidity(found.objects[0].vertices, found.objects[0].triangles)["volume"] == pytest.approx(1)
    mixed = CUBE.replace("8 6 12", "8 7 12").replace("4 3 2 1 0\n", "3 3 2 1\n3 3 1 0\n")
    (tmp_path / "mixed.off").write_text(mixed)
    assert mesh_files.read(tmp_path / "mixed.off").counts["triangles"] == 12
    (tmp_path / "two.off").write_text(CUBE.replace("4 3 2 1 0", "2 3 2"))
    messages = [repair["message"] for repair in mesh_files.read(tmp_path / "two.off").repairs]
    assert "two.off: 1 faces with fewer than three corners were left out" in messages


# Damage -----------------------------------------------------------------------------------------------------------------


def ply_text(face="3 0 1 2", of_face="property list uchar int vertex_indices"):
    """Returns a PLY file in text form that holds one triangle."""
    of_vertex = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat ascii 1.0\nelement vertex 3\n{of_vertex}element face 1\n{of_face}\nend_header\n"
    return f"{head}1 0 0\n1 1 0\n1 0 1\n{face}\n".encode()


def test_an_obj_file_may_begin_with_a_byte_order_mark(tmp_path):
    scan(tmp_path / "plain.obj")
    data = (tmp_path / "plain.obj").read_bytes()
    assert data.startswith(b"v ")
    (tmp_path / "marked.obj").write_bytes(b"\xef\xbb\xbf" + data)
    plain, marked = (mesh_files.read(tmp_path / name).objects[0] for name in ("plain.obj", "marked.obj"))
    np.testing.assert_array_equal(marked.vertices, plain.vertices)
    np.testing.assert_array_equal(marked.triangles, plain.triangles)


def damaged(tmp_path):
    """Yields (name of a damaged file, a part of the message)."""
    whole = {}
    for extension in ALL:
        whole[extension] = scan(tmp_path / f"whole{extension}").read_bytes()
    early = {
        ".3mf": "it is no zip archive",
        ".glb": "the file is truncated",
        ".off": "the file ends early: it has",
        ".ply": "the file ends inside its list of face elements",
        ".stl": "it is truncated",
    }
    for extension, words in early.items():
        yield f"early{extension}", whole[extension][: len(whole[extension]) * 3 // 4], words
    ply = whole[".ply"]
    body = ply.index(b"end_header\n") + 11
    yield "fewer.ply", ply.replace(b"element face 2304", b"element face 2303"), "the numbers in its header are wrong"
    yield "more.ply", ply.replace(b"element face 2304", b"element face 9999"), "ends inside its list of face"
    yield (
        "many.ply",
        ply.replace(b"element vertex 1152", b"element vertex 1153"),
        "face 1 has no vertices",
    )
    nan = struct.pack("<f", float("nan"))
    yield "nan.ply", ply[: body + 12 * 41 + 4] + nan + ply[body + 12 * 41 + 8 :], "vertex 42 is not finite"
    stl = whole[".stl"]
    yield "nan.stl", stl[: 84 + 50 * 2 + 12] + nan + stl[84 + 50 * 2 + 16 :], "vertex 7 is not finite"
    off = whole[".off"].split(b"\n")
    yield "nan.off", b"\n".join([*off[:9], b"0 inf 0", *off[10:]]), "vertex 8 is not finite"
    yield "word.off", b"\n".join([*off[:9], b"0 x 0", *off[10:]]), "vertex 8 is not three numbers (0 x 0)"
    yield "index.off", whole[".off"].replace(b"\n3 0 ", b"\n3 7777 ", 1), "names vertex 7777"
    for name, wrong in (("size", b"\n3.5 0 "), ("corner", b"\n3 0.5 ")):
        yield f"{name}.off", whole[".off"].replace(b"\n3 0 ", wrong, 1), "is not a list of vertices (3"
    for name, face in (("endless", "inf 0 1 2"), ("nan", "nan 0 1 2"), ("part", "3.5 0 1 2")):
        yield f"{name} list.ply", ply_text(face), "ends inside its list of face"
    for name, corner in (("inf", "inf"), ("half", "0.5"), ("large", "1e300")):
        yield f"{name} corner.ply", ply_text(f"3 0 1 {corner}"), "by numbers that are not whole"
    yield "scalar.ply", ply_text("3", "property int vertex_indices"), "its faces name no vertices"
    yield "lists.ply", ply_text().replace(b"float x", b"list uchar float x"), "its vertices have no x, y, z"
    yield "nan.obj", whole[".obj"].replace(b"v ", b"v nan 0 0\nv ", 1), "vertex 1 is not finite"
    yield (
        "none.ply",
        ply[:body].replace(b"element face 2304", b"element face 0") + ply[body : body + 12 * 1152],
        "no faces",
    )
    yield "none.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "the file has no faces"
    yield "empty.glb", b"", "the file is empty"
    yield "other.ply", b"solid nothing", "this is not a PLY file"
    yield "other.xyz", b"0 0 0", "unknown extension .xyz; the known ones are .3mf .glb .obj .off .ply .stl"
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as made:
        made.writestr("3D/3dmodel.model", "<model><resources>")
    yield "xml.3mf", archive.getvalue(), "trimesh cannot read it"
    glb = whole[".glb"]
    size = struct.unpack_from("<I", glb, 12)[0]
    document = json.loads(glb[20 : 20 + size]) | {"extensionsRequired": ["KHR_draco_mesh_compression"]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = glb[20 + size :]
    draco = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest
    yield "draco.glb", draco, "save it again without compression"


def test_damage_is_one_line_that_names_the_file(tmp_path):
    for name, data, words in damaged(tmp_path):
        (tmp_path / name).write_bytes(data)
        try:
            mesh_files.read(tmp_path / name)
        except Refused as error:
            said = str(error)
        else:
            pytest.fail(f"{name} was read")
        assert said.startswith(f"{tmp_path / name}: ") and words in said and "\n" not in said, (name, said)
