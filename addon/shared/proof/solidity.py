# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells whether a surface bounds a solid: facts about its connectivity and its crossings, by what is stored.

Vertices at the same position are one vertex. Facts are a dictionary:

    closed, boundary_loops, open_edges            an edge of one triangle is open; loops: groups of open edges that touch
    manifold, non_manifold_edges, non_manifold_vertices    an edge of more than two triangles; a vertex at which the
                                                  triangles do not all hang together by edges
    oriented, misoriented_edges                   an edge that its two triangles run through the same way
    uncrossed, crossing_pairs                     of triangles that meet anywhere but in the corners and edges that they
                                                  share; at most MOST_PAIRS are counted
    degenerate_triangles                          with two equal corners; left out of all the above but the crossings
    shells                                        groups of triangles that hang together by edges
    area, volume                                  in the units of the world; volume: None unless closed and oriented,
                                                  below 0 if the faces look inwards

A surface whose volume is below 0 is turned inside out. Shells are not compared with each other: a shell inside another one
bounds a cavity if it looks inwards, and its volume is taken off; whether shells inside look the right way is not said.

All but the last two are exact. tolvol.solidity() finds all but the crossings.
"""

import numpy as np

from .. import package
from ..numbers import NO_BREAK
from . import known

# Where a mesh has so many pairs or more, they are not counted further: 100,000 faces on one place have five thousand million.
MOST_PAIRS = 1_000_000
# What can be required of a surface.
REQUIREMENTS = ("closed", "manifold", "oriented", "uncrossed")


def crossing_pairs(arrays, threads=None, progress=None, most=None):
    """Returns (k, 2): the pairs of triangles of a MeshArrays that cross each other, at most `most` or MOST_PAIRS.

    They are exact for the coordinates as they are stored. About 1.3 us for each triangle.
    """
    if not len(arrays.triangles):
        return np.empty((0, 2), np.int32)
    return package.module.crossing_pairs(
        arrays.vertices, arrays.triangles, most=most or MOST_PAIRS, threads=threads or None, progress=progress
    )


def polygon_pairs(pairs, polygons):
    """Returns (k, 2): the pairs of different polygons of which triangles cross, each once, the lower number first.

    pairs: of triangles, from crossing_pairs(); polygons: (m,), the polygon of each triangle.
    """
    found = np.sort(polygons[pairs], axis=1)
    return np.unique(found[found[:, 0] != found[:, 1]], axis=0)


def pair_count(pairs):
    """Returns a number of crossing pairs as text. They are counted up to MOST_PAIRS only."""
    return f"at least {MOST_PAIRS:,}" if pairs >= MOST_PAIRS else f"{pairs:,}"


def too_many(pairs):
    """Returns why others cannot be kept out where so many pairs cross that not all are counted, or "" where that is not so."""
    return f"{pair_count(pairs)} pairs of faces cross, too many to keep others out" if pairs >= MOST_PAIRS else ""


def facts(surface, threads=None, progress=None, again=True):
    """Returns the facts about a Surface. About 1.8 us for each triangle.

    again: whether to look even if they were found before in this session (known.py).
    """
    arrays = surface.arrays
    key = known.key_of("solidity", (arrays.vertices, arrays.triangles, surface.matrix))
    if not again and (kept := known.get(key)) is not None:
        return dict(kept)
    found = package.module.solidity(
        arrays.vertices, arrays.triangles, to_world=surface.matrix, threads=threads or None, progress=progress
    )
    pairs = len(crossing_pairs(arrays, threads, progress))
    found |= {"uncrossed": pairs == 0, "crossing_pairs": pairs}
    known.keep(key, dict(found))
    return found


def compared(before, after):
    """Returns the facts about a surface before and after an operation, and the change of its area and volume."""
    return {"before": before, "after": after, "change": change(after, before)}


def lacking(found):
    """Returns what keeps a surface of these facts from bounding a solid: texts by the names of REQUIREMENTS.

    Oriented is required to be outwards: faces that look inwards are in the way, although they agree with each other.
    """

    def counted(key, one, several, text="{:,}".format):
        return f"{text(found[key])} {one if found[key] == 1 else several}"

    manifold = (
        counted("non_manifold_edges", "edge of more than two faces", "edges of more than two faces"),
        counted("non_manifold_vertices", "vertex where sheets touch", "vertices where sheets touch"),
    )
    texts = {
        "closed": counted("boundary_loops", "boundary loop", "boundary loops"),
        "manifold": " and ".join(text for text in manifold if not text.startswith("0 ")),
        "oriented": counted("misoriented_edges", "edge between turned faces", "edges between turned faces"),
        "uncrossed": counted("crossing_pairs", "crossing pair of faces", "crossing pairs of faces", pair_count),
    }
    missing = {name for name in REQUIREMENTS if not found[name]}
    if found["volume"] is not None and found["volume"] < 0:
        texts["oriented"] = "faces look inwards"
        missing.add("oriented")
    return {name: texts[name] for name in REQUIREMENTS if name in missing}


def line(found):
    """Returns one line of text: whether a surface of these facts can be printed, or what is in the way."""
    missing = lacking(found)
    if not missing:
        return "closed, manifold, no crossings: printable"
    return f"not printable: {', '.join(missing.values())}"


def summary(compared, as_area, as_volume):
    """Returns the facts about a result as text: the result of compared(). as_area, as_volume: return a number as text."""
    found = compared["after"]
    connected = ", ".join(lacking(found).values()) or "closed, manifold, no crossings"
    changes = _changes(found, compared["before"], compared["change"])
    said = [f"{found['shells']:,} shell{'s' * (found['shells'] != 1)}", f"area {as_area(found['area'])}"]
    if found["volume"] is not None:
        said.append(f"volume {as_volume(found['volume'])}")
    said = [f"{text} ({change})" if change else text for text, change in zip(said, changes)]
    return ", ".join([connected[:1].upper() + connected[1:], *said])


def measures(of_a, of_b, changes):
    """Returns rows (name, A's, B's, change of A against B) of shells, area and volume as text.

    Where only one of them has a volume, the other says why it has none. Where none has, the row is left out.
    """

    def volume(found):
        if found["volume"] is None:
            return "not oriented" if found["closed"] else "not closed"
        return f"{found['volume']:.4g}"

    of_each = [(f"{found['shells']:,}", f"{found['area']:.4g}", volume(found)) for found in (of_a, of_b)]
    rows = list(zip(("shells", "area", "volume"), *of_each, _changes(of_a, of_b, changes)))
    return rows if any(found["volume"] is not None for found in (of_a, of_b)) else rows[:2]


def measures_line(of_a, of_b, changes):
    """Returns the rows of measures() as one line of text about A."""
    rows = measures(of_a, of_b, changes)
    return ", ".join(
        f"{name} {a} (B: {b}{', ' if change else ''}{change.replace(NO_BREAK, ' ')})" for name, a, b, change in rows
    )


def _changes(of_a, of_b, changes):
    """Returns the changes of shells, area and volume of A against B as text. "": none, or not known."""
    shells = of_a["shells"] - of_b["shells"]
    shares = (changes[name] for name in ("area", "volume"))
    return [
        f"{shells:+,}" if shells else "",
        *("" if share is None else f"{100 * share:+.3g}{NO_BREAK}%" for share in shares),
    ]


def change(of_a, of_b):
    """Returns by how much the area and the volume of A differ from those of B, as shares of B's. None: not known."""
    return {
        name: None if None in (of_a[name], of_b[name]) or not of_b[name] else of_a[name] / of_b[name] - 1
        for name in ("area", "volume")
    }
