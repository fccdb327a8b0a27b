# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle mesh with normals, colours and UVs, and how these follow a decimation."""

from dataclasses import dataclass, field, replace

import numpy as np

_MIX = np.uint64(0x9E3779B97F4A7C15)  # An odd number whose product mixes all bits.


@dataclass(frozen=True)
class Attribute:
    """Values, (k, width) of any number type, and the row of them at each corner of each triangle, (m, 3)."""

    values: np.ndarray
    index: np.ndarray
    # Whether corners at one vertex may have different values. If not, the rows are those of the vertices.
    split: bool = False


@dataclass
class Mesh:
    """What is kept of a file. Vertices are (n, 3) float32 or float64, triangles (m, 3) int32."""

    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    attributes: dict = field(default_factory=dict)  # by the names "UVs", "normals" and "colours"
    polygons: np.ndarray | None = (
        None  # (m,) int32, the face of the file that each triangle is part of; None: each is one
    )
    material: object = None  # of trimesh, with the textures of a .glb file
    unit: str = ""  # of a .3mf file
    deviation: float | None = None  # of a level of detail, as a length
    others: tuple = ()  # what the file holds beyond that, as words for a message


def welded(vertices):
    """Returns (the vertices without those at the position of an earlier one, the new number of each vertex).

    The vertices that stay are in the order of `vertices`. About 0.1 us for each vertex.
    """
    if not len(vertices):
        return vertices, np.zeros(0, np.int32)
    positions = np.ascontiguousarray(vertices + vertices.dtype.type(0))  # -0.0 becomes 0.0, which is the same place
    bits = positions.view(np.uint32 if vertices.dtype == np.float32 else np.uint64)
    keys = bits[:, 0] * _MIX
    for axis in (1, 2):
        keys ^= keys >> np.uint64(29)
        keys ^= bits[:, axis]
        keys *= _MIX
    # The low bits of each key make room for the number of its vertex: sorting numbers is much faster than sorting indices.
    low = np.uint64((1 << (len(keys) - 1).bit_length()) - 1)
    keys = (keys & ~low) | np.arange(len(keys), dtype=np.uint64)
    keys.sort()
    order = (keys & low).astype(np.int64)
    keys &= ~low
    first, number = _numbered(order, keys[1:] != keys[:-1])
    if not np.array_equal(bits[first][number], bits):  # Two positions have one key.
        order = np.lexsort((np.arange(len(bits)), *bits.T))
        first, number = _numbered(order, (bits[order[1:]] != bits[order[:-1]]).any(1))
    return vertices[first], number


def _numbered(order, differ):
    """Returns (the first vertex of each group, the group of each vertex), the groups in the order of their first vertices.

    order: the vertices group by group, each group in their order; differ: where the next group begins, (n - 1,) bool.
    """
    begins = np.concatenate([[True], differ])
    first = order[begins]
    places = np.argsort(first)
    rank = np.empty(len(first), np.int32)
    rank[places] = np.arange(len(first), dtype=np.int32)
    number = np.empty(len(order), np.int32)
    number[order] = rank[np.cumsum(begins) - 1]
    return first[places], number


def weld(mesh):
    """Returns the mesh with one vertex at each position. Its attributes may then differ from corner to corner."""
    vertices, number = welded(mesh.vertices)
    if len(vertices) == len(mesh.vertices):
        return mesh
    attributes = {name: replace(kept, split=True) for name, kept in mesh.attributes.items()}
    return replace(mesh, vertices=vertices, triangles=number[mesh.triangles], attributes=attributes)


def joined(name, meshes):
    """Returns several meshes as one. Attributes that not all of them have are left out, as are different materials."""
    if len(meshes) == 1:
        return replace(meshes[0], name=name)
    firsts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    attributes, others = {}, [word for mesh in meshes for word in mesh.others]
    for kind in {kind for mesh in meshes for kind in mesh.attributes}:
        parts = [mesh.attributes.get(kind) for mesh in meshes]
        if None in parts or len({part.values.shape[1] for part in parts}) > 1:
            others.append(f"{kind}, which not all of its meshes have")
            continue
        starts = np.cumsum([0, *(len(part.values) for part in parts)])
        index = np.concatenate([part.index + start for part, start in zip(parts, starts)]).astype(np.int32)
        values = np.concatenate([part.values for part in parts])
        attributes[kind] = Attribute(values, index, any(part.split for part in parts))
    if any(mesh.material is not None for mesh in meshes):
        others.append("materials")
    return Mesh(
        name,
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.triangles + first for mesh, first in zip(meshes, firsts)]).astype(np.int32),
        attributes,
        unit=meshes[0].unit,
        others=(*others, f"the division into {len(meshes):,} meshes"),
    )


def carried(mesh, corners, result):
    """Returns the attributes of the decimated mesh, interpolated in the triangles that the decimation names.

    corners: (m, 3) the corner of the mesh at each corner of the triangles that were decimated: closing holes adds some;
    result: the Decimated.
    """
    at = corners[result.source_triangle]  # (l, 3, 3): three corners of the mesh for each corner of the result
    found = {}
    for name, kept in mesh.attributes.items():
        values = kept.values[kept.index.ravel()[at]].astype(np.float64)
        blended = np.einsum("tck,tckw->tcw", result.source_weights, values)
        if name == "normals":
            blended /= np.maximum(np.linalg.norm(blended, axis=2, keepdims=True), 1e-12)
        if kept.values.dtype.kind in "iu":
            blended = np.rint(blended)
        blended = blended.astype(kept.values.dtype)
        if kept.split:
            rows, index = np.unique(blended.reshape(-1, blended.shape[2]), axis=0, return_inverse=True)
            found[name] = Attribute(rows, index.reshape(-1, 3).astype(np.int32), True)
            continue
        vertices, first = np.unique(result.triangles, return_index=True)
        rows = np.zeros((len(result.vertices), blended.shape[2]), blended.dtype)
        rows[vertices] = blended.reshape(-1, blended.shape[2])[first]
        found[name] = Attribute(rows, result.triangles)
    return found


def split(mesh, names):
    """Returns (vertices, triangles, {name: (n, width)}), with a vertex for each different set of values at its corners.

    names: of the attributes that the format holds for each vertex.
    """
    kept = {name: mesh.attributes[name] for name in names if name in mesh.attributes}
    columns = [mesh.triangles.ravel(), *(attribute.index.ravel() for attribute in kept.values() if attribute.split)]
    if len(columns) == 1:
        return mesh.vertices, mesh.triangles, {name: attribute.values for name, attribute in kept.items()}
    _, first, triangles = np.unique(np.stack(columns, 1), axis=0, return_index=True, return_inverse=True)
    values = {name: attribute.values[attribute.index.ravel()[first]] for name, attribute in kept.items()}
    return mesh.vertices[mesh.triangles.ravel()[first]], triangles.reshape(-1, 3).astype(np.int32), values
