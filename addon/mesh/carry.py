# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the attributes of a decimated mesh that change although its elements stay.

UV maps: each corner interpolates the UVs of the input triangle that the native result names for it, with the weights
named there. The decimation keeps UV seams. Other values at corners (colours, custom normals) may differ from face to
face anywhere: at a vertex that did not move, a corner takes the input value at that vertex that is nearest to the
corner's old value. At a vertex that was put into a face, to join a T-junction, a corner interpolates the face. Edges:
an edge gets the marks of all the edges that were merged into it. Vertices: a remaining vertex that moved interpolates
attributes, vertex groups and shape keys of the input at its new position; a vertex that did not move keeps its values
bit for bit.
"""

import bpy
import numpy as np

from .mesh_io import column, faces_of_corners, following_corners

# Data type of a Blender attribute -> (property of its elements, width, array type). An attribute of another type, such as
# text, stays with its element.
_TYPES = {
    "FLOAT": ("value", 1, np.float32),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
}
# These attributes are written elsewhere: the coordinates, and custom normals, which Blender stores relative to the shape.
_NOT_CARRIED = {"position", "custom_normal"}
_EDGE_MARKS = {
    "use_seam": bool,
    "use_edge_sharp": bool,
    "use_freestyle_mark": bool,
    "crease": np.float32,
    "bevel_weight": np.float32,
}


class Carry:
    """Reads the attributes of the input mesh. write() stores the new values in the decimated mesh."""

    def __init__(self, mesh, source, result):
        self._source = source
        self._result = result
        # A result vertex that moved interpolates with the triangle and the weights of one of its corners.
        used, first = np.unique(result.triangles, return_index=True)
        self._at = np.zeros((len(result.vertices), 3), np.int32)
        self._at[used] = source.triangles[result.source_triangle.ravel()[first]]
        self._weights = np.zeros((len(result.vertices), 3))
        self._weights[used] = result.source_weights.reshape(-1, 3)[first]
        kept = source.vertices[result.vertex_source]
        self._moved = np.flatnonzero((kept.view(np.uint32) != result.vertices.view(np.uint32)).any(1))
        self._points = attributes(mesh, "POINT") if len(self._moved) else {}
        self._keys = [column(key.data, "co", 3) for key in mesh.shape_keys.key_blocks] if mesh.shape_keys else []
        self._corners = {
            name: values for name, (values, kind) in attributes(mesh, "CORNER").items() if kind[2] is np.float32
        }
        # Before 3.5 Blender does not list UV maps among the attributes.
        self._uvs = [column(layer.data, "uv", 2) for layer in mesh.uv_layers]
        self._normals = custom_normals(mesh)
        self._marks = edge_marks(mesh)
        self._edge_attributes = attributes(mesh, "EDGE")
        self._edges = column(mesh.edges, "vertices", 2, np.int32) if self._marks or self._edge_attributes else None

    def blend_groups(self, built):
        """Interpolates the vertex groups of the vertices that moved, in the BMesh before its vertices are merged."""
        layer = built.verts.layers.deform.active
        if layer is None:
            return
        built.verts.ensure_lookup_table()
        verts = built.verts
        blended = []
        for row in self._moved.tolist():
            groups = {}
            for vertex, weight in zip(self._at[row].tolist(), self._weights[row].tolist()):
                for group, value in verts[vertex][layer].items():
                    groups[group] = groups.get(group, 0.0) + weight * value
            blended.append(groups)
        for vertex, groups in zip(self._result.vertex_source[self._moved].tolist(), blended):
            assigned = verts[vertex][layer]
            assigned.clear()
            for group, value in groups.items():
                if value > 0.0:
                    assigned[group] = min(value, 1.0)

    def write(self, mesh, layout):
        self._write_vertices(mesh, layout)
        self._write_edges(mesh, layout)
        self._write_corners(mesh, layout)
        mesh.update()
        self._write_normals(mesh, layout)

    # Vertices -------------------------------------------------------------------------------------------------------

    def _write_vertices(self, mesh, layout):
        if not len(self._moved):
            return
        places = layout.result_vertices[self._moved]
        at, weights = self._at[self._moved], self._weights[self._moved]
        coordinates = self._result.vertices[self._moved]
        _assign(mesh.vertices, "co", 3, np.float32, places, coordinates)
        for name, (values, kind) in self._points.items():
            _assign(mesh.attributes[name].data, *kind, places, _blend(values[at], weights))
        for key, values in zip(mesh.shape_keys.key_blocks if self._keys else (), self._keys):
            offsets = (values - self._source.vertices)[at]
            _assign(key.data, "co", 3, np.float32, places, coordinates + _blend(offsets, weights))

    # Edges ----------------------------------------------------------------------------------------------------------

    def _write_edges(self, mesh, layout):
        if self._edges is None:
            return
        count = len(mesh.vertices)
        keys = _edge_keys(column(mesh.edges, "vertices", 2, np.int32), count)
        order = np.argsort(keys)
        merged = _edge_keys(layout.vertices[self._edges], count)
        found = order[np.searchsorted(keys, merged, sorter=order).clip(max=len(keys) - 1)]
        takes = np.flatnonzero(keys[found] == merged)
        found = found[takes]
        for name, values in self._marks.items():
            kind = (name, 1, _EDGE_MARKS[name])
            _merge(mesh.edges, kind, found, values[takes])
        for name, (values, kind) in self._edge_attributes.items():
            # Newer versions of Blender drop an attribute of marks that no element has left. The loop above wrote it.
            if name not in mesh.attributes:
                continue
            _merge(mesh.attributes[name].data, kind, found, values[takes])

    # Corners --------------------------------------------------------------------------------------------------------

    def _write_corners(self, mesh, layout):
        faces = layout.triangles[:, None]
        self._corner_at = self._source.corners[self._result.source_triangle[faces, layout.corners].ravel()]
        self._corner_weights = self._result.source_weights[faces, layout.corners].reshape(-1, 3)
        for layer, values in zip(mesh.uv_layers, self._uvs):
            layer.data.foreach_set("uv", _blend(values[self._corner_at], self._corner_weights).ravel())
        for name, values in self._corners.items():
            data = mesh.attributes[name].data
            data.foreach_set(_TYPES[mesh.attributes[name].data_type][0], self._nearest_values(values, layout).ravel())

    def _write_normals(self, mesh, layout):
        if self._normals is None:
            return
        # Blender stores one normal for all corners between two sharp edges. To store different ones it would mark more
        # edges as sharp, so those corners get their mean.
        normals = self._nearest_values(self._normals, layout, fans(mesh)).astype(np.float64)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        with _AutoSmooth(mesh):
            mesh.normals_split_custom_set(normals)

    def _nearest_values(self, values, layout, shared=None):
        """Returns (corners, width), the values for the written mesh.

        At a vertex that moved or was put into the face the values are interpolated; at any other they are chosen among
        the input values there.
        shared: a label for each corner; corners with the same label get the same value.
        """
        values = values.reshape(len(values), -1)
        read = _blend(values[self._corner_at], self._corner_weights)
        own = self._source.corners[self._result.triangle_source[layout.triangles][:, None], layout.corners].ravel()
        had = values[own]
        if shared is not None:
            read, had = mean(read, shared), mean(had, shared)
        vertices = self._result.triangles[layout.triangles[:, None], layout.corners].ravel()
        still = np.ones(len(self._result.vertices), bool)
        still[self._moved] = False
        # A vertex that the decimation has put into a face, or joined to one at the same place, has no input value of the
        # face there: the corner that the native result names has it.
        named = self._source.triangles[self._result.source_triangle[layout.triangles[:, None], layout.corners]]
        nearest = self._corner_weights.argmax(1)
        named = named.reshape(-1, 3)[np.arange(len(nearest)), nearest]
        is_there = (self._corner_weights.max(1) > 1 - 1e-6) & (named == self._result.vertex_source[vertices])
        chosen = np.flatnonzero(still[vertices] & is_there)
        # The input corners are sorted by vertex; the candidates of a corner are the run of input corners at its vertex.
        at_vertex = self._source.triangles.ravel()
        order = np.argsort(at_vertex, kind="stable")
        starts = np.searchsorted(at_vertex[order], np.arange(len(self._source.vertices) + 1))
        vertex = self._result.vertex_source[vertices[chosen]]
        counts = starts[vertex + 1] - starts[vertex]
        begins = np.cumsum(counts) - counts
        candidates = np.arange(counts.sum()) - np.repeat(begins - starts[vertex], counts)
        candidates = self._source.corners.ravel()[order[candidates]]
        away = np.abs(values[candidates] - np.repeat(had[chosen], counts, axis=0)).sum(1)
        least = np.repeat(np.minimum.reduceat(away, begins), counts) if len(chosen) else away
        hits = np.flatnonzero(away == least)
        which, first = np.unique(np.repeat(np.arange(len(chosen)), counts)[hits], return_index=True)
        read[chosen[which]] = values[candidates[hits[first]]]
        return read


def _blend(values, weights):
    """Blends values at three places, (r, 3, ...), to (r, ...).

    Returns the weighted sum of float32 values; of other types it returns the value with the largest weight.
    """
    if values.dtype != np.float32:
        return values[np.arange(len(values)), np.argmax(weights, 1)]
    return np.einsum("rk,rk...->r...", weights, values.astype(np.float64)).astype(np.float32)


def mean(values, labels):
    """Replaces each row of (r, width) by the mean of the rows with the same label."""
    sums = np.zeros((labels.max(initial=0) + 1, values.shape[1]))
    np.add.at(sums, labels, values)
    return (sums / np.maximum(np.bincount(labels, minlength=len(sums)), 1)[:, None])[labels].astype(np.float32)


def fans(mesh):
    """Returns a label for each corner of a mesh.

    Two corners at a vertex have the same label if no sharp edge and no flat-shaded face lies between them.
    """
    edges, starts = (column(mesh.loops, name, 1, np.int32) for name in ("edge_index", "vertex_index"))
    following = following_corners(mesh)
    smooth = column(mesh.polygons, "use_smooth", 1, bool)[faces_of_corners(mesh)]
    order = np.argsort(edges, kind="stable")
    twice = np.bincount(edges, minlength=len(mesh.edges)) == 2
    pairs = order[twice[edges[order]]].reshape(-1, 2)
    joined = ~column(mesh.edges, "use_edge_sharp", 1, bool)[edges[pairs[:, 0]]] & smooth[pairs].all(1)
    pairs = pairs[joined & (starts[pairs[:, 0]] != starts[pairs[:, 1]])]
    one, two = pairs.T
    ends = np.concatenate([one, following[one]]), np.concatenate([following[two], two])
    labels = np.arange(len(edges))
    while True:
        lowest = np.minimum(labels[ends[0]], labels[ends[1]])
        before = labels.copy()
        np.minimum.at(labels, ends[0], lowest)
        np.minimum.at(labels, ends[1], lowest)
        labels = labels[labels]
        if np.array_equal(labels, before):
            return labels


def attributes(mesh, domain):
    """Returns {name: (values, (property, width, array type))} for the attributes of one domain that an array can hold."""
    found = {}
    uv_maps = {layer.name for layer in mesh.uv_layers}
    for attribute in mesh.attributes:
        own_way = attribute.name in _NOT_CARRIED or attribute.name in uv_maps
        if attribute.domain == domain and attribute.data_type in _TYPES and not own_way and attribute.name[0] != ".":
            kind = _TYPES[attribute.data_type]
            found[attribute.name] = (column(attribute.data, *kind), kind)
    return found


def edge_marks(mesh):
    known = bpy.types.MeshEdge.bl_rna.properties.keys()
    marks = {name: column(mesh.edges, name, 1, kind) for name, kind in _EDGE_MARKS.items() if name in known}
    # Only marks that are used are written: writing creases or bevel weights would add their layer to a mesh without it.
    return {name: values for name, values in marks.items() if values.any()}


def _edge_keys(vertices, count):
    ends = np.sort(vertices.astype(np.int64), 1)
    return ends[:, 0] * count + ends[:, 1]


def _assign(collection, name, width, dtype, places, values):
    """Sets some elements of a collection and leaves the other elements bit for bit."""
    everything = column(collection, name, width, dtype)
    everything[places] = values
    collection.foreach_set(name, everything.ravel())


def _merge(collection, kind, places, values):
    """Writes marks where several elements became one: a flag if any of them had it, the largest of their weights."""
    name, width, dtype = kind
    everything = column(collection, name, width, dtype)
    if dtype == np.float32 and width == 1:
        everything[places] = -np.inf
        np.maximum.at(everything, places, values)
    elif dtype is bool:
        everything[places] = False
        everything[places[values]] = True
    else:
        everything[places] = values
    collection.foreach_set(name, everything.ravel())


class _AutoSmooth:
    """Switches Auto Smooth on while the context lasts: before 4.1 Blender reads and writes custom normals only with it."""

    def __init__(self, mesh):
        self._mesh = mesh

    def __enter__(self):
        if bpy.app.version < (4, 1):
            self._before = self._mesh.use_auto_smooth
            self._mesh.use_auto_smooth = True

    def __exit__(self, *_):
        if bpy.app.version < (4, 1):
            self._mesh.use_auto_smooth = self._before


def custom_normals(mesh):
    """Returns the custom normals, (corners, 3), or None if the mesh has none."""
    if not mesh.has_custom_normals:
        return None
    with _AutoSmooth(mesh):
        return corner_normals(mesh)


def corner_normals(mesh):
    """Returns the normals with which Blender shades the corners of a mesh, (corners, 3)."""
    if bpy.app.version >= (4, 1):
        return column(mesh.corner_normals, "vector", 3)
    mesh.calc_normals_split()
    normals = column(mesh.loops, "normal", 3)
    mesh.free_normals_split()
    return normals
