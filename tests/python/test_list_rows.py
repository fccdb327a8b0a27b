# SPDX-License-Identifier: GPL-3.0-or-later
"""list_rows() takes apart rows of numbers and lists, and refuses wrong arguments."""

import struct

import numpy as np
import pytest
import tolvol

TYPES = [("u1", "<i4"), (None, ">i2"), (">u2", "<f8")]
ROWS = [([7, 8, 9], -5, [0.5]), ([], 6, []), ([1], 300, [1.5, 2.5])]
DATA = b"".join(
    struct.pack(f"<B{len(a)}i", len(a), *a) + struct.pack(">hH", b, len(c)) + struct.pack(f"<{len(c)}d", *c)
    for a, b, c in ROWS
)


@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_rows_are_taken_apart(kind):
    (first, second, third), end = tolvol.list_rows(kind(b"??" + DATA + b"!"), 3, TYPES, offset=2)
    assert end == 2 + len(DATA)
    for (values, lengths), place in ((first, 0), (third, 2)):
        assert values.tolist() == sum((row[place] for row in ROWS), [])
        assert lengths.tolist() == [len(row[place]) for row in ROWS] and lengths.dtype == np.int64
    assert second.tolist() == [row[1] for row in ROWS]
    assert [first[0].dtype.str, second.dtype.str, third[0].dtype.str] == ["<i4", ">i2", "<f8"]


@pytest.mark.parametrize(
    "change, words",
    [
        ({"data": DATA[:-1]}, "the data end before"),
        ({"count": 4}, "the data end before"),
        ({"count": 2**62}, "the data end before"),
        ({"data": b"\xff" * 20, "types": [("i1", "u1")]}, "negative or not a whole number"),
        ({"data": np.zeros(20, np.int32)}, "data must be bytes"),
        ({"data": memoryview(DATA)[::2]}, "data must be bytes"),
        ({"offset": -1}, "offset"),
        ({"offset": len(DATA) + 1}, "offset"),
        ({"count": -1}, "count"),
        ({"types": []}, "at least one"),
        ({"types": [(None, "i8")]}, "types.*i8"),
        ({"types": [(None, "S3")]}, "types.*S3"),
        ({"types": [("f2", "u1")]}, "types.*f2"),
        ({"types": [(None, "nonsense")]}, "types.*nonsense"),
    ],
)
def test_wrong_arguments_are_refused(change, words):
    given = {"data": DATA, "count": 3, "types": TYPES} | change
    with pytest.raises(tolvol.InvalidInput, match=words):
        tolvol.list_rows(**given)
