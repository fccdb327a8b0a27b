# SPDX-License-Identifier: GPL-3.0-or-later
"""Judges results by code that the operations do not use: tolvol.directed_hausdorff, CGAL and NumPy."""

import subprocess

import numpy as np
import tolvol

import judge
import meshes

from . import ROOT
from .case import Finding

CGAL = ROOT / "build/release/tests/native/tolvol_cgal_judge"
CGAL_FACES = 1000
CGAL_SECONDS = 5
NO_MANIFOLD = 2  # CGAL's exit code for triangles that its mesh cannot hold


def within(run, of, to, tolerance, what):
    """Requires that every point of the mesh `of` (vertices, triangles: in the world) is within `tolerance` of `to`."""
    if not len(of[1]):
        return
    # If the case has a matrix, its vertices were rounded once more when they were mapped to the world.
    largest = max(np.abs(of[0]).max(), np.abs(to[0]).max())
    slack = 0 if run.case.to_world is None else 1e-15 * largest
    interval = run.call("hausdorff", lambda: tolvol.directed_hausdorff(*of, *to, bound=tolerance + slack, threads=1))
    if interval.lower > tolerance + slack:
        raise Finding(
            f"beyond: {what}", f"{what}: at least {interval.lower / tolerance} tolerances, {interval.position}"
        )
    if not interval.upper <= tolerance + slack:
        raise Finding(
            f"undecided: {what}",
            f"{what}: from {interval.lower / tolerance} to {interval.upper / tolerance} tolerances",
        )
    if run.case.options.get("cgal"):
        error = 0.01 * tolerance
        by_cgal = cgal_distance(of, to, error)
        if by_cgal is not None and by_cgal > tolerance + slack + error:
            raise Finding(f"CGAL: {what}", f"{what}: {by_cgal / tolerance} tolerances by CGAL, not {interval.upper}")


def _said(answer):
    if answer.returncode:
        raise RuntimeError(f"{CGAL.name} ended with {answer.returncode}: {answer.stderr.decode(errors='replace')}")
    return answer.stdout


