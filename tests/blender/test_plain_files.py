# SPDX-License-Identifier: GPL-3.0-or-later
"""A PLY file that plain_files.py reads becomes the mesh that Blender's own reader makes of it."""

import bpy
import numpy as np
import pytest

from addon.files import file_io, plain_files
from addon.mesh import mesh_io

needs_python_reader = pytest.mark.skipif(
    "ply_import" in dir(bpy.ops.wm), reason="the reader of PLY files in this Blender is not slow, and is used"
)
POSITIONS = [("x", "f4"), ("y", "f4"), ("z", "f4")]
NAMES = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int"}


def scattered(corners, count=60, vertices=40):
    """Returns (n, 3) points and (m, corners) faces, some of which repeat a corner or another face."""
    random = np.random.default_rng(corners)
    faces = random.integers(0, vertices, (count, corners))
    faces[7] = faces[3]
    faces[9, 1] = faces[9, 0]
    faces[11, [1, 2]] = 5, 0
    return random.normal(size=(vertices, 3)) * 1e3, faces


def write(path, form, fields, columns, faces, index="vertex_indices"):
    """Writes a PLY file. fields: [(name, type)] of the vertices; columns: their values, (n, fields)."""
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    header = [
        "ply",
        f"format {form} 1.0",
        f"element vertex {len(columns)}",
        *(f"property {NAMES[kind]} {name}" for name, kind in fields),
        f"element face {len(faces)}",
        f"property list uchar int {index}",
        "end_header",
    ]
    if form == "ascii":
        rows = [" ".join(repr(np.dtype(kind).type(v).item()) for v, (_, kind) in zip(row, fields)) for row in columns]
        rows += [" ".join(map(str, [len(face), *face])) for face in faces]
        body = "\n".join([*rows, ""]).encode()
    else:
        points = np.empty(len(columns), [(name, order + kind) for name, kind in fields])
        for (name, _), column in zip(fields, np.transpose(columns)):
            points[name] = column
        lists = [np.uint8(len(face)).tobytes() + np.asarray(face, order + "i4").tobytes() for face in faces]
        body = points.tobytes() + b"".join(lists)
    path.write_bytes("\n".join([*header, ""]).encode() + body)
    return path


def stored(ob):
    """Returns all that the mesh of an object holds, and the object's name without its number."""
    mesh = ob.data
    return {
        "name": ob.name.split(".")[0],
        "positions": mesh_io.column(mesh.vertices, "co", 3).view(np.uint32).tolist(),
        "edges": mesh_io.column(mesh.edges, "vertices", 2, np.int32).tolist(),
        "corners": mesh_io.column(mesh.loops, "vertex_index", 1, np.int32).tolist(),
        "corner edges": mesh_io.column(mesh.loops, "edge_index", 1, np.int32).tolist(),
        "first corners": mesh_io.column(mesh.polygons, "loop_start", 1, np.int32).tolist(),
        "numbers of corners": mesh_io.column(mesh.polygons, "loop_total", 1, np.int32).tolist(),
        "smooth": mesh_io.column(mesh.polygons, "use_smooth", 1, bool).tolist(),
        "attributes": sorted(attribute.name for attribute in mesh.attributes),
        "UVs": {layer.name: mesh_io.column(layer.data, "uv", 2).tolist() for layer in mesh.uv_layers},
        "colours": {layer.name: mesh_io.column(layer.data, "color", 4).tolist() for layer in mesh.vertex_colors},
    }


def read_both_ways(path, monkeypatch):
    """Returns what plain_files.py stores for a file, which it has to take, after a comparison with Blender's reader."""
    reads, read = [], plain_files.read
    with monkeypatch.context() as patch:
        patch.setattr(plain_files, "read", lambda *given: reads.append(read(*given)) or reads[-1])
        own = stored(file_io.read_file(path).objects[0])
        assert reads == [True]
        patch.setattr(plain_files, "read", lambda *_: False)
        assert own == stored(file_io.read_file(path).objects[0])
    return own


