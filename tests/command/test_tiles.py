# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of a decimation in cells: reading in blocks, cells, clipping, chunks and one cell's work."""

import math

import numpy as np
import pytest
import tolvol
from tolvol.command import mesh_files
from tolvol.command.mesh import Mesh
from tolvol.shared.errors import Refused
from tolvol.tiles import chunks, clipping, plan
from tolvol.tiles.cells import EVERYWHERE, Box, Cells, centroids
from tolvol.tiles.chunks import mesh_of
from tolvol.tiles.mapped import MappedMesh
from tolvol.tiles.rounds import Rounds, _expected_gain
from tolvol.tiles.scratch import Scratch
from tolvol.tiles.tile import Tile, decimate, measure

import meshes

OPTIONS = {
    "placement": "optimal",
    "effort": "fast",
    "crossings": "keep_out",
    "max_normal_angle": 90,
    "threads": None,
}


def written(path, vertices, triangles, dtype=np.float32):
    mesh_files.write(path, [Mesh("mesh", vertices.astype(dtype), triangles.astype(np.int32))], None)
    return path


def noisy(seed=1):
    return meshes.torus(columns=96, rows=48, noise=0.004, seed=seed)


# Reading --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_file_is_read_in_blocks_as_it_is_read_whole(tmp_path, dtype, monkeypatch):
    monkeypatch.setattr("tolvol.tiles.mapped._BLOCK", 100)
    mesh = MappedMesh(written(tmp_path / "a.ply", *noisy(), dtype))
    whole = mesh_files.read(tmp_path / "a.ply").objects[0]
    blocks = list(mesh.blocks())
    assert len(blocks) == len(mesh.blocks()) > 10
    found = np.concatenate(blocks)
    assert found.dtype == mesh.dtype == dtype and mesh.count == len(whole.triangles)
    assert np.array_equal(found, whole.vertices[whole.triangles])
    if dtype == np.float32:
        soup = MappedMesh(written(tmp_path / "a.stl", *noisy()))
        assert np.array_equal(np.concatenate(list(soup.blocks())), found)


def test_properties_beside_coordinates_and_big_endian_numbers_are_read(tmp_path):
    vertices = np.array([(1, 2, 3), (4, 5, 6), (7, 8, 10)], np.float32)
    rows = np.zeros(3, [("red", "u1"), ("z", ">f4"), ("y", ">f4"), ("x", ">f4")])
    for axis, name in enumerate("xyz"):
        rows[name] = vertices[:, axis]
    header = (
        "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty uchar red\nproperty float z\nproperty float y\n"
        "property float x\nelement face 1\nproperty uchar flag\nproperty list uchar int vertex_index\nend_header\n"
    )
    face = b"\7\3" + np.array([2, 0, 1], ">i4").tobytes()
    (tmp_path / "a.ply").write_bytes(header.encode() + rows.tobytes() + face)
    assert np.array_equal(MappedMesh(tmp_path / "a.ply").corners(0, 1), vertices[[[2, 0, 1]]])


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda data: b"", "the file is empty"),
        (lambda data: data[:-5], "the file ends inside its list of face elements"),
        (lambda data: data.replace(b"binary_little_endian", b"ascii"), "only binary files can be read in parts"),
        (lambda data: data.replace(b"property float z", b"property float w"), "its vertices have no x, y, z"),
        (lambda data: data[:-4] + b"\xff\xff\xff\x7f", "face 9216 names vertex 2147483647, but there are only 4608"),
        (lambda data: data[:-13] + b"\4" + data[-12:], "face 9216 has 4 vertices"),
        (lambda data: data.replace(b"element face 9216", b"element face 0"), "the file has no faces"),
        (lambda data: data.replace(b"element face 9216", b"element face 9215"), "10 bytes are left after all"),
    ],
)
def test_a_damaged_file_is_named_with_what_is_wrong(tmp_path, damage, message):
    path = written(tmp_path / "a.ply", *noisy())
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(Refused, match=message) as refusal:
        list(MappedMesh(path).blocks())
    assert str(path) in str(refusal.value)


