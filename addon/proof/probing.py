# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the distance between a mesh and its reference at single points of either, exactly.

Like every proof a reading is about the base mesh, without modifiers and shape keys.
"""

from dataclasses import dataclass

import bmesh
import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from .. import native
from ..mesh import protect
from ..reference import measurements, snapshots, tolerances
from ..shared import volumes
from ..shared.errors import Refused
from ..shared.proof.verdict import Interval
from ..shared.surface import to_world

INSIDE, OUTSIDE = "inside", "outside"
# What double precision rounds away when a point is placed on its triangle and its distance is computed, as a share of the
# size of the reference and of the coordinates of the point. A smaller distance is none.
_ROUNDING = 1e-14


@dataclass(frozen=True)
class Reading:
    """The distance of one point of a surface from the other surface, in world units."""

    position: np.ndarray  # (3,) the point, in the world
    on_reference: bool  # whether it is a point of the reference or of the mesh
    distance: float
    side: str  # of the other surface: INSIDE or OUTSIDE, or "" where there is none, or the point lies on it
    share: float  # of the tolerance that Decimate may use there, by the vertex group of Protect

    def within(self, tolerance):
        return Interval(self.distance, self.distance).within(tolerance)


class Source:
    """What a Probe needs of Blender's data. It is made in the main thread. Raises Refused."""

    def __init__(self, ob, on_reference):
        self.state = state_of(ob)
        self.on_reference = on_reference
        reference = snapshots.reference_of(ob)
        mesh = snapshots.surface_of(ob)
        self.own, self.other = (reference, mesh) if on_reference else (mesh, reference)
        self.tolerance = tolerances.required(ob, reference.size())
        self.shares = None if on_reference else _shares(ob)

    def fits(self, ob):
        """Whether `ob` is still in the same state. It is quick enough to be asked at every move of the mouse."""
        return self.state == state_of(ob)

    def look_up(self, threads, progress):
        """Returns what finds distances: the native volume of the other surface, and its tree, which knows sides.

        A thread may call it. Its outcome makes the Probe.
        """
        volume = volumes.native_volume(self.other, self.tolerance, threads, progress)
        return volume, native.module.DisplayTree(volume, progress=progress)


def _shares(ob):
    try:
        return protect.group_weights(ob, ob.tolvol.vertex_group, ob.tolvol.invert_vertex_group)
    except Refused:  # The group was removed. Decimate says so.
        return None


class Probe:
    """Reads points of one surface. It is made in the main thread, 0.8 s for 250,000 triangles."""

    def __init__(self, source, found, ob):
        """source: made of `ob`, which is still in the same state. found: the result of its look_up()."""
        self._source, (self._volume, self._tree) = source, found
        mesh = bmesh.new()
        try:
            mesh.from_mesh(ob.tolvol.snapshot if source.on_reference else ob.data, face_normals=False)
            self._faces = BVHTree.FromBMesh(mesh)
        finally:
            mesh.free()
        self._inverse = np.linalg.inv(source.own.matrix)

    def along(self, origin, direction):
        """Returns the Reading where a ray through the world first meets the surface, or None. Both are (3,)."""
        origin = to_world(np.asarray(origin, np.float64)[None], self._inverse)[0]
        direction = self._inverse[:3, :3] @ np.asarray(direction, np.float64)
        # Blender's tree counts in single precision, which needs an origin near the surface.
        _, _, face, _ = self._faces.ray_cast(Vector(origin), Vector(direction))
        if face is None:
            return None
        return self._read(face, lambda a, b, c: _on_ray(origin, direction, a, b, c))

    def nearest_to(self, position):
        """Returns the Reading at the point of the surface that is nearest to a point in the world (3,)."""
        at = to_world(np.asarray(position, np.float64)[None], self._inverse)[0]
        _, _, face, _ = self._faces.find_nearest(Vector(at))
        if face is None:
            return None
        return self._read(face, lambda a, b, c: _nearest(at, a, b, c))

    def _read(self, face, weigh):
        """Returns the Reading in a polygon. weigh(a, b, c) returns (the weights of the corners, how far they are off)."""
        arrays = self._source.own.arrays
        first, end = np.searchsorted(arrays.polygons, [face, face + 1])
        candidates = arrays.triangles[first:end]
        found = [weigh(*arrays.vertices[corners].astype(np.float64)) for corners in candidates]
        best = min(range(len(found)), key=lambda i: found[i][1])
        corners, weights = candidates[best], found[best][0]
        local = weights @ arrays.vertices[corners].astype(np.float64)
        position = to_world(local[None], self._source.own.matrix)
        shares = self._source.shares
        distance = float(self._volume.distance(position)[0])
        if distance <= _ROUNDING * (1 / self._tree.scale + np.abs(position).max()):
            distance = 0.0
        return Reading(
            position[0],
            self._source.on_reference,
            distance,
            self._side(position),
            1.0 if shares is None else float(shares[corners].min()),
        )

    def _side(self, position):
        if not self._tree.closed:
            return ""
        signed = float(self._tree.signed_distance(position)[0])
        if abs(signed) * self._tree.scale < self._tree.ROUNDING:
            return ""
        return INSIDE if signed < 0 else OUTSIDE


