# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input to the commands: exit code 2, one line on stderr that names the faulty input, and OUT untouched."""

import numpy as np
import pytest

from commands import READS_GLTF, decimate, save, succeeded
from scenes import sheet_arrays, torus_arrays


def refused(done, *words):
    """Asserts exit code 2 and one line on stderr with all these words."""
    code, out, err = done
    assert code == 2, (code, out, err)
    assert len(err.splitlines()) == 1 and err.startswith("decimate.py: "), err
    for word in words:
        assert word in err, err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--tolerance", "0"], ["'0'"]),
        (["--tolerance", "-1%"], ["'-1%'"]),
        (["--tolerance", "nan"], ["'nan'"]),
        (["--tolerance", "inf%"], ["'inf%'"]),
        (["--tolerance", "1%%"], ["'1%%'"]),
        (["--tolerance", "1 %%"], ["'1 %%'"]),
        (["--tolerance", "abc"], ["'abc'"]),
        (["--tolerance"], ["--tolerance"]),
        ([], ["--tolerance"]),
        (["--tolerance", "1%", "--threads", "-2"], ["--threads", "-2"]),
        (["--tolerance", "1%", "--threads", "many"], ["--threads", "many"]),
        (["--tolerance", "1%", "--target-triangles", "0"], ["--target-triangles", "0"]),
        (["--tolerance", "1%", "--tolerence", "2%"], ["--tolerence"]),
        (["--tolerance", "1%", "--placement", "best"], ["--placement", "best"]),
        (["--tolerance", "1%", "--report", "/nowhere/r.json"], ["--report", "/nowhere"]),
        (["--tolerance", "1%", "--reference", "/nowhere/ref.ply"], ["/nowhere/ref.ply", "No such file"]),
        (["--tolerance", "1%", "--report", ""], ["--report", "name of the file is empty"]),
        (["--tolerance", "1%", "--picture", ""], ["--picture", "name of the file is empty"]),
        (["--tolerance", "1%", "--reference="], ["--reference", "name of the file is empty"]),
        (["--tolerance", "500%"], ["more than the size"]),
        (["--tolerance", "4"], ["more than the size"]),
    ],
)
def test_bad_arguments(scan, tmp_path, arguments, words):
    target = tmp_path / "out.ply"
    target.write_text("kept")
    refused(decimate(scan, target, *arguments), *words)
    assert target.read_text() == "kept" and not list(tmp_path.glob(".tolvol*"))


def test_arguments_missing(tmp_path):
    refused(decimate(alone=True), "no arguments")
    refused(decimate("--tolerance", "1%"), "IN")
    refused(decimate("", tmp_path / "out.ply", "--tolerance", "1%"), "IN", "name of the file is empty")
    refused(decimate(tmp_path / "in.ply", "", "--tolerance", "1%"), "OUT", "name of the file is empty")


def test_bad_places(scan, tmp_path):
    refused(decimate(scan, tmp_path / "nowhere" / "out.ply", "--tolerance", "1%"), "nowhere", "does not exist")
    refused(decimate(scan, tmp_path / "out.xyz", "--tolerance", "1%"), ".xyz", ".obj .ply .stl")
    refused(decimate(scan, tmp_path / "out", "--tolerance", "1%"), "(none)", ".obj .ply .stl")
    refused(
        decimate(tmp_path / "missing.ply", tmp_path / "out.ply", "--tolerance", "1%"), "missing.ply", "No such file"
    )
    refused(decimate(tmp_path, tmp_path / "out.ply", "--tolerance", "1%"), "extension")


def ply(vertices, faces):
    head = (
        f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
    )
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [*vertices, *(f"{len(face.split())} {face}" for face in faces)]
    return (head + "\n".join(rows) + "\n").encode()


