# SPDX-License-Identifier: GPL-3.0-or-later
"""The tolerance volumes that were built last. Jobs of several threads ask for them while panels are drawn."""

import threading
from collections import OrderedDict

from .. import native

_LOOK = 0.05  # seconds between two looks at whether a thread that waits was cancelled


class VolumeCache:
    def __init__(self, most_bytes):
        """most_bytes: what the volumes may hold together; the one used last is kept whatever it holds."""
        self._most_bytes = most_bytes
        self._volumes = OrderedDict()
        self._being_built = set()
        self._changed = threading.Condition()  # its lock guards both collections

    def get(self, key, build, progress=None):
        """The volume with this key, made by build() unless it is there. A thread that asks for a volume which another
        thread is building waits for it, and builds it itself if the other one fails. Raises Cancelled."""
        with self._changed:
            while key in self._being_built:
                if progress is not None and progress.cancelled:
                    raise native.module.Cancelled("cancelled")
                self._changed.wait(_LOOK)
            if key in self._volumes:
                self._volumes.move_to_end(key)
                return self._volumes[key]
            self._being_built.add(key)
        volume = None
        try:
            volume = build()
        finally:
            with self._changed:
                self._being_built.remove(key)
                if volume is not None:
                    self._keep(key, volume)
                self._changed.notify_all()
        return volume

    def built(self, key):
        """The volume with this key if it is there, else None. It waits for no build, so that panels can ask for it."""
        with self._changed:
            return self._volumes.get(key)

    def clear(self):
        with self._changed:
            self._volumes.clear()

    def _keep(self, key, volume):
        self._volumes[key] = volume
        while len(self._volumes) > 1 and sum(kept.memory for kept in self._volumes.values()) > self._most_bytes:
            self._volumes.popitem(last=False)
