# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the places where a mesh and its reference are farthest from each other, and keeps the ones that are shown.

A place is a connected region of faces that are not proved to be within the tolerance. If there is none, the places are the
vertices whose distance is larger than that of their neighbours, and the point with the largest distance.
"""

from dataclasses import dataclass, replace

import numpy as np

from .. import native
from ..reference import measurements, snapshots, tolerances
from ..shared import volumes
from ..shared.proof import certify, measure
from ..shared.proof.verdict import Interval

# So many places are measured in each direction; further regions are counted.
MOST = 50
# So many vertices near to the limit are shown in each direction.
_NEAREST = 10
_AT_ONCE = 1 << 17  # triangles, between which other threads may go on


@dataclass(frozen=True)
class Place:
    on_reference: bool  # whether it is on the reference or on the mesh
    beyond: bool  # whether it is a region that is not proved to be within the tolerance
    distance: Interval  # the largest distance in the region
    position: np.ndarray  # (3,) the point of the largest distance, in the world
    normal: np.ndarray  # (3,) of the surface there, away from the inside of a solid; it is 0 where the surface has none
    radius: float  # the distance of the farthest corner of the region from the position
    # Of the part of the region that is beyond the tolerance, in the world, as the legend estimates it; 0 if it is not known.
    area: float
    faces: int  # the number of triangles of the region


def find(surface, reference, found, threads=None, progress=None):
    """Returns (places, number of regions beyond), the places by their distance, the largest first.

    surface, reference: Surfaces; found: the Verdict on them. If any direction that counts is beyond the tolerance, the places
    are all beyond it.
    """
    ways = [(False, surface, reference, found.forward)]
    if found.two_sided:
        ways.append((True, reference, surface, found.backward))
    places, regions = [], 0
    for on_reference, own, other, largest in ways:
        if largest.within(found.tolerance):
            if not found.passed:
                continue
            of_way = _near(on_reference, own, other, largest, found.tolerance, threads, progress)
        else:
            triangles = certify.outside(own, other, largest, found.tolerance, threads, progress)
            beyond = _regions(own, np.flatnonzero(triangles))
            regions += len(beyond)
            of_way = _measured(on_reference, own, other, largest, beyond, found.tolerance, threads, progress)
        if _is_turned(own, threads, progress):
            of_way = [replace(place, normal=-place.normal) for place in of_way]
        places += of_way
    return sorted(places, key=lambda place: -place.distance.upper), regions


def _is_turned(surface, threads, progress):
    """Whether the triangles in the world show their backs to whoever looks at the surface from outside."""
    arrays = surface.arrays
    found = native.module.solidity(
        arrays.vertices, arrays.triangles, to_world=surface.matrix, threads=threads or None, progress=progress
    )
    # The volume is that of the faces as they are stored. A mirrored object turns their triangles.
    inwards = found["volume"] is not None and found["volume"] < 0
    return inwards != bool(np.linalg.det(surface.matrix[:3, :3]) < 0)


def _regions(surface, chosen):
    """Groups the triangles with the indices `chosen` by the corners that they share. Returns a list of index arrays.

    Corners at the same position are the same: the triangles of some files have vertices of their own.
    """
    arrays = surface.arrays
    _, corners = np.unique(arrays.vertices[arrays.triangles[chosen]].reshape(-1, 3), axis=0, return_inverse=True)
    corners = corners.reshape(-1, 3)
    labels = np.arange(corners.max(initial=-1) + 1)
    while True:
        lowest = labels[corners].min(1)
        following = labels.copy()
        np.minimum.at(following, corners.ravel(), np.repeat(lowest, 3))
        following = following[following]
        if np.array_equal(following, labels):
            break
        labels = following
    order = np.argsort(labels[corners[:, 0]], kind="stable")
    _, starts = np.unique(labels[corners[:, 0]][order], return_index=True)
    return np.split(chosen[order], starts[1:])


def _measured(on_reference, own, other, largest, regions, tolerance, threads, progress):
    """Returns the Places of the MOST regions with the largest distances at their corners."""
    vertices, triangles = own.world(), own.arrays.triangles
    target = other.world(), other.arrays.triangles
    corners = np.unique(np.concatenate([triangles[region].ravel() for region in regions]))
    distance = np.zeros(len(vertices))
    distance[corners] = _distances(other, vertices[corners], tolerance, threads, progress)
    regions = sorted(regions, key=lambda region: -distance[triangles[region]].max())
    tree = _tree(other, tolerance, threads, progress)
    places = []
    for region in regions[:MOST]:
        measured = largest
        if largest.triangle not in region:
            measured = measure.largest_distance((vertices, triangles[region]), target, None, threads, progress)
            measured = Interval(measured.lower, measured.upper, measured.position, int(region[measured.triangle]))
        share = 0.0
        if tree is not None:
            corners = vertices[triangles[region]].reshape(-1, 3)
            each = np.arange(len(corners)).reshape(-1, 3)
            below, _, above = tree.shares(
                corners, each, [-tolerance, tolerance], threads=threads or None, progress=progress
            )
            share = below + above
        places.append(_place(on_reference, vertices, triangles, region, measured, True, share))
    return places


def _tree(other, tolerance, threads, progress):
    """Returns what estimates areas by their distance from the Surface `other`, or None if that has too many triangles."""
    volume = volumes.native_volume(other, tolerance, threads, progress)
    try:
        return native.module.DisplayTree(volume, progress=progress)
    except native.module.InvalidInput:
        return None


def _near(on_reference, own, other, largest, tolerance, threads, progress):
    """Returns the Places where the distance has a local maximum."""
    vertices, triangles = own.world(), own.arrays.triangles
    is_used = np.zeros(len(vertices), bool)
    is_used[triangles] = True
    used = np.flatnonzero(is_used)
    distance = np.full(len(vertices), -np.inf)
    distance[used] = _distances(other, vertices[used], tolerance, threads, progress)
    # Of equal neighbours the one with the lowest index counts as the highest.
    order = np.lexsort((-np.arange(len(vertices)), distance))
    # Here and below the window is drawn: on large meshes each step takes some tenths of a second.
    native.module.pause(0.0)
    rank = np.empty(len(vertices), np.int64)
    rank[order] = np.arange(len(vertices))
    is_top = is_used.copy()
    for part in np.array_split(triangles, max(len(triangles) // _AT_ONCE, 1)):
        ranks = rank[part]
        is_top[part[ranks < ranks.max(1)[:, None]]] = False
        native.module.pause(0.0)
    tops = np.flatnonzero(is_top)
    tops = tops[np.argsort(-rank[tops])][:_NEAREST]
    places = [_place(on_reference, vertices, triangles, np.array([largest.triangle]), largest, False)]
    for top in tops.tolist():
        if distance[top] > 0 and top not in triangles[largest.triangle]:
            triangle = np.flatnonzero((triangles == top).any(1))[0]
            exact = Interval(distance[top], distance[top], tuple(vertices[top]), int(triangle))
            places.append(_place(on_reference, vertices, triangles, np.array([triangle]), exact, False))
    return places


def _distances(other, points, tolerance, threads, progress):
    """Returns the exact distances of points in the world from the Surface `other`."""
    built = volumes.native_volume(other, tolerance, threads, progress)
    return built.distance(points, threads=threads, progress=progress)


def _place(on_reference, vertices, triangles, region, distance, beyond, share=0.0):
    """Returns a Place. share: that of the region's area which is beyond the tolerance."""
    corners = vertices[triangles[region]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    a, b, c = vertices[triangles[distance.triangle]]
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal)
    position = np.array(distance.position)
    radius = np.linalg.norm(corners.reshape(-1, 3) - position, axis=1).max()
    return Place(
        on_reference,
        beyond,
        distance,
        position,
        normal / length if length else normal,
        float(radius),
        float(areas.sum() * share),
        len(region),
    )


