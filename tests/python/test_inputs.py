# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input is refused, and the message names the first faulty entry. Good input gives the same result in any layout."""

import re

import numpy as np
import pytest
import tolvol

import meshes

VERTICES, TRIANGLES = meshes.torus(24, 12)
TOLERANCE = 0.05
VOLUME = tolvol.ToleranceVolume(VERTICES, TRIANGLES, TOLERANCE)
EYE = np.eye(4)


def changed(array, index, value):
    array = array.copy()
    array[index] = value
    return array


def calls(vertices=VERTICES, triangles=TRIANGLES):
    """Every function that takes a mesh, called with this one."""
    return {
        "ToleranceVolume": lambda: tolvol.ToleranceVolume(vertices, triangles, TOLERANCE),
        "diagonal": lambda: tolvol.diagonal(vertices, triangles),
        "decimate": lambda: tolvol.decimate(vertices, triangles, VOLUME),
        "hausdorff from": lambda: tolvol.directed_hausdorff(vertices, triangles, VERTICES, TRIANGLES),
        "hausdorff to": lambda: tolvol.directed_hausdorff(VERTICES, TRIANGLES, vertices, triangles),
        "deviation from": lambda: tolvol.deviation(vertices, triangles, VERTICES, TRIANGLES),
        "deviation to": lambda: tolvol.deviation(VERTICES, TRIANGLES, vertices, triangles),
    }


BAD_MESHES = {
    "no vertices": (np.empty((0, 3)), TRIANGLES, "no vertices"),
    "no faces": (VERTICES, np.empty((0, 3), np.int32), "no faces"),
    "NaN": (changed(VERTICES, (12, 0), np.nan), TRIANGLES, r"vertex 12 is not finite"),
    "infinite": (changed(VERTICES, (7, 2), np.inf), TRIANGLES, r"vertex 7 is not finite"),
    "NaN in float32": (changed(VERTICES.astype(np.float32), (12, 0), np.nan), TRIANGLES, r"vertex 12 is not finite"),
    "index too large": (VERTICES, changed(TRIANGLES, (5, 1), 288), r"5\b.*288"),
    "index negative": (VERTICES, changed(TRIANGLES, (5, 1), -1), r"triangles\S*\[5\].*-1"),
    "index beyond 32 bits": (
        VERTICES,
        changed(TRIANGLES.astype(np.int64), (5, 1), 2**32),
        r"triangles\S*\[5\].*4294967296",
    ),
    "vertices (n, 2)": (VERTICES[:, :2].copy(), TRIANGLES, r"vertices.*\(n, 3\).*\(288, 2\)"),
    "vertices flat": (VERTICES.ravel(), TRIANGLES, r"vertices.*\(n, 3\)"),
    "triangles (m, 4)": (VERTICES, np.zeros((3, 4), np.int32), r"triangles.*\(m, 3\).*\(3, 4\)"),
    "triangles flat": (VERTICES, TRIANGLES.ravel(), r"triangles.*\(m, 3\)"),
    "vertices of integers": (VERTICES.astype(np.int32), TRIANGLES, r"vertices.*float32.*int32"),
    "vertices of float16": (VERTICES.astype(np.float16), TRIANGLES, r"vertices.*float32.*float16"),
    "triangles of floats": (VERTICES, TRIANGLES.astype(float), r"triangles.*integer.*float64"),
    "vertices in the other byte order": (VERTICES.astype(">f8"), TRIANGLES, r"vertices.*float32.*>f8"),
    "vertices None": (None, TRIANGLES, r"vertices"),
}


UNUSABLE = {name for name in BAD_MESHES if name.startswith(("no ", "NaN", "infinite", "index"))}
SHIFTED = (VERTICES + [1e6, 0, 0]).astype(np.float32)


@pytest.mark.parametrize("function", calls())
@pytest.mark.parametrize("mesh", BAD_MESHES)
def test_bad_meshes(mesh, function):
    vertices, triangles, message = BAD_MESHES[mesh]
    with pytest.raises(tolvol.InvalidInput, match=message):
        calls(vertices, triangles)[function]()


def test_all_faces_degenerate():
    lines = np.stack([TRIANGLES[:, 0], TRIANGLES[:, 0], TRIANGLES[:, 1]], 1).astype(np.int32)
    with pytest.raises(tolvol.InvalidInput, match="degenerate"):
        tolvol.decimate(VERTICES, lines, tolvol.ToleranceVolume(VERTICES, lines, TOLERANCE))


@pytest.mark.parametrize(
    "tolerance, message",
    [
        (0, "positive"),
        (-0.1, "positive"),
        (np.nan, "positive|finite"),
        (np.inf, "positive|finite"),
        (50, "larger than the reference.*size"),
    ],
)
def test_bad_tolerances(tolerance, message):
    with pytest.raises(tolvol.InvalidInput, match=message):
        tolvol.ToleranceVolume(VERTICES, TRIANGLES, tolerance)