@needs_python_reader
@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("corners", [3, 4, 5])
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_the_mesh_is_that_of_blenders_reader(tmp_path, monkeypatch, form, corners, kind):
    points, faces = scattered(corners)
    fields, columns = [(name, kind) for name, _ in POSITIONS], points
    if corners == 3:  # Blender's reader leaves out normals.
        fields, columns = [*fields, ("nx", "f4"), ("ny", "f4"), ("nz", "f4")], np.hstack([points, points[::-1]])
    read_both_ways(write(tmp_path / "in file.ply", form, fields, columns, faces), monkeypatch)


COLOURS = [("red", "u1"), ("green", "u1"), ("blue", "u1")]


@needs_python_reader
@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize(
    "fields",
    [
        [("s", "f4"), ("t", "f4")],
        COLOURS,
        [*COLOURS, ("alpha", "u1"), ("quality", "f4")],
        [("t", "f8"), ("s", "f4"), *((name, "f4") for name, _ in COLOURS)],
        [(name, "u2") for name, _ in COLOURS],
    ],
    ids=["UVs", "colours", "alpha", "both", "ushort"],
)
def test_uvs_and_colours_are_those_of_blenders_reader(tmp_path, monkeypatch, form, fields):
    points, faces = scattered(4)
    faces[20:30, 2], faces[30:40, 3] = 0, 0  # That reader turns such faces.
    mixed = [face[: 3 + i % 2] if i % 7 else [*face, 39] for i, face in enumerate(faces.tolist())]
    random = np.random.default_rng(1)
    columns = [
        random.random(len(points)) if kind[0] == "f" else random.integers(0, 256, len(points)) for _, kind in fields
    ]
    path = write(tmp_path / "a.ply", form, POSITIONS + fields, np.column_stack([points, *columns]), mixed)
    own = read_both_ways(path, monkeypatch)
    names = {name for name, _ in fields}
    assert bool(own["UVs"]) == ("s" in names) and bool(own["colours"]) == ("red" in names)
    values = [value for layer in (*own["UVs"].values(), *own["colours"].values()) for value in layer]
    assert len({tuple(value) for value in values}) > 20 and set(own["numbers of corners"]) == {3, 4, 5}


@needs_python_reader
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_what_is_not_finite_is_stored_as_blenders_reader_stores_it(tmp_path, monkeypatch, kind):
    points, faces = scattered(3)
    values = np.linspace(0, 1, 5 * len(points)).reshape(-1, 5)
    values[::5], values[1::5], values[2::5] = np.nan, np.inf, -np.inf
    if kind == "f8":
        values[3::5, 0] = 1e300
    fields = [("s", kind), ("t", kind), *((name, "f4") for name, _ in COLOURS)]
    path = write(
        tmp_path / "a.ply", "binary_little_endian", POSITIONS + fields, np.column_stack([points, values]), faces
    )
    own = read_both_ways(path, monkeypatch)
    assert 0 in np.ravel(own["UVs"]["UVMap"]) and np.isclose(np.max(own["UVs"]["UVMap"]), np.finfo(np.float32).max)


@needs_python_reader
def test_what_only_blenders_reader_knows_is_left_to_it(tmp_path, monkeypatch):
    points, faces = scattered(3)
    colours = np.hstack([points, np.full((len(points), 3), 0.2)])
    edge = b"element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    coloured = write(
        tmp_path / "colours.ply", "ascii", POSITIONS + [(name, "f8") for name, _ in COLOURS], colours, faces
    )
    edged = write(tmp_path / "edges.ply", "binary_little_endian", POSITIONS, points, faces)
    edged.write_bytes(edged.read_bytes().replace(b"end_header\n", edge) + np.array([3, 5], "<i4").tobytes())
    read = plain_files.read
    monkeypatch.setattr(plain_files, "read", lambda *given: pytest.fail("taken") if read(*given) else False)
    one, other = (file_io.read_file(path).objects[0].data for path in (coloured, edged))
    assert one.color_attributes[0].data[0].color_srgb[0] == pytest.approx(0.2, abs=1e-3)
    assert [3, 5] in np.sort(mesh_io.column(other.edges, "vertices", 2, np.int32), 1).tolist()