# What is shown --------------------------------------------------------------------------------------------------------

# Functions that are called when other places are shown.
listeners = []

_name = None
_state = None
_places = []
_regions_found = 0
_at = 0


def show(ob, places, regions):
    """Shows the places of `ob`, the first of them as the present one."""
    global _name, _state, _places, _regions_found, _at
    _name, _state, _places, _regions_found, _at = ob.name, _state_of(ob), places, regions, 0
    _notify()


def forget():
    global _places
    if _places:
        _places = []
        _notify()


def step(by):
    """Makes the next place (by=1) or the previous one (by=-1) the present one, around the ends."""
    global _at
    _at = (_at + by) % len(_places)
    _notify()


def any_shown():
    return bool(_places)


def shown(ob):
    """Returns (places, index of the present one, number of regions beyond) as far as they are still true of `ob`.

    After a change of mesh, place, reference or tolerance there are none. It is quick enough to be called while drawing.
    """
    if not _places or ob is None or ob.name != _name or _state != _state_of(ob):
        return [], 0, 0
    return _places, _at, _regions_found


def _state_of(ob):
    if ob.mode != "OBJECT" or ob.tolvol.snapshot is None:
        return None
    settings = ob.tolvol
    return (
        measurements.shown_fingerprint(ob),
        tuple(map(tuple, ob.matrix_world)),
        settings.snapshot_fingerprint,
        tuple(settings.snapshot_matrix),
        settings.keep,
        tolerances.tolerance_length(settings, snapshots.snapshot_size(ob)),
    )


def _notify():
    for listener in listeners:
        listener()