SQUARE = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"]
BAD_FILES = {
    "empty.ply": (b"", ["empty"]),
    "empty.obj": (b"", ["empty"]),
    "empty.stl": (b"", ["empty"]),
    "garbage.ply": (bytes(range(256)) * 4, ["not a PLY file"]),
    "garbage.obj": (bytes(range(256)) * 4, ["not an OBJ file"]),
    "garbage.stl": (bytes(range(256)) * 4, ["not an STL file"]),
    "truncated.ply": (ply(SQUARE, ["0 1 2", "0 2 3"])[:-6], ["ends inside", "face"]),
    "truncated.stl": (bytes(80) + (2).to_bytes(4, "little") + bytes(50), ["it is truncated"]),
    "no faces.ply": (ply(SQUARE, []), ["no faces"]),
    "no corners.ply": (ply(SQUARE, [""]), ["name no vertices"]),
    "no faces.obj": ("".join(f"v {v}\n" for v in SQUARE).encode(), ["no faces"]),
    "nan.ply": (ply(["0 0 0", "1 nan 0", *SQUARE[2:]], ["0 1 2"]), ["vertex 2", "not finite", "nan"]),
    "infinite.obj": (b"v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n", ["vertex 3", "not finite", "inf"]),
    "overflow.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1e39 0\nf 1 2 3\n", ["vertex 3", "not finite"]),
    "nan.stl": (
        bytes(80)
        + (1).to_bytes(4, "little")
        + np.array([0, 0, 1, 0, 0, 0, 1, 0, 0, 0, np.nan, 0], "<f4").tobytes()
        + bytes(2),
        ["vertex 3", "not finite"],
    ),
    "marked.obj": (b"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n", ["byte order mark", "UTF-8 without"]),
    "words.obj": (b"v 0 0 0\nv 1 0 0\nv 0 hello 0\nf 1 2 3\n", ["vertex 3", "hello"]),
    "out of range.ply": (ply(SQUARE, ["0 1 2", "0 2 9"]), ["face 2", "vertex 9", "only 4"]),
    "out of range.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 7\n", ["face 2", "vertex 7", "only 3"]),
    "degenerate.ply": (ply(["0 0 0", "1 0 0", "2 0 0", "3 0 0"], ["0 1 2", "1 2 3"]), ["degenerate"]),
    "far.ply": (ply([f"{1e7 + float(v[0]) * 9} {v[2]} 0" for v in SQUARE], ["0 1 2", "0 2 3"]), ["tolerance"]),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files(tmp_path, name):
    content, words = BAD_FILES[name]
    (tmp_path / name).write_bytes(content)
    target = tmp_path / "out.ply"
    target.write_text("kept")
    refused(decimate(tmp_path / name, target, "--tolerance", "1%"), *words)
    assert target.read_text() == "kept" and len(list(tmp_path.iterdir())) == 2


def test_gltf_is_refused_where_blender_cannot_read_it(scan, tmp_path):
    if READS_GLTF:
        pytest.skip("this Blender reads glTF")
    (tmp_path / "in.glb").write_bytes(b"glTF")
    refused(decimate(tmp_path / "in.glb", tmp_path / "out.ply", "--tolerance", "1%"), "in.glb", "NumPy", ".ply")
    refused(decimate(scan, tmp_path / "out.glb", "--tolerance", "1%"), "out.glb", "NumPy", ".ply")


def test_tolerance_below_what_obj_text_holds(tmp_path):
    vertices, quads = torus_arrays()
    source = save(tmp_path / "in.ply", ("torus", vertices, quads))
    refused(decimate(source, tmp_path / "out.obj", "--tolerance", "1e-6"), "1e-06", "use .ply")
    succeeded(decimate(source, tmp_path / "out.obj", "--tolerance", "1e-5"))


def test_objects_of_reference_must_have_the_names(tmp_path):
    two = save(tmp_path / "two.obj", ("a", *torus_arrays()), ("b", *sheet_arrays()))
    other = save(tmp_path / "other.obj", ("a", *torus_arrays()), ("c", *sheet_arrays()))
    refused(decimate(two, tmp_path / "out.obj", "--tolerance", "1%", "--reference", other), "same names")