def _on_ray(origin, direction, a, b, c):
    """Returns the weights of the corners where a ray meets their plane, limited to the triangle, and how much they were
    limited."""
    ab, ac = b - a, c - a
    across = np.cross(direction, ac)
    slope = ab @ across
    if slope == 0:
        return np.array([1.0, 0.0, 0.0]), np.inf
    from_a = origin - a
    u, v = from_a @ across / slope, direction @ np.cross(from_a, ab) / slope
    weights = np.array([1 - u - v, u, v])
    limited = np.clip(weights, 0, None)
    return limited / limited.sum(), float(-min(weights.min(), 0))


def _nearest(at, a, b, c):
    """Returns the weights of the corners at the point of a triangle that is nearest to `at`, and its distance."""
    best = None
    corners = (a, b, c)
    for p, q in ((0, 1), (1, 2), (2, 0)):
        edge = corners[q] - corners[p]
        length = edge @ edge
        part = np.clip((at - corners[p]) @ edge / length, 0, 1) if length else 0.0
        weights = np.zeros(3)
        weights[p], weights[q] = 1 - part, part
        best = _nearer(best, weights, at, corners)
    ab, ac, along = b - a, c - a, at - a
    normal = np.cross(ab, ac)
    square = normal @ normal
    if square:
        v, w = np.cross(along, ac) @ normal / square, np.cross(ab, along) @ normal / square
        if min(v, w, 1 - v - w) >= 0:
            best = _nearer(best, np.array([1 - v - w, v, w]), at, corners)
    return best


def _nearer(best, weights, at, corners):
    away = float(np.linalg.norm(weights @ np.array(corners) - at))
    return (weights, away) if best is None or away < best[1] else best


def state_of(ob):
    """Returns what distances at points of `ob` and of its reference depend on, or None outside Object Mode.

    It is quick enough to be called while drawing.
    """
    if ob.mode != "OBJECT" or ob.tolvol.snapshot is None or snapshots.stale_reason(ob):
        return None
    settings = ob.tolvol
    return (
        ob.name,
        measurements.shown_fingerprint(ob),
        tuple(map(tuple, ob.matrix_world)),
        settings.snapshot_fingerprint,
        snapshots.reference_matrix(ob).tobytes(),
        settings.vertex_group,
        settings.invert_vertex_group,
    )


# What is shown beside the mouse ---------------------------------------------------------------------------------------

# Functions that are called when the probe begins or ends.
listeners = []

_hover = None


@dataclass(frozen=True)
class Hover:
    """What the 3D view shows while the probe is at work."""

    region: int  # the pointer of the region in which the mouse is; 0 if it is in none
    mouse: tuple  # its place in the region, in pixels
    lines: list  # of text to be shown beside the mouse
    position: np.ndarray = None  # (3,) the point that is read, in the world, or None


def hover():
    """Returns the Hover, or None if no probe is at work."""
    return _hover


def show_hover(found):
    """Shows this Hover from now on, or none."""
    global _hover
    told = (_hover is None) != (found is None)
    _hover = found
    if told:
        for listener in listeners:
            listener()


def redraw(area):
    """Draws the 3D view again if it is still there."""
    if area is not None and any(
        area == other for window in bpy.context.window_manager.windows for other in window.screen.areas
    ):
        area.tag_redraw()
