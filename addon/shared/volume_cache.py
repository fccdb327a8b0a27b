# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache of the tolerance volumes that were used last. Several threads may use it."""

import threading
from collections import OrderedDict

from . import package

_LOOK = 0.05  # A waiting thread checks every so many seconds whether it was cancelled.


class VolumeCache:
    def __init__(self, most_bytes):
        """most_bytes: the most memory of all volumes together. The last used volume is kept even if it is larger."""
        self._most_bytes = most_bytes
        self._volumes = OrderedDict()
        self._being_built = set()
        self._lock = threading.Lock()  # guards both collections

    def get(self, key, build, progress=None):
        """Returns the volume with this key, and calls build() to make it if the cache does not hold it.

        If another thread is building the volume, the call waits for it, and builds the volume itself if the other thread
        fails. Raises Cancelled.
        """
        while True:
            with self._lock:
                if key in self._volumes:
                    self._volumes.move_to_end(key)
                    return self._volumes[key]
                if key not in self._being_built:
                    self._being_built.add(key)
                    break
            if progress is not None and progress.cancelled:
                raise package.module.Cancelled("cancelled")
            package.module.pause(_LOOK)  # Jobs run meanwhile.
        volume = None
        try:
            volume = build()
        finally:
            with self._lock:
                self._being_built.remove(key)
                if volume is not None:
                    self._keep(key, volume)
        return volume

    def built(self, key):
        """Returns the volume with this key, or None if the cache does not hold it. It never waits: panels may call it."""
        with self._lock:
            return self._volumes.get(key)

    def clear(self):
        with self._lock:
            self._volumes.clear()

    def _keep(self, key, volume):
        self._volumes[key] = volume
        while len(self._volumes) > 1 and sum(kept.memory for kept in self._volumes.values()) > self._most_bytes:
            self._volumes.popitem(last=False)
