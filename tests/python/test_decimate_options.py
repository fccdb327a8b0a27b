# SPDX-License-Identifier: GPL-3.0-or-later
"""Each option of tolvol.decimate has a test here that fails when the option is ignored."""

import numpy as np
import pytest
import tolvol

import meshes
from judge import assert_promise, assert_sources, decimate, distances

TORUS = meshes.torus(noise=0.001)
TOLERANCE = 0.01 * tolvol.diagonal(*TORUS)


def test_without_a_volume_nothing_but_the_target_stops_it():
    vertices, triangles = TORUS
    result = tolvol.decimate(vertices, triangles, None, target_triangles=60)
    assert 58 < len(result.triangles) <= 60
    assert distances(vertices, triangles, result)[0].lower > TOLERANCE
    with pytest.raises(tolvol.InvalidInput, match="target"):
        tolvol.decimate(vertices, triangles, None)


def contains_rows(rows, table):
    return np.isin(rows.view([("", rows.dtype)] * 3), table.view([("", table.dtype)] * 3)).all()


def test_placement_subset_keeps_original_vertices_bit_for_bit():
    vertices, triangles = TORUS
    vertices = vertices.astype(np.float32)
    subset = decimate(vertices, triangles, TOLERANCE, placement="subset")
    optimal = decimate(vertices, triangles, TOLERANCE, placement="optimal")
    assert np.array_equal(subset.vertices, vertices[subset.vertex_source])
    assert not contains_rows(optimal.vertices, vertices)
    assert len(optimal.triangles) < len(subset.triangles)
    # Every corner of a subset result reads the attributes of an original corner, unmixed.
    assert (subset.source_weights.max(-1) == 1).all()
    assert assert_sources(vertices, triangles, subset, TOLERANCE) == 0


def test_two_sided_keeps_what_one_sided_may_lose():
    vertices, triangles = meshes.spike()
    lost = []
    for tolerance in (0.05, 0.08, 0.12):
        both = decimate(vertices, triangles, tolerance, two_sided=True)
        one = decimate(vertices, triangles, tolerance, two_sided=False)
        assert_promise(vertices, triangles, both, tolerance)
        assert_promise(vertices, triangles, one, tolerance, two_sided=False)
        lost.append(distances(vertices, triangles, one)[1].lower > tolerance)
    # Whether a collapse shortens the spike depends on the order of all other collapses, so it does not at every tolerance.
    assert any(lost)


def boundary(vertices, triangles):
    """The edges of one triangle, by position."""
    places, number = np.unique(vertices, axis=0, return_inverse=True)
    return places, meshes.boundary_segments(places, number.reshape(-1)[triangles])


def assert_boundaries_alike(vertices, triangles, result, tolerance):
    rim, kept = boundary(vertices, triangles), boundary(result.vertices, result.triangles)
    assert tolvol.directed_hausdorff(*kept, *rim, bound=tolerance).upper <= tolerance
    assert tolvol.directed_hausdorff(*rim, *kept, bound=tolerance).upper <= tolerance


def test_one_sided_keeps_boundaries_and_components():
    plate, ball = meshes.plate(33), meshes.sphere(3, 0.02, (0.5, 0.5, 0.5))
    vertices, triangles = meshes.join(plate, ball)
    result = decimate(vertices, triangles, 0.03, two_sided=False)
    assert meshes.component_count(result.vertices, result.triangles) == 2
    assert_boundaries_alike(vertices, triangles, result, 0.03)


@pytest.mark.parametrize("placement", ["subset", "optimal"])
@pytest.mark.parametrize("effort", ["fast", "thorough"])
def test_one_sided_keeps_a_boundary_whose_vertices_stay_where_they_are(effort, placement):
    """Where a vertex of the boundary vanishes into one that does not move, the edge before it has another end, too."""
    vertices, triangles = meshes.open_star(50)
    for tolerance in (0.1, 0.12):
        result = decimate(
            vertices, triangles, tolerance, two_sided=False, effort=effort, placement=placement, crossings="allow"
        )
        assert_boundaries_alike(vertices, triangles, result, tolerance)
        assert len(result.triangles) < 0.8 * len(triangles)


@pytest.mark.parametrize("effort", ["fast", "thorough"])
def test_one_sided_takes_no_edge_of_three_faces_for_a_boundary(effort):
    vertices, triangles, locked = meshes.flap_along_a_hairpin()
    result = decimate(vertices, triangles, 0.06, two_sided=False, effort=effort, locked=locked)
    assert_boundaries_alike(vertices, triangles, result, 0.06)
    assert len(result.triangles) < len(triangles)