def test_a_file_of_quads_is_refused_as_such(tmp_path):
    vertices = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], "<f4")
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    )
    quad = b"\4" + np.arange(4, dtype="<i4").tobytes()
    (tmp_path / "a.ply").write_bytes(header.encode() + vertices.tobytes() + 2 * quad)
    with pytest.raises(Refused, match="face 1 has 4 vertices: only files of triangles"):
        MappedMesh(tmp_path / "a.ply")


def test_a_vertex_that_is_not_finite_is_named_by_its_number(tmp_path):
    vertices, triangles = noisy()
    vertices[3000, 1] = np.nan
    with pytest.raises(Refused, match="vertex 3001 is not finite"):
        list(MappedMesh(written(tmp_path / "a.ply", vertices, triangles)).blocks())


# Cells ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 5, 16])
def test_cells_are_all_of_space_and_hold_about_as_many_points(count):
    points = np.random.default_rng(1).normal(size=(4000, 3))
    for boxes, most in ((None, 1.01), ((points, points + 0.1), 1.6)):
        cells = Cells(points, count, boxes)
        holders = np.array([box.holds(points) for box in cells.boxes])
        assert len(cells.boxes) == count and (holders.sum(0) == 1).all()
        assert np.array_equal(np.argmax(holders, 0), cells.of(points))
        assert holders.sum(1).max() <= most * len(points) / count + 1
        assert (np.array([box.holds(1e6 * points) for box in cells.boxes]).sum(0) == 1).all()


def test_points_on_each_other_are_not_divided():
    points = np.repeat([(1.0, 2.0, 3.0), (1.0, 2.0, 4.0)], 50, 0)
    boxes = Cells(points, 8).boxes
    assert sorted(box.holds(points).sum() for box in boxes) == [50, 50]
    assert Cells(points[:50], 8).boxes == [EVERYWHERE]


def test_the_parts_of_triangles_in_all_cells_are_the_triangles():
    corners = np.random.default_rng(2).normal(size=(300, 3, 3))

    def area(found):
        return np.linalg.norm(np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]), axis=1).sum() / 2

    cells = Cells(corners.mean(1), 7)
    parts = [clipping.clipped(corners, box) for box in cells.boxes]
    for part, box in zip(parts, cells.boxes):
        assert (part >= np.array(box.lower)).all() and (part <= np.array(box.upper)).all()
    assert sum(map(area, parts)) == pytest.approx(area(corners), rel=1e-12)
    whole = np.arange(900).reshape(-1, 3)
    part = np.concatenate(parts)
    found = tolvol.directed_hausdorff(
        part.reshape(-1, 3), np.arange(3 * len(part)).reshape(-1, 3), corners.reshape(-1, 3), whole
    )
    assert found.lower <= clipping.rounding(corners) < 1e-12


def test_no_point_of_a_triangle_that_lies_in_a_side_but_for_rounding_is_missed():
    random = np.random.default_rng(3)
    at, far = 0.3, np.inf
    missed = 0
    for _ in range(100):
        heights = at + np.spacing(at) * random.integers(-3, 4, 3)
        corners = np.column_stack([random.uniform(-2, 2, (3, 2)), heights])[None]
        below, above = random.uniform(-1, 1, 2)
        boxes = [
            Box((-far, -far, -far), (below, far, at)),
            Box((below, -far, -far), (far, far, at)),
            Box((-far, -far, at), (above, far, far)),
            Box((above, -far, at), (far, far, far)),
        ]
        for margin in (0, clipping.rounding(corners)):
            part = np.concatenate([clipping.clipped(corners, box.grown(margin)) for box in boxes])
            found = tolvol.directed_hausdorff(
                corners[0], np.array([(0, 1, 2)]), part.reshape(-1, 3), np.arange(3 * len(part)).reshape(-1, 3)
            )
            if margin:
                assert found.lower <= margin
            else:
                missed += found.lower > 0.01
    assert missed, "without the margin some points are missed"


