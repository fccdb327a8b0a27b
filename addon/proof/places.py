# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the places where a mesh and its reference are farthest from each other, and keeps the ones that are shown.

A place is a connected region that is not proved to be within the tolerance (regions.py). If there is none, the places are the
vertices whose distance is larger than that of their neighbours, and the point with the largest distance.
"""

from dataclasses import dataclass, replace

import numpy as np

from .. import native
from ..reference import measurements, snapshots, tolerances
from ..shared import volumes
from ..shared.proof import certify, measure, report
from ..shared.proof.verdict import Interval
from ..shared.surface import areas
from ..units import area, length
from . import regions

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
    radius: float  # the distance of the farthest corner of the region's pieces from the position
    # Of the part of the region that is beyond the tolerance, in the world, as the legend estimates it; 0 if it is not known.
    area: float
    faces: int  # the number of triangles that have a part in the region


def find(surface, reference, found, threads=None, progress=None):
    """Returns (places, number of regions beyond), the places by their distance, the largest first.

    surface, reference: Surfaces; found: the Verdict on them. If any direction that counts is beyond the tolerance, the places
    are all beyond it.
    """
    ways = [(False, surface, reference, found.forward)]
    if found.two_sided:
        ways.append((True, reference, surface, found.backward))
    places, count = [], 0
    for on_reference, own, other, largest in ways:
        if largest.within(found.tolerance):
            if not found.passed:
                continue
            of_way = _near(on_reference, own, other, largest, found.tolerance, threads, progress)
        else:
            triangles = certify.outside(own, other, largest, found.tolerance, threads, progress)
            of_way, more = _beyond(
                on_reference, own, other, largest, np.flatnonzero(triangles), found.tolerance, threads, progress
            )
            count += more
        if _is_turned(own, threads, progress):
            of_way = [replace(place, normal=-place.normal) for place in of_way]
        places += of_way
    return sorted(places, key=lambda place: -place.distance.upper), count


def _is_turned(surface, threads, progress):
    """Whether the triangles in the world show their backs to whoever looks at the surface from outside."""
    arrays = surface.arrays
    found = native.module.solidity(
        arrays.vertices, arrays.triangles, to_world=surface.matrix, threads=threads or None, progress=progress
    )
    # The volume is that of the faces as they are stored. A mirrored object turns their triangles.
    inwards = found["volume"] is not None and found["volume"] < 0
    return inwards != bool(np.linalg.det(surface.matrix[:3, :3]) < 0)


def _beyond(on_reference, own, other, largest, chosen, tolerance, threads, progress):
    """Returns (the Places of the MOST Regions with the largest distances at their corners, the number of all Regions)."""
    vertices, triangles = own.world(), own.arrays.triangles
    target = other.world(), other.arrays.triangles

    def distances(points):
        return _distances(other, points, tolerance, threads, progress)

    found, count = regions.find(vertices, triangles, chosen, largest, tolerance, distances, MOST)
    tree = _tree(other, tolerance, threads, progress)
    places = []
    for region in found:
        # The first one has the point of the largest distance.
        measured, triangle = largest, largest.triangle
        if places:
            measured = measure.largest_distance((region.vertices, region.pieces), target, None, threads, progress)
            triangle = region.triangles[measured.triangle]
        share = 0.0
        if tree is not None:
            below, _, above = tree.shares(
                region.vertices, region.pieces, [-tolerance, tolerance], threads=threads or None, progress=progress
            )
            share = below + above
        of_region = region.vertices[region.pieces]
        faces = len(np.unique(region.triangles))
        places.append(_place(on_reference, vertices[triangles[triangle]], measured, of_region, faces, share))
    return places, count


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
    corners = vertices[triangles[largest.triangle]]
    places = [_place(on_reference, corners, largest, corners[None])]
    for top in tops.tolist():
        if distance[top] > 0 and top not in triangles[largest.triangle]:
            triangle = np.flatnonzero((triangles == top).any(1))[0]
            exact = Interval(distance[top], distance[top], tuple(vertices[top]), int(triangle))
            corners = vertices[triangles[triangle]]
            places.append(_place(on_reference, corners, exact, corners[None]))
    return places


def _distances(other, points, tolerance, threads, progress):
    """Returns the exact distances of points in the world from the Surface `other`."""
    built = volumes.native_volume(other, tolerance, threads, progress)
    return built.distance(points, threads=threads, progress=progress)


def _place(on_reference, corners, distance, pieces, beyond=0, share=0.0):
    """Returns a Place.

    corners: (3, 3) of the triangle with the largest distance; pieces: (k, 3, 3) the corners of all pieces of the region;
    beyond: the number of triangles of a region that is beyond the tolerance; share: that of its area which is beyond.
    """
    a, b, c = corners
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal)
    position = np.array(distance.position)
    radius = np.linalg.norm(pieces.reshape(-1, 3) - position, axis=1).max()
    return Place(
        on_reference,
        beyond > 0,
        distance,
        position,
        normal / length if length else normal,
        float(radius),
        float(areas(pieces).sum() * share),
        beyond,
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


def described(context, ob):
    """Returns what is known about the present place as lines of text, or [] if none is shown."""
    found, at, count = shown(ob)
    if not found:
        return []
    place = found[at]
    tolerance = tolerances.tolerance_length(ob.tolvol, snapshots.snapshot_size(ob))
    where = "the reference" if place.on_reference else "the mesh"
    lines = [
        f"{at + 1} of {len(found)}, on {where}: {length(context, place.distance.upper)}, "
        f"{report.percent(place.distance.upper, tolerance)} of the tolerance"
    ]
    if place.beyond:
        faces = "1 triangle" if place.faces == 1 else f"{place.faces:,} triangles"
        more = f"; {count:,} regions in all" if count > len(found) else ""
        beyond = f", of which {area(context, place.area)} are beyond" if place.area > 0 else ""
        lines.append(f"Not proved to be within: {faces}{beyond}{more}")
    else:
        lines.append("Within the tolerance")
    return lines


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