@pytest.mark.parametrize("effort", ["fast", "thorough"])
def test_one_sided_keeps_an_ear_on_an_edge_of_another_sheet(effort):
    """Without the ear the edge below it would be no boundary, because a triangle with its own vertices ends there, too."""
    corners = [(0, 0, 0), (4, 0, 0), (2, -3, 0), (2, 0.45, 0), (0, 0, 0), (4, 0, 0), (2, 0, 3)]
    vertices, triangles = np.array(corners, np.float32), np.array([(0, 2, 1), (0, 1, 3), (4, 5, 6)], np.int32)
    options = {"effort": effort, "crossings": "allow", "max_normal_angle": 180}
    assert len(decimate(vertices, triangles, 0.5, two_sided=False, **options).triangles) == 3
    alone = decimate(vertices, triangles[:2], 0.5, two_sided=False, **options)
    assert len(alone.triangles) == 1
    assert_boundaries_alike(vertices, triangles[:2], alone, 0.5)


def test_one_sided_makes_no_boundary_where_two_sheets_have_an_edge_each():
    """The sheets are joined along the edge 1 3, and the inner edges 1 2 and 5 6 lie on each other: a boundary there is none."""
    corners = [(0.5, 0.25, -0.03), (1, 0, 0), (1, 0.25, 0.25), (1.5, 0, 0.16)]
    corners += [(0.5, 0, 0.02), *corners[1:], (1.5, 0.25, 0.02)]
    vertices = np.array(corners, np.float32)
    triangles = np.array([(1, 2, 0), (1, 3, 2), (4, 5, 6), (5, 7, 8), (5, 8, 6)], np.int32)
    result = decimate(vertices, triangles, 0.3, two_sided=False)
    assert_boundaries_alike(vertices, triangles, result, 0.3)


@pytest.mark.parametrize("target", [5000, 1001, 400])
def test_target_triangles(target):
    vertices, triangles = TORUS
    result = decimate(vertices, triangles, 3 * TOLERANCE, target_triangles=target)
    assert target - 2 < len(result.triangles) <= target
    assert result.report["stopped_by"] == "target"
    assert_promise(vertices, triangles, result, 3 * TOLERANCE)


def test_a_target_that_the_tolerance_forbids():
    result = decimate(*TORUS, TOLERANCE, target_triangles=20)
    assert len(result.triangles) > 20
    assert result.report["stopped_by"] == "tolerance"


def test_locked_vertices_stay():
    vertices, triangles = TORUS
    locked = vertices[:, 0] > 0.8
    result = decimate(vertices, triangles, TOLERANCE, locked=locked)
    kept = result.vertex_map[locked]
    assert len(np.unique(kept)) == locked.sum()
    assert np.array_equal(result.vertices[kept], vertices[locked])
    assert sum(result.report["locked"].values()) == locked.sum()
    free = decimate(vertices, triangles, TOLERANCE)
    assert len(np.unique(free.vertex_map[locked])) < locked.sum()
    assert not free.report["locked"]


@pytest.mark.parametrize("two_sided", [True, False])
def test_shares_narrow_the_tolerance_around_their_vertices(two_sided):
    vertices, triangles = TORUS
    shares = np.where(vertices[:, 0] < 0, 0.3, 1.0)
    result = decimate(vertices, triangles, TOLERANCE, shares=shares, two_sided=two_sided)
    there = result.triangles[(result.vertices[result.triangles, 0] < -0.2).all(1)]
    judged = tolvol.directed_hausdorff(result.vertices, there, vertices, triangles, bound=0.3 * TOLERANCE)
    assert 0.2 * TOLERANCE < judged.upper <= 0.3 * TOLERANCE
    assert len(result.triangles) > 1.3 * len(decimate(vertices, triangles, TOLERANCE, two_sided=two_sided).triangles)
    assert np.array_equal(
        result.vertices, decimate(vertices, triangles, TOLERANCE, shares=shares, two_sided=two_sided).vertices
    )


def with_a_far_patch():
    """Returns a sphere with eight neighbouring vertices pulled far out, and the sphere without that."""
    vertices, triangles = meshes.sphere(4)
    moved = vertices.copy()
    patch = np.argsort(-vertices[:, 2])[:8]
    moved[patch] *= 1.5
    outside = np.isin(triangles, patch).any(1)
    return moved, triangles, outside, vertices


