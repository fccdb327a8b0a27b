# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices at one position become one vertex."""

import numpy as np
import pytest
import tolvol


def places(dtype):
    rng = np.random.default_rng(3)
    found = rng.integers(-3, 3, (500, 3)).astype(dtype) / dtype(3)
    found[::7] = np.nextafter(found[::7], dtype(9))
    found[::5] *= -1  # which leaves some -0.0
    return found


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_welding_is_exact_and_keeps_the_order(dtype):
    vertices = places(dtype)
    kept, row = tolvol.weld(vertices)
    assert kept.dtype == dtype and row.dtype == np.int32 and np.array_equal(kept[row], vertices)
    first = {}
    for place in map(tuple, (vertices + 0).tolist()):
        first.setdefault(place, len(first))
    assert row.tolist() == [first[place] for place in map(tuple, (vertices + 0).tolist())]


def test_any_layout_and_number_of_threads_gives_the_same():
    vertices = np.tile(places(np.float32), (300, 1)) + np.arange(150_000, dtype=np.float32)[:, None] % 7
    kept, row = tolvol.weld(vertices, threads=1)
    wide = np.zeros((len(vertices), 5), np.float32)
    wide[:, 1:4] = vertices
    for same, threads in ((vertices, 2), (vertices, 5), (np.asfortranarray(vertices), None), (wide[:, 1:4], None)):
        again = tolvol.weld(same, threads=threads)
        assert np.array_equal(again[0], kept) and np.array_equal(again[1], row)


def test_none_at_all_and_no_numbers():
    kept, row = tolvol.weld(np.empty((0, 3), np.float32))
    assert kept.shape == (0, 3) and row.shape == (0,)
    assert len(tolvol.weld(np.full((3, 3), np.nan))[0]) == 3


@pytest.mark.parametrize("vertices", [[(0, 0, 0)], np.zeros((4, 3), int), np.zeros((4, 2)), np.zeros(3)])
def test_what_is_no_array_of_vertices_is_refused(vertices):
    with pytest.raises(tolvol.InvalidInput, match="vertices must"):
        tolvol.weld(vertices)
