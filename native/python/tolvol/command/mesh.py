# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle mesh with normals, colours and UVs, and how these follow a decimation."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..shared import package


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


def weld(mesh):
    """Returns the mesh with one vertex at each position. Its attributes may then differ from corner to corner."""
    vertices, number = package.module.weld(mesh.vertices, threads=1)
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