def test_outside_is_an_error_by_default():
    moved, triangles, outside, vertices = with_a_far_patch()
    with pytest.raises(tolvol.InvalidInput, match=rf"{outside.sum()}\b.*{np.flatnonzero(outside)[0]}\b"):
        decimate(moved, triangles, 0.02, reference=(vertices, triangles))


def test_outside_keep_leaves_those_faces_as_they_are():
    moved, triangles, outside, vertices = with_a_far_patch()
    result = decimate(moved, triangles, 0.02, reference=(vertices, triangles), outside="keep")
    assert result.report["outside"]["faces"] == outside.sum()
    assert result.report["outside"]["first"] == np.flatnonzero(outside)[0]
    assert np.isin(np.flatnonzero(outside), result.triangle_source).all()
    kept = np.isin(result.triangle_source, np.flatnonzero(outside))
    same = moved[triangles[result.triangle_source[kept]]]
    assert np.array_equal(result.vertices[result.triangles[kept]], same)
    assert len(result.triangles) < len(triangles) / 2
    rest = tolvol.directed_hausdorff(result.vertices, result.triangles[~kept], vertices, triangles, bound=0.02)
    assert rest.upper <= 0.02


def with_a_seam():
    """Returns a torus cut in six pieces like a cake, whether each triangle is in an odd piece, and the wedges."""
    vertices, triangles = TORUS
    centre = vertices[triangles].mean(1)
    side = (np.arctan2(centre[:, 1], centre[:, 0]) // (np.pi / 3)).astype(int) % 2
    values = np.zeros((*triangles.shape, 2), np.float32)
    values[..., 0] = side[:, None]
    return vertices, triangles, side, tolvol.wedges(triangles, values)


@pytest.mark.parametrize("placement", ["optimal", "subset"])
def test_wedges_keep_corners_on_their_side_of_a_seam(placement):
    vertices, triangles, side, wedges = with_a_seam()

    def crossing(result):
        return (side[result.source_triangle] != side[result.triangle_source][:, None]).sum()

    kept = decimate(vertices, triangles, TOLERANCE, wedges=wedges, placement=placement)
    assert crossing(kept) == 0
    assert len(kept.triangles) < len(triangles) / 4
    assert_promise(vertices, triangles, kept, TOLERANCE)
    assert_sources(vertices, triangles, kept, TOLERANCE)
    assert crossing(decimate(vertices, triangles, TOLERANCE, placement=placement)) > 0


def test_vertices_of_a_seam_keep_their_position():
    vertices, triangles, side, wedges = with_a_seam()
    sides = np.zeros((len(vertices), 2), bool)
    for k in range(3):
        sides[triangles[:, k], side] = True
    on_seam = sides.all(1)
    result = decimate(vertices, triangles, TOLERANCE, wedges=wedges, placement="optimal")
    continued = on_seam[result.vertex_source]
    assert continued.any() and not continued.all()
    assert np.array_equal(result.vertices[continued], vertices[result.vertex_source[continued]])
    # Both sides still meet along the seam: no vertex of the seam was merged into a vertex away from the seam.
    assert on_seam[result.vertex_source[result.vertex_map[on_seam]]].all()


def test_to_world_of_the_mesh_is_used():
    vertices, triangles = TORUS
    to_world = meshes.matrix(np.diag([2, 1, 0.5]), (3, 0, 0))
    volume = tolvol.ToleranceVolume(vertices, triangles, TOLERANCE, to_world=to_world)
    with pytest.raises(tolvol.InvalidInput):
        tolvol.decimate(vertices, triangles, volume)
    placed = meshes.transform(to_world, vertices)
    result = tolvol.decimate(placed, triangles, volume)
    assert_promise(placed, triangles, result, TOLERANCE)


@pytest.mark.parametrize("threads", [2, 3])
@pytest.mark.parametrize("options", [{}, {"placement": "subset"}, {"two_sided": False}], ids=str)
def test_threads_change_nothing(options, threads):
    vertices, triangles = TORUS
    one = decimate(vertices, triangles, TOLERANCE, threads=1, **options)
    more = decimate(vertices, triangles, TOLERANCE, threads=threads, **options)
    for name in ("vertices", "triangles", "vertex_map", "vertex_source", "triangle_source", "source_triangle"):
        assert np.array_equal(getattr(one, name), getattr(more, name)), name
    assert np.array_equal(one.source_weights, more.source_weights)


@pytest.mark.parametrize("precision", [0.25, 1, 3])
def test_the_promise_holds_at_any_precision(precision):
    vertices, triangles = TORUS
    result = decimate(vertices, triangles, TOLERANCE, precision=precision)
    assert_promise(vertices, triangles, result, TOLERANCE)


@pytest.mark.parametrize("seed", [0, 4, 6])
def test_original_vertices_keep_their_bits_under_a_matrix(seed):
    """Mapping to the frame and back may change the last bit of a coordinate."""
    vertices, triangles = meshes.torus(20, 10, noise=0.01, seed=seed)
    vertices = vertices.astype(np.float32)
    sizes = np.random.default_rng(seed).uniform(0.3, 3, 3)
    place = meshes.matrix(meshes.random_rotation(seed) @ np.diag(sizes))
    side = vertices[triangles].mean(1)[:, 0] > 0
    wedges = tolvol.wedges(triangles, np.repeat(side[:, None, None], 3, axis=1).astype(np.float32))
    options = {"placement": "subset", "effort": "thorough", "wedges": wedges}
    result = decimate(vertices, triangles, 0.08, to_world=place, **options)
    assert len(result.triangles) < len(triangles)
    assert np.array_equal(result.vertices, vertices[result.vertex_source])


def test_a_coarse_grid_costs_few_triangles():
    """The grid is coarse where parts are small for the size of the whole."""
    vertices, triangles = TORUS
    volumes = [tolvol.ToleranceVolume(vertices, triangles, TOLERANCE, precision=p) for p in (1, 1 / 64)]
    assert volumes[1].memory < 0.75 * volumes[0].memory
    fine, coarse = (tolvol.decimate(vertices, triangles, volume) for volume in volumes)
    assert len(coarse.triangles) <= 1.25 * len(fine.triangles)


def test_locks_of_a_dropped_face_hold_where_the_face_is_that_stands_in_for_it():
    """To a sheet two faces are added that meet in one vertex. The first of them repeats a face of the sheet."""
    x = np.linspace(0, 1, 21)
    sheet = np.stack([*np.meshgrid(x, x), np.zeros((21, 21))], -1).reshape(-1, 3)
    triangles = meshes.grid_triangles(21, 21)
    again, other = sheet[triangles[400]], sheet[triangles[400, 0]] + [[0, 0, 1], [0, 1, 1]]
    vertices = np.concatenate([sheet, again, other])
    a, b, c, d, e = np.arange(5) + len(sheet)
    triangles = np.concatenate([triangles, [[a, b, c], [a, d, e]]]).astype(np.int32)
    locked = np.isin(np.arange(len(vertices)), [a, b])
    result = decimate(vertices, triangles, 0.01, locked=locked)
    edges = result.vertices[result.triangles[:, [0, 1, 1, 2, 2, 0]]].reshape(-1, 2, 3)
    ends = vertices[[a, b]]
    assert ((edges == ends).all((1, 2)) | (edges == ends[::-1]).all((1, 2))).any()


def shell(wall):
    """A sphere inside a sphere, both closed."""
    outer, inner = meshes.sphere(4, 1), meshes.sphere(4, 1 - wall)
    return meshes.join(outer, (inner[0], inner[1][:, ::-1]))


def test_thin_walls_stay_uncrossed():
    vertices, triangles = shell(0.01)
    assert len(tolvol.crossing_pairs(vertices, triangles)) == 0
    kept_out = decimate(vertices, triangles, 0.03)
    assert len(tolvol.crossing_pairs(kept_out.vertices, kept_out.triangles)) == 0
    assert len(kept_out.triangles) < len(triangles) / 6
    assert_promise(vertices, triangles, kept_out, 0.03)
    allowed = decimate(vertices, triangles, 0.03, crossings="allow")
    assert len(tolvol.crossing_pairs(allowed.vertices, allowed.triangles)) > 10
    with pytest.raises(tolvol.InvalidInput, match="crossings"):
        decimate(vertices, triangles, 0.03, crossings="some")


def test_crossing_pairs_end_at_most():
    vertices, triangles = meshes.join(TORUS, (TORUS[0] + [0.3, 0.1, 0.05], TORUS[1]))
    pairs = tolvol.crossing_pairs(vertices, triangles)
    assert len(pairs) > 20 and pairs.dtype == np.int32 and (pairs[:, 0] < pairs[:, 1]).all()
    some = tolvol.crossing_pairs(vertices, triangles, most=7, threads=1)
    assert len(some) == 7 and set(map(tuple, some)) < set(map(tuple, pairs))
    assert np.array_equal(tolvol.crossing_pairs(vertices, triangles, most=7, threads=3), some)
    with pytest.raises(tolvol.InvalidInput, match="most"):
        tolvol.crossing_pairs(vertices, triangles, most=0)