def cgal_distance(of, to, error, seconds=CGAL_SECONDS):
    """Returns CGAL's one-sided Hausdorff distance with an error of at most `error`.

    Returns None if CGAL takes too long, or if a triangle has no area: CGAL 5.5.1 gave a distance between two segments that
    was 3 % too large.
    """
    if len(of[1]) + len(to[1]) > CGAL_FACES:
        return None
    corners = [np.ascontiguousarray(mesh[0][mesh[1]], np.float64) for mesh in (of, to)]
    for a, b, c in (faces.transpose(1, 0, 2) for faces in corners):
        longest = np.maximum.reduce([((p - q) ** 2).sum(1) for p, q in ((a, b), (b, c), (c, a))])
        if (np.linalg.norm(np.cross(b - a, c - a), axis=1) <= 1e-6 * longest).any():
            return None
    # The meshes are scaled to a size of about 1 around the origin: CGAL need not work at any scale to be a second judge.
    centre = (corners[1].min((0, 1)) + corners[1].max((0, 1))) / 2
    scale = max(np.abs(c - centre).max() for c in corners) or 1.0
    head = np.array([len(of[1]), len(to[1]), error / scale])
    data = b"".join(a.tobytes() for a in (head, *((c - centre) / scale for c in corners)))
    try:
        answer = subprocess.run([CGAL], input=data, capture_output=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return None
    return float(_said(answer)) * scale


def valid(run, vertices, triangles, dtype):
    if vertices.dtype != dtype:
        raise Finding("type", f"vertices came as {dtype} and went as {vertices.dtype}")
    if vertices.ndim != 2 or vertices.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise Finding("shape", f"vertices {vertices.shape}, triangles {triangles.shape}")
    if not np.isfinite(vertices).all():
        raise Finding(
            "not finite", f"vertex {np.flatnonzero(~np.isfinite(vertices).all(1))[0]} of the result is not finite"
        )
    if len(triangles) and not (0 <= triangles.min() and triangles.max() < len(vertices)):
        raise Finding("index", f"an index of the result is out of range: {triangles.min()}, {triangles.max()}")


def uncrossed(run, before, after, triangles, after_triangles=None):
    """Requires of stored positions that no pair of triangles crosses after a motion that did not cross before it.

    after_triangles: those after it, if they are others."""

    def pairs(vertices, triangles):
        return {tuple(pair) for pair in run.call("crossing_pairs", lambda: tolvol.crossing_pairs(vertices, triangles))}

    now = pairs(after, triangles if after_triangles is None else after_triangles)
    if now and (new := now - pairs(before, triangles)):
        raise Finding("crossings", f"{len(new)} pairs of faces cross that did not before: {min(new)}")


def crossings_by_cgal(vertices, triangles, seconds=CGAL_SECONDS):
    """Returns CGAL's number of pairs of triangles that cross.

    Returns None if CGAL takes too long, or if the welded triangles are no oriented manifold or one has no area.
    """
    if not 0 < len(triangles) <= CGAL_FACES:
        return None
    places, label = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    faces = label.reshape(-1)[triangles]
    a, b, c = places.astype(np.float64)[faces].transpose(1, 0, 2)
    longest = np.maximum.reduce([((p - q) ** 2).sum(1) for p, q in ((a, b), (b, c), (c, a))])
    if not (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12 * longest).all():
        return None
    head = np.array([len(places), len(faces)], np.float64)
    data = b"".join(np.ascontiguousarray(array, np.float64).tobytes() for array in (head, places, faces))
    try:
        answer = subprocess.run([CGAL, "crossings"], input=data, capture_output=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        return None
    return None if answer.returncode == NO_MANIFOLD else int(_said(answer))


def crossing_count(run, vertices, triangles, most=10**6):
    """Returns the number of pairs of triangles that cross, at most `most`. It is CGAL's, too, where a case asks for it."""
    count = len(run.call("crossing_pairs", lambda: tolvol.crossing_pairs(vertices, triangles, most=most)))
    if run.case.options.get("cgal") and count < most:
        by_cgal = crossings_by_cgal(vertices, triangles)
        if by_cgal is not None and by_cgal != count:
            raise Finding("CGAL: crossings", f"{count} pairs of triangles cross, by CGAL {by_cgal}")
    return count


def no_more_crossings(run, before, after, triangle_source):
    """Requires that no more pairs of triangles cross than before, but for sheets that lie exactly on each other.

    Such sheets are exempt from each other. triangle_source: for each triangle after, one before that it stands for.
    """
    sheet = double_sheets(*before)

    def count(mesh, of):
        pairs = np.asarray(run.call("crossing_pairs", lambda: tolvol.crossing_pairs(*mesh))).reshape(-1, 2)
        a, b = of[pairs].T
        return int(((a != b) | (a < 0)).sum())

    now, had = count(after, sheet[triangle_source]), count(before, sheet)
    if now > had:
        raise Finding("crossings", f"{now} pairs of faces cross, {had} did before")


def double_sheets(vertices, triangles):
    """Returns a label for each triangle: equal for those of sheets that lie on each other, and -1 for all others.

    A triangle is part of such a sheet if another one has its three positions. Sheets are connected by edges.
    """
    _, place = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    corners = np.sort(place.reshape(-1)[triangles], axis=1)
    _, label, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    label = label.reshape(-1)
    double = (count[label] > 1) & (np.diff(corners, axis=1) > 0).all(1)
    _, edge = np.unique(corners[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=0, return_inverse=True)
    edges = edge.reshape(-1, 3)
    sheet = np.where(double, label, -1)
    while True:  # Each edge gives its triangles the least of their labels, and so does each place.
        least = np.full(edges.max(initial=-1) + 1, len(triangles))
        np.minimum.at(least, edges[double].ravel(), np.repeat(sheet[double], 3))
        of_place = np.full(len(count), len(triangles))
        np.minimum.at(of_place, label[double], least[edges[double]].min(1))
        lower = sheet.copy()
        lower[double] = of_place[label[double]]
        if (lower == sheet).all():
            return sheet
        sheet = lower


ANGLE_PAIRS = 200_000  # of a face and a triangle of the reference; a second
ANGLE_ROUNDING = 1e-3  # degrees


def angles_kept(run, result, reference, report, angle):
    """Requires that the faces of the result have the angle to the reference (vertices, triangles) that was asked for.

    Neither is judged where a triangle is too thin for its normal, or where neighbours are oriented against each other.
    """
    case = run.case
    # In units of the size, so that no square is too large or too small for a double.
    faces, others = (case.world(vertices)[triangles] / case.size() for vertices, triangles in (result, reference))
    if not len(faces) or len(faces) * len(others) > ANGLE_PAIRS or report["normals"] is None:
        return
    for a, b, c in (corners.transpose(1, 0, 2) for corners in (faces, others)):
        longest = np.maximum.reduce([((p - q) ** 2).sum(1) for p, q in ((a, b), (b, c), (c, a))])
        if not (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-6 * np.sqrt(longest)).all():
            return
    facts = run.call("solidity", lambda: tolvol.solidity(*reference))
    if not (facts["manifold"] and facts["oriented"]):
        return
    tolerance = case.tolerance / case.size() * (1 + 1e-9)
    found = judge.angles_of(others, faces, tolerance)
    if "motion" in case.arrays:
        # A part of a mesh that was moved away from the reference may have been turned over, and is compared by its other
        # side then.
        found = np.minimum(found, judge.angles_of(others, faces[:, ::-1], tolerance))
    normals = report["normals"]
    beyond = (found > angle + ANGLE_ROUNDING).sum()
    if beyond > normals["exceeded_after"] + normals["unsure"]:
        raise Finding(
            "angle", f"{beyond} faces beyond {angle} degrees, up to {found.max()}, and by the report {normals}"
        )
    if normals["exceeded_after"] + normals["unsure"] == 0 and found.max() > normals["largest"] + ANGLE_ROUNDING:
        raise Finding("angle", f"{found.max()} degrees, where the report has {normals['largest']} as the largest")


def proper_faces(vertices, triangles):
    """Returns the faces with positions in place of vertices, without faces that are segments or points.

    A face that exists twice counts twice, because its copies may be the two sides of a sheet and may move apart.
    """
    places, label = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    faces = np.sort(label[triangles], 1)
    return places, faces[(np.diff(faces, axis=1) > 0).all(1)]


def edge_counts(faces):
    """Returns (edges (k, 2), the number of faces at each edge)."""
    return np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1), axis=0, return_counts=True)


def _components(faces):
    """Returns the parts that are connected by edges. Parts that only touch in a point are different: they may move apart."""
    if not len(faces):
        return 0
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    edges, side_edge = np.unique(sides, axis=0, return_inverse=True)
    return meshes.component_count(np.arange(len(edges))[:, None], side_edge.reshape(-1, 3))


def _lie_on_each_other(places, faces):
    """Whether faces lie upon each other somewhere: whether two of more than two faces at an edge leave it within 27 degrees.

    The inside of such sheets may move apart, and with it what meets only that.
    """
    corners = faces[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]].reshape(-1, 3)  # an edge, and the third corner
    _, edge, count = np.unique(np.sort(corners[:, :2], 1), axis=0, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1)
    for same in np.split(np.argsort(edge, kind="stable"), np.cumsum(count)[:-1]):
        if len(same) > 2:
            a, b = places[corners[same[0], :2]]
            along = (b - a) / np.linalg.norm(b - a)
            to_third = places[corners[same, 2]] - a
            away = to_third - np.outer(to_third @ along, along)
            away /= np.linalg.norm(away, axis=1, keepdims=True)
            if not (np.triu(away @ away.T, 1) < 0.89).all():
                return True
    return False


