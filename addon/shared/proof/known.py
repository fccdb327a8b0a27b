# SPDX-License-Identifier: GPL-3.0-or-later
"""Remembers the last measurements of this session by the content that was measured, so that a report does not repeat them.

A measurement depends on nothing but its arrays and numbers, so that it is true of the same content whenever it was made.
"""

import hashlib
import threading
from collections import OrderedDict

import numpy as np

_MOST = 64

_lock = threading.Lock()  # jobs measure in threads
_kept = OrderedDict()


def key_of(kind, content):
    """Returns a key that is equal for the same kind of measurement of equal content: arrays, numbers and None, one by one."""
    digest = hashlib.blake2b(kind.encode(), digest_size=16)
    for part in content:
        if isinstance(part, np.ndarray):
            digest.update(f"{part.dtype}{part.shape}".encode())
            digest.update(np.ascontiguousarray(part))
        else:
            digest.update(repr(part).encode())
    return digest.digest()


def keep(key, found):
    with _lock:
        _kept[key] = found
        _kept.move_to_end(key)
        while len(_kept) > _MOST:
            _kept.popitem(last=False)


def get(key):
    """Returns what was kept under a key, or None."""
    with _lock:
        return _kept.get(key)