@pytest.mark.parametrize("tolerance", [None, "1 %%", "1"])
def test_a_tolerance_that_is_no_number(tolerance):
    with pytest.raises(TypeError):
        tolvol.ToleranceVolume(VERTICES, TRIANGLES, tolerance)


def test_a_missing_tolerance():
    with pytest.raises(TypeError):
        tolvol.ToleranceVolume(VERTICES, TRIANGLES)


@pytest.mark.parametrize("precision", [0, -1, np.nan, np.inf])
def test_bad_precisions(precision):
    with pytest.raises(tolvol.InvalidInput, match="precision"):
        tolvol.ToleranceVolume(VERTICES, TRIANGLES, TOLERANCE, precision=precision)


@pytest.mark.parametrize(
    "to_world, message",
    [
        (np.eye(3), r"to_world.*\(4, 4\)"),
        (np.eye(4).ravel(), r"to_world.*\(4, 4\)"),
        (changed(EYE, (0, 3), np.nan), "to_world.*finite"),
        (changed(EYE, (3, 0), 0.5), "to_world.*row"),
    ],
    ids=["3 by 3", "flat", "NaN", "perspective"],
)
def test_bad_to_world(to_world, message):
    for call in (
        lambda: tolvol.ToleranceVolume(VERTICES, TRIANGLES, TOLERANCE, to_world=to_world),
        lambda: tolvol.diagonal(VERTICES, TRIANGLES, to_world=to_world),
        lambda: VOLUME.check(VERTICES, TRIANGLES, to_world=to_world),
        lambda: VOLUME.distance(VERTICES, to_world=to_world),
        lambda: tolvol.decimate(VERTICES, TRIANGLES, VOLUME, to_world=to_world),
    ):
        with pytest.raises(tolvol.InvalidInput, match=message):
            call()


@pytest.mark.parametrize(
    "option, message",
    [
        ({"placement": "fastest"}, "placement.*optimal.*subset.*fastest"),
        ({"outside": "ignore"}, "outside.*error.*keep.*ignore"),
        ({"target_triangles": 0}, "target_triangles.*at least 1.*None"),
        ({"max_seconds": 0}, "max_seconds.*positive.*None"),
        ({"max_seconds": np.nan}, "max_seconds.*positive"),
        ({"threads": 0}, "threads.*at least 1.*None"),
        ({"locked": np.zeros(5, bool)}, "locked.*each vertex"),
        ({"locked": np.zeros(288, np.float64)}, "locked.*bool"),
        ({"shares": np.ones(5)}, "shares.*each vertex"),
        ({"shares": np.ones(0)}, "shares.*each vertex"),
        ({"shares": np.ones(288, np.float32)}, "shares.*float64"),
        ({"shares": np.array([1.0] * 287 + [1.5])}, "shares.*0 to 1.*vertex 287"),
        ({"shares": np.array([np.nan] + [1.0] * 287)}, "shares.*0 to 1.*vertex 0"),
        ({"wedges": np.zeros((5, 3), np.int32)}, "wedges.*each triangle"),
        ({"wedges": np.zeros((576, 3))}, "wedges.*integer.*float64"),
    ],
    ids=lambda value: str(value)[:30],
)
def test_bad_options_of_decimate(option, message):
    with pytest.raises(tolvol.InvalidInput, match=message):
        tolvol.decimate(VERTICES, TRIANGLES, VOLUME, **option)


def test_unknown_options_are_refused():
    with pytest.raises(TypeError):
        tolvol.decimate(VERTICES, TRIANGLES, VOLUME, tolerence=1)


def test_no_threads_everywhere():
    for call in (
        lambda: tolvol.ToleranceVolume(VERTICES, TRIANGLES, TOLERANCE, threads=0),
        lambda: VOLUME.check(VERTICES, TRIANGLES, threads=0),
        lambda: VOLUME.distance(VERTICES, threads=0),
        lambda: tolvol.directed_hausdorff(VERTICES, TRIANGLES, VERTICES, TRIANGLES, threads=0),
        lambda: tolvol.deviation(VERTICES, TRIANGLES, VERTICES, TRIANGLES, threads=0),
    ):
        with pytest.raises(tolvol.InvalidInput, match="threads must be at least 1, or None"):
            call()