# Chunks ---------------------------------------------------------------------------------------------------------------


def corners_of(found):
    """Returns the triangles of some chunks, (k, 3, 3), in their order."""
    return np.concatenate([vertices[triangles] for vertices, triangles in (chunk.mesh() for chunk in found)])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_chunks_are_gathered_by_boxes_with_a_vertex_at_each_position(tmp_path, dtype):
    vertices, triangles = noisy()
    corners = vertices[triangles].astype(dtype)
    writer = chunks.Writer(tmp_path / "blocks")
    for part in np.array_split(corners[:2000], 3):
        writer.add(part)
    both = [writer.end(), chunks.write(tmp_path / "rest", corners[2000:])]
    assert [chunk.count for chunk in both] == [2000, len(corners) - 2000]
    everything = chunks.gather(both, EVERYWHERE, 1)
    assert np.array_equal(everything[0][everything[1]], corners) and everything[0].dtype == dtype
    assert len(everything[0]) == len(vertices)
    box = Box((0.1, 0.2, -9), (0.8, 9, 9))
    found, number = chunks.gather(both, box, 1)
    expected = corners[(corners.max(1) >= box.lower).all(1) & (corners.min(1) <= box.upper).all(1)]
    assert 100 < len(expected) < len(corners) and np.array_equal(found[number], expected)
    assert len(np.unique(found, axis=0)) == len(found) == len(np.unique(number))
    for one, other in zip(chunks.gather(both, box, 4), (found, number)):
        assert np.array_equal(one, other)


def test_a_damaged_chunk_is_named(tmp_path):
    vertices, triangles = noisy()
    chunk = chunks.write(tmp_path / "c", vertices[triangles])
    data = bytearray((tmp_path / "c").read_bytes())
    data[1000] ^= 1
    (tmp_path / "c").write_bytes(data)
    with pytest.raises(Refused, match=f"{tmp_path}/c is damaged"):
        chunks.gather([chunk], EVERYWHERE, 1)


def test_a_folder_with_files_of_another_format_is_refused(tmp_path, monkeypatch):
    Scratch(tmp_path / "scratch", {"IN": "a.ply"}, resume=False).close(discard=False)
    Scratch(tmp_path / "scratch", {"IN": "a.ply"}, resume=True).close(discard=False)
    monkeypatch.setattr("tolvol.tiles.scratch._FORMAT", 99)
    with pytest.raises(Refused, match="the format of the scratch folder was 2 and is 99 now"):
        Scratch(tmp_path / "scratch", {"IN": "a.ply"}, resume=True)


def run(mesh, planned, scratch):
    """Returns the Result of the rounds of a MappedMesh at a tolerance of 0.02."""

    def each(stage, title, work, jobs):
        for job in jobs:
            yield work(job, None)

    folder = Scratch(scratch, {}, resume=False)
    try:
        return Rounds(mesh, planned, folder, 0.02, OPTIONS, each).run()
    finally:
        folder.close(discard=True)


# A cell ---------------------------------------------------------------------------------------------------------------


def rounds(tmp_path, reference, tolerance, counts, **options):
    """Returns the corners after rounds over so many cells each, in a folder of the test."""
    whole = (chunks.write(tmp_path / "reference", reference),)
    present = whole
    for number, count in enumerate(counts):
        mesh = corners_of(present)
        boxes = Cells(reference.mean(1), count, (mesh.min(1), mesh.max(1))).boxes
        tiles = [Tile(box, present, whole, tolerance, OPTIONS | options) for box in boxes]
        present = tuple(decimate(tile, tmp_path / f"{number}_{i}")[0] for i, tile in enumerate(tiles))
    return corners_of(present), present, whole