def connected_alike(run, before, after, joins=False):
    """Requires of the welded meshes that the result has no new edges of more than two faces, and that no component was lost,
    joined to another one, or taken apart.

    Sheets that lie upon each other may get new edges in common, because vertices inside of them are not tied together
    (docs/architecture.md, "Where sheets meet"). joins: whether T-junctions were joined. Then sheets that met there may be one
    component and share edges.
    """
    (places, faces), (new_places, new_faces) = proper_faces(*before), proper_faces(*after)
    had = (edge_counts(faces)[1] > 2).sum()
    edges, count = edge_counts(new_faces)
    if (count > 2).sum() > had and not joins and not _lie_on_each_other(places, faces):
        a, b = new_places[edges[count > 2][0]]
        raise Finding("non-manifold", f"{(count > 2).sum()} edges have more than two faces, {had} had: {a} to {b}")
    components, left = _components(faces), _components(new_faces)
    # Of sheets that meet along an edge, a point may be left in which they meet.
    if (left < components and not joins) or (left > components and not had):
        raise Finding("components", f"{components} components became {left}")
    parts, left = meshes.component_count(places, faces), meshes.component_count(new_places, new_faces)
    if left > parts and not _lie_on_each_other(places, faces):
        raise Finding("parts", f"{parts} parts, which hang together by points, became {left}")


def rims_alike(run, before, after, tolerance):
    """Requires that the boundaries before and after a one-sided operation are within the tolerance of each other.

    The boundary is the edges of one triangle, by stored position: a map to the world may round two positions, between
    which a boundary runs, to one. Meshes with repeated faces are not judged: these may be the two sides of a sheet, which
    may move apart, or one may be left of them.
    """
    (places, faces), (new_places, new_faces) = proper_faces(*before), proper_faces(*after)
    if len(np.unique(faces, axis=0)) < len(faces):
        return
    places, new_places = run.case.world(places), run.case.world(new_places)
    rim, new_rim = meshes.boundary_segments(places, faces), meshes.boundary_segments(new_places, new_faces)
    if (len(rim) == 0) != (len(new_rim) == 0):
        raise Finding("boundary", f"a boundary of {len(rim)} edges became one of {len(new_rim)}")
    if len(rim):
        within(run, (new_places, new_rim), (places, rim), tolerance, "boundary of the result to that of the input")
        within(run, (places, rim), (new_places, new_rim), tolerance, "boundary of the input to that of the result")