@pytest.mark.parametrize(
    "points, faces, message",
    [
        (changed(VERTICES, (3, 1), np.nan), TRIANGLES, "point 3 is not finite"),
        (VERTICES, changed(TRIANGLES, (9, 0), 1000), r"faces\[9\].*1000"),
        (VERTICES, changed(TRIANGLES, (9, 0), -3), r"faces\[9\].*-3"),
        (VERTICES, TRIANGLES.astype(float), "faces.*integer.*float64"),
        (VERTICES[:, :2].copy(), TRIANGLES, r"points.*\(n, 3\)"),
        (VERTICES, TRIANGLES.ravel(), "faces"),
        (VERTICES, np.empty((4, 0), np.int32), "faces"),
        (VERTICES, np.zeros((4, 5), np.int32), "faces.*from 1 to 4"),
    ],
    ids=["NaN", "too large", "negative", "floats", "(n, 2)", "flat", "no corners", "five corners"],
)
def test_bad_pieces(points, faces, message):
    with pytest.raises(tolvol.InvalidInput, match=message):
        VOLUME.check(points, faces)


def test_other_bad_arguments_of_check():
    with pytest.raises(tolvol.InvalidInput, match="method.*guess.*certificate"):
        VOLUME.check(VERTICES, TRIANGLES, method="guess")
    with pytest.raises(tolvol.InvalidInput, match="groups.*each face"):
        VOLUME.check(VERTICES, TRIANGLES, groups=np.zeros(5, np.int32))
    with pytest.raises(tolvol.InvalidInput, match="point 2 is not finite"):
        VOLUME.distance(changed(VERTICES, (2, 0), np.inf))


@pytest.mark.parametrize("bound", [-1, np.nan])
def test_bad_bounds(bound):
    with pytest.raises(tolvol.InvalidInput, match="bound"):
        tolvol.directed_hausdorff(VERTICES, TRIANGLES, VERTICES, TRIANGLES, bound=bound)
    with pytest.raises(tolvol.InvalidInput, match="bound"):
        tolvol.deviation(VERTICES, TRIANGLES, VERTICES, TRIANGLES, bounds=(0.1, bound))


def test_bad_corners_of_wedges():
    corners = np.zeros((*TRIANGLES.shape, 2), np.float32)
    with pytest.raises(tolvol.InvalidInput, match="corners"):
        tolvol.wedges(TRIANGLES, corners[:-1])
    with pytest.raises(tolvol.InvalidInput, match="corners"):
        tolvol.wedges(TRIANGLES, None)


def test_float32_that_cannot_hold_the_tolerance():
    # At 1e6 one unit in the last place of float32 is 0.06: more than half of the tolerance.
    vertices = (VERTICES + [1e6, 0, 0]).astype(np.float32)
    volume = tolvol.ToleranceVolume(vertices, TRIANGLES, TOLERANCE)
    with pytest.raises(tolvol.InvalidInput, match="too small.*nearer to its origin") as refused:
        tolvol.decimate(vertices, TRIANGLES, volume)
    factor = float(re.search(r"at least ([\d.]+) times", str(refused.value))[1])
    tolvol.decimate(vertices, TRIANGLES, tolvol.ToleranceVolume(vertices, TRIANGLES, factor * TOLERANCE))
    with pytest.raises(tolvol.InvalidInput, match="too small"):
        tolvol.decimate(vertices, TRIANGLES, tolvol.ToleranceVolume(vertices, TRIANGLES, 0.8 * factor * TOLERANCE))
    exact = (VERTICES + [1e6, 0, 0]).astype(np.float64)
    tolvol.decimate(exact, TRIANGLES, tolvol.ToleranceVolume(exact, TRIANGLES, TOLERANCE))


def test_a_tolerance_below_double_precision():
    away = np.eye(4)
    away[:3, 3] = 1e17
    for tolerance, to_world in ((1e-15, None), (1e-5, away)):
        with pytest.raises(tolvol.InvalidInput, match="too small for double precision"):
            tolvol.ToleranceVolume(VERTICES, TRIANGLES, tolerance, to_world=to_world)


def test_a_mesh_outside_its_reference_names_count_and_first():
    with pytest.raises(tolvol.InvalidInput, match=r"576 .*0"):
        tolvol.decimate(VERTICES + [9, 0, 0], TRIANGLES, VOLUME)