@pytest.mark.parametrize("kind", ["torus", "open", "cut", "soup"])
def test_the_results_of_cells_are_one_mesh_within_the_tolerance(tmp_path, kind):
    vertices, triangles = noisy()
    tolerance = 0.02
    if kind == "open":
        triangles = triangles[np.random.default_rng(3).random(len(triangles)) > 0.1]
    if kind == "cut":
        vertices, triangles = meshes.join((vertices, triangles), meshes.non_manifold(), meshes.degenerate())
    corners = vertices[triangles].astype(np.float32)
    if kind == "soup":
        corners = corners[np.random.default_rng(4).permutation(len(corners))]
    found, present, whole = rounds(tmp_path, corners, tolerance, (6, 4, 4))
    ours, theirs = mesh_of(found), mesh_of(corners)
    both = tolvol.hausdorff(*ours, *theirs, bound=tolerance)
    assert both.forward.upper <= tolerance and both.backward.upper <= tolerance
    assert len(found) < len(corners) / (6 if kind in ("torus", "soup") else 2)
    assert len(tolvol.crossing_pairs(*ours)) <= len(tolvol.crossing_pairs(*theirs))
    if kind in ("torus", "soup"):
        facts = tolvol.solidity(*ours)
        assert facts["closed"] and facts["manifold"] and facts["oriented"]
    # The cells' measurements tell the same.
    for count in (5, 7):
        boxes = Cells(corners.mean(1), count).boxes
        ends = np.array([measure(Tile(box, present, whole, tolerance, OPTIONS)) for box in boxes])
        for way, exact in enumerate((both.forward, both.backward)):
            lower, upper = ends[:, way].max(0)
            assert lower <= exact.upper and exact.lower <= upper <= tolerance * (1 + 1e-6)


@pytest.mark.parametrize("memory", [plan.FIXED + 800 * plan.OF_FIRST, 1_000_000_000])
def test_a_mesh_far_from_the_origin_is_proved(tmp_path, memory):
    vertices, triangles = noisy()
    mesh = MappedMesh(written(tmp_path / "a.ply", vertices + 5e6, triangles, np.float64))
    found = run(mesh, plan.Plan(mesh, 0.02, memory), tmp_path / "scratch")
    assert found.forward.upper <= 0.02 and found.backward.upper <= 0.02 and len(found.triangles) < len(triangles) / 6


def test_a_mesh_that_moved_is_seen_by_measuring_in_cells(tmp_path):
    vertices, triangles = meshes.torus()
    corners = vertices[triangles]
    moved = corners.copy()
    moved[moved[:, :, 0].min(1) > 1.2] += 0.05
    boxes = Cells(corners.mean(1), 4).boxes
    tiles = [(chunks.write(tmp_path / "a", moved),), (chunks.write(tmp_path / "b", corners),)]
    ends = np.array([measure(Tile(box, *tiles, 0.01, OPTIONS)) for box in boxes])
    assert (ends[:, :, 1].max(0) > 0.01).all()


def test_faces_in_a_plane_whose_centroids_round_out_of_it_are_not_lost(tmp_path):
    x = 1.5000000000000004
    assert (x + x + x) / 3 != x
    vertices, triangles = meshes.box(upper=np.array([x, 1, 1]))
    for _ in range(3):
        vertices, triangles = meshes.subdivide(vertices, triangles)
    corners = vertices[triangles]
    assert (centroids(corners) >= corners.min(1)).all() and (centroids(corners) <= corners.max(1)).all()
    # The face at x is on the side of cells that divide it.
    side = np.nextafter(x, 2)
    middle = [Box((side, low, -np.inf), (np.inf, high, np.inf)) for low, high in ((-np.inf, 0.3), (0.3, np.inf))]
    boxes = [Box((-np.inf,) * 3, (side, 0.6, np.inf)), Box((-np.inf, 0.6, -np.inf), (side, np.inf, np.inf)), *middle]
    whole = (chunks.write(tmp_path / "whole", corners),)
    present = tuple(
        decimate(Tile(box, whole, whole, 0.01, OPTIONS), tmp_path / str(i))[0] for i, box in enumerate(boxes)
    )
    found = corners_of(present)
    assert tolvol.solidity(*mesh_of(found))["closed"] and len(found) < len(corners)