LINES = np.stack([TRIANGLES[:, 0], TRIANGLES[:, 0], TRIANGLES[:, 1]], 1).astype(np.int32)
REFUSED = {
    "invalid_argument": (
        lambda: tolvol.decimate(VERTICES, TRIANGLES, VOLUME, placement="fastest"),
        lambda: tolvol.diagonal(VERTICES[:, :2].copy(), TRIANGLES),
        lambda: tolvol.ToleranceVolume(VERTICES, TRIANGLES, 0),
        lambda: tolvol.Camera((0, 0, 0), (0, 0, 0)),
    ),
    "invalid_mesh": (
        *(lambda mesh=mesh: tolvol.diagonal(*mesh[:2]) for name, mesh in BAD_MESHES.items() if name in UNUSABLE),
        lambda: tolvol.diagonal(0 * VERTICES, TRIANGLES),
        lambda: tolvol.decimate(VERTICES, LINES, tolvol.ToleranceVolume(VERTICES, LINES, TOLERANCE)),
        lambda: VOLUME.check(VERTICES, TRIANGLES + 1),
        lambda: VOLUME.distance(changed(VERTICES, (2, 0), np.inf)),
        lambda: tolvol.constrain(VERTICES, changed(VERTICES, (2, 0), np.inf), TRIANGLES, VOLUME),
        lambda: tolvol.deform(changed(VERTICES, (2, 0), np.inf), tolvol.Lattice(tolvol.lattice_points(2))),
    ),
    "invalid_transform": (
        lambda: tolvol.diagonal(VERTICES, TRIANGLES, to_world=np.diag([1, 1, 0, 1])),
        lambda: tolvol.diagonal(VERTICES, TRIANGLES, to_world=changed(EYE, (3, 0), 0.5)),
    ),
    "tolerance_too_large": (lambda: tolvol.ToleranceVolume(VERTICES, TRIANGLES, 50),),
    "tolerance_too_small": (
        lambda: tolvol.ToleranceVolume(VERTICES, TRIANGLES, 1e-15),
        lambda: tolvol.decimate(SHIFTED, TRIANGLES, tolvol.ToleranceVolume(SHIFTED, TRIANGLES, TOLERANCE)),
    ),
    "too_far": (lambda: VOLUME.distance(1e308 * VERTICES, to_world=np.diag([1e300, 1e300, 1e300, 1])),),
    "input_outside": (
        lambda: tolvol.decimate(VERTICES + [9, 0, 0], TRIANGLES, VOLUME),
        lambda: tolvol.smooth(VERTICES + [9, 0, 0], TRIANGLES, VOLUME),
        lambda: tolvol.constrain(VERTICES + [9, 0, 0], VERTICES, TRIANGLES, VOLUME),
    ),
    "reference_outside": (lambda: tolvol.decimate(VERTICES, TRIANGLES[100:], VOLUME),),
    "too_large": (lambda: tolvol.ToleranceVolume(VERTICES, TRIANGLES, 0.001, precision=1000),),
    "cancelled": (lambda: tolvol.decimate(VERTICES, TRIANGLES, VOLUME, progress=stopped()),),
}


def stopped():
    progress = tolvol.Progress()
    progress.cancel()
    return progress


@pytest.mark.parametrize(("code", "call"), [(code, call) for code, calls in REFUSED.items() for call in calls])
def test_errors_carry_a_code(code, call):
    with pytest.raises(tolvol.TolvolError) as refused:
        call()
    error = refused.value
    assert error.code == code and f'"{code}"' in tolvol.TolvolError.__doc__
    if code.endswith("_outside"):
        assert str(error).startswith(f"{error.count} faces") and f"face {error.first};" in str(error)
    else:
        assert error.count is None and error.first is None


def test_errors_are_what_python_expects():
    assert issubclass(tolvol.InvalidInput, tolvol.TolvolError) and issubclass(tolvol.InvalidInput, ValueError)
    assert issubclass(tolvol.ResourceLimit, tolvol.TolvolError)
    assert issubclass(tolvol.Cancelled, tolvol.TolvolError)
    assert tolvol.Cancelled("cancelled").code == "cancelled" and tolvol.GlUnavailable.code == "gl_unavailable"
    assert tolvol.__version__.count(".") == 2


def layouts(array):
    wide = np.zeros((len(array), 7), array.dtype)
    wide[:, 2:5] = array
    doubled = np.repeat(array, 2, axis=0)
    return {
        "columns of a wider array": wide[:, 2:5],
        "every other row": doubled[::2],
        "Fortran order": np.asfortranarray(array),
        "read only": np.frombuffer(array.tobytes(), array.dtype).reshape(array.shape),
        "backwards": array[::-1][::-1],
    }


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("layout", layouts(VERTICES))
def test_any_layout_gives_the_same(layout, dtype):
    vertices = VERTICES.astype(dtype)
    plain = tolvol.decimate(vertices, TRIANGLES, VOLUME)
    other = tolvol.decimate(layouts(vertices)[layout], layouts(TRIANGLES)[layout], VOLUME)
    assert np.array_equal(plain.vertices, other.vertices)
    assert np.array_equal(plain.triangles, other.triangles)


@pytest.mark.parametrize("dtype", [np.uint8, np.int64, np.uint32])
def test_any_integer_type_in_range_gives_the_same(dtype):
    vertices, triangles = meshes.sphere(2)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.2)
    plain = tolvol.decimate(vertices, triangles, volume)
    other = tolvol.decimate(vertices, triangles.astype(dtype), volume)
    assert np.array_equal(plain.vertices, other.vertices)
    assert np.array_equal(plain.triangles, other.triangles)