def test_cells_smaller_than_the_tolerance_leave_their_faces(tmp_path):
    vertices, triangles = meshes.sphere(3)
    corners = vertices[triangles]
    found, _, _ = rounds(tmp_path, corners, 1.9, (40,))
    assert sorted(map(tuple, found.reshape(-1, 9))) == sorted(map(tuple, corners.reshape(-1, 9)))


def test_a_face_whose_centroid_is_rounded_into_another_cell_is_kept(tmp_path):
    x = 1.4000000000000008
    at = np.full(3, x).mean()
    assert at > x
    y, z = np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 5))
    grid = np.column_stack([np.full(25, x), y.ravel(), z.ravel()])
    a = (5 * np.arange(4)[:, None] + np.arange(4)).ravel()
    corners = grid[np.concatenate([np.stack([a, a + 1, a + 6], 1), np.stack([a, a + 6, a + 5], 1)])]
    far = np.inf
    boxes = [
        Box((-far,) * 3, (at, 0.6, far)),
        Box((-far, 0.6, -far), (at, far, far)),
        Box((at, -far, -far), (far,) * 3),
    ]
    whole = (chunks.write(tmp_path / "reference", corners),)
    found = corners_of(
        decimate(Tile(box, whole, whole, 0.001, OPTIONS), tmp_path / str(i))[0] for i, box in enumerate(boxes)
    )
    area = np.linalg.norm(np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(1)


# The plan -------------------------------------------------------------------------------------------------------------


def memory_for(of_triangles):
    """Returns the memory that leaves so many bytes for the triangles of a cell if the grid takes all that it may."""
    return plan.FIXED + math.ceil(of_triangles / (1 - plan.OF_GRID))


def test_the_cells_fit_the_memory_and_the_last_round_is_whole_if_it_can_be(tmp_path):
    vertices, triangles = noisy()
    mesh = MappedMesh(written(tmp_path / "a.ply", vertices, triangles))
    everything = chunks.write(tmp_path / "everything", vertices[triangles])
    little = chunks.write(tmp_path / "little", vertices[triangles][::20])

    def cells(of_triangles, left):
        planned = plan.Plan(mesh, 0.01, memory_for(of_triangles))
        return len(planned.first.boxes), len(planned.later([left]).boxes)

    assert cells(mesh.count * plan.OF_FIRST_IF_SHORT, everything)[0] == 1
    assert cells(mesh.count * (plan.OF_REFERENCE + plan.OF_MESH), everything) == (1, 1)
    of_little = mesh.count * plan.OF_REFERENCE + little.count * plan.OF_MESH
    assert cells(of_little, little) == (4, 1)
    # Where nothing has gone, later rounds need as many cells as the first.
    assert min(cells(of_little, everything)) >= 3
    first, later = cells(1000 * plan.OF_FIRST_IF_SHORT, little)
    assert mesh.count / 1000 <= first < 2 * mesh.count / 1000
    assert later < 0.6 * first


def test_there_are_no_cells_for_a_later_round_that_cannot_fit_the_memory(tmp_path):
    vertices, triangles = noisy()
    mesh = MappedMesh(written(tmp_path / "a.ply", vertices, triangles))
    crowded = chunks.write(tmp_path / "crowded", np.concatenate([vertices[triangles][:1]] * 2000))
    planned = plan.Plan(mesh, 0.01, plan.FIXED + 1000 * plan.OF_FIRST_IF_SHORT)
    assert planned.later([crowded]) is None
    needed = mesh.count * plan.OF_REFERENCE + 2000 * plan.OF_MESH
    assert plan.FIXED + needed < planned.needed([crowded]) <= memory_for(needed)


def test_a_short_tolerance_needs_more_memory(tmp_path):
    mesh = MappedMesh(written(tmp_path / "a.ply", *noisy()))

    def count(tolerance):
        return len(plan.Plan(mesh, tolerance, memory_for(mesh.count * plan.OF_FIRST)).first.boxes)

    assert count(0.02) == 1 and count(0.01) > 1


def test_a_small_grid_leaves_more_memory_to_the_triangles(tmp_path):
    mesh = MappedMesh(written(tmp_path / "a.ply", *noisy()))

    def count(tolerance):
        return len(plan.Plan(mesh, tolerance, plan.FIXED + mesh.count * plan.OF_FIRST * 11 // 10).first.boxes)

    assert count(0.2) == 1 and count(0.02) > 1


def test_too_little_memory_is_refused_with_what_is_needed(tmp_path):
    mesh = MappedMesh(written(tmp_path / "a.ply", *noisy()))
    with pytest.raises(Refused, match=r"--memory: 1 MB is too little: .* need at least \d+ MB"):
        plan.Plan(mesh, 0.1, 1_000_000)
    with pytest.raises(Refused, match="--memory"):
        plan.Plan(mesh, 1.0, plan.FIXED + 100 * plan.OF_FIRST)


def are_beside_a_side(points, cells, length):
    beside = [box.grown(length).holds(points) & ~box.grown(-length).holds(points) for box in cells.boxes]
    return np.any(beside, 0)


@pytest.mark.parametrize("size", [(1, 1, 1), (10, 1, 1)])
@pytest.mark.parametrize("count", [2, 3, 4, 7])
def test_the_sides_of_cells_keep_away_from_the_faces_beside_those_before(count, size):
    points, unit = np.random.default_rng(1).uniform(size=(20_000, 3)) * size, max(size) / 1000
    cells = Cells(points, count)
    for _ in range(5):
        # A round leaves small faces beside the sides of its cells, and few others.
        beside = are_beside_a_side(points, cells, 50 * unit / count)
        small, others = points[beside], points[~beside][::50]
        boxes = np.concatenate([small - unit, others - 20 * unit]), np.concatenate([small + unit, others + 20 * unit])
        cells = Cells(points, count, boxes)
        assert np.count_nonzero(are_beside_a_side(small, cells, unit)) < len(small) / 50


def test_cells_know_how_many_boxes_are_near_them():
    random = np.random.default_rng(1)
    lowest = random.normal(size=(3000, 3))
    highest = lowest + random.exponential(0.1, size=(3000, 3))
    cells = Cells(lowest, 12)
    expected = [box.grown(0.2).meets_boxes(lowest, highest).sum() for box in cells.boxes]
    assert cells.count_near(lowest, highest, 0.2).tolist() == expected and min(expected) > 3000 / 12


def test_triangles_that_reach_into_many_cells_need_memory_in_each(tmp_path):
    random = np.random.default_rng(2)
    ends = np.repeat(random.normal(size=(2000, 1, 3)), 3, 1)
    ends[:, 1, 0] += 0.01
    short = MappedMesh(written(tmp_path / "short.ply", ends.reshape(-1, 3), np.arange(6000).reshape(-1, 3)))
    ends[:, 2, 2] += 2
    long = MappedMesh(written(tmp_path / "long.ply", ends.reshape(-1, 3), np.arange(6000).reshape(-1, 3)))
    few, more = (
        len(plan.Plan(mesh, 0.001, plan.FIXED + 800 * plan.OF_FIRST_IF_SHORT).first.boxes) for mesh in (short, long)
    )
    assert few <= 4 < more


def test_hopelessly_little_memory_for_many_triangles_is_refused_after_few_tries(tmp_path, monkeypatch):
    mesh, made = MappedMesh(written(tmp_path / "a.ply", *meshes.plate(n=257))), []
    monkeypatch.setattr(plan, "Cells", lambda points, count, boxes: made.append(count) or Cells(points, count, boxes))
    for tolerance, memory in ((0.001, 1_000_000), (0.5, plan.FIXED + 100 * plan.OF_FIRST)):
        with pytest.raises(Refused, match="--memory"):
            plan.Plan(mesh, tolerance, memory)
    assert sum(made) < mesh.count / 8  # Cells of a triangle each would take minutes.


# A run ----------------------------------------------------------------------------------------------------------------


def test_a_run_that_goes_on_does_no_finished_step_again(tmp_path):
    mesh = MappedMesh(written(tmp_path / "a.ply", *noisy()))
    planned = plan.Plan(mesh, 0.02, plan.FIXED + 2000 * plan.OF_FIRST)
    done = []

    def run(last):
        def each(stage, title, work, jobs):
            for job in jobs:
                if title.startswith(last):
                    raise KeyboardInterrupt
                done.append((title, work(job, None)))
                yield done[-1]

        folder = Scratch(tmp_path / "scratch", {}, resume=bool(done))
        try:
            Rounds(mesh, planned, folder, 0.02, OPTIONS, each).run()
        finally:
            folder.close(discard=False)

    with pytest.raises(KeyboardInterrupt):
        run("round 3")
    before = {title for title, _ in done}
    assert before == {"reading", "round 1", "round 2"}
    done.clear()
    done.append(("interrupted", None))
    run("nothing")
    assert not before & {title for title, _ in done}


def test_there_are_at_most_six_rounds_and_more_memory_is_proposed(tmp_path, monkeypatch):
    vertices, triangles = noisy()
    mesh = MappedMesh(written(tmp_path / "a.ply", vertices, triangles))
    planned = plan.Plan(mesh, 0.02, plan.FIXED + 2000 * plan.OF_FIRST)
    monkeypatch.setattr("tolvol.tiles.rounds._LEAST_GAIN", -1)  # Each round is worth another.
    found = run(mesh, planned, tmp_path / "scratch")
    assert len(found.rounds) == 6 and found.rounds[-1][0] > 1
    (note,) = found.warnings
    needed = int(note.partition("--memory ")[2].partition("MB")[0]) * 1_000_000
    left = chunks.write(tmp_path / "left", found.vertices[found.triangles])
    assert len(plan.Plan(mesh, 0.02, needed).later([left]).boxes) == 1
    assert f"the last round had {found.rounds[-1][0]} cells" in note


@pytest.mark.parametrize(
    "counts, expected",
    [
        ([1000, 500, 250], 0.5),
        ([1000, 100, 90], 0.1 * 0.1 / 0.9),
        ([1000, 1000, 900], 0.1),
        ([9, 8, 8], 0),
        ([5, 0, 0], 0),
    ],
)
def test_the_gain_of_a_round_falls_as_it_fell_before(counts, expected):
    assert _expected_gain(counts) == pytest.approx(expected)


def test_rounds_go_on_in_a_single_cell_while_they_gain(tmp_path, monkeypatch):
    mesh = MappedMesh(written(tmp_path / "a.ply", *noisy()))
    planned = plan.Plan(mesh, 0.02, plan.FIXED + mesh.count * 900)
    found = run(mesh, planned, tmp_path / "scratch")
    cells = [count for count, _ in found.rounds]
    assert cells[0] > 1 and cells[1] == 1 and len(cells) < 6
    monkeypatch.setattr("tolvol.tiles.rounds._LEAST_GAIN", -1)  # Each round is worth another.
    assert [count for count, _ in run(mesh, planned, tmp_path / "again").rounds] == [cells[0], 1, 1, 1, 1, 1]
    whole = plan.Plan(mesh, 0.02, 1_000_000_000)
    assert len(run(mesh, whole, tmp_path / "whole").rounds) == 1, (
        "what a single cell leaves of the reference is the result"
    )
