# SPDX-License-Identifier: GPL-3.0-or-later
"""What has passed before: it passes again as long as nothing that it depends on has changed.

The passes are remembered in the user's cache folder.
"""

import hashlib
import json
import os
import time
from functools import cache
from pathlib import Path

FOLDER = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tolvol"
KEPT = 60 * 86400  # seconds for which a pass is remembered after its last use


@cache
def hash_of(path):
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def key_of(*depends_on):
    """Returns a name for what may pass. depends_on: all that decides whether it does, as JSON holds it."""
    return hashlib.sha256(json.dumps(depends_on).encode()).hexdigest()


class Passes:
    """The passes of one kind, each by its key and with a text, for example of how many tests passed."""

    def __init__(self, kind):
        self._folder = FOLDER / kind
        self._folder.mkdir(parents=True, exist_ok=True)

    def text(self, key):
        """Returns the text of a pass, or None where nothing with this key has passed."""
        file = self._folder / key
        try:
            os.utime(file)
            return file.read_text()
        except FileNotFoundError:
            return None

    def note(self, key, text=""):
        file = self._folder / key
        part = file.with_suffix(f".{os.getpid()}")
        part.write_text(text)
        part.replace(file)

    def forget(self, key):
        (self._folder / key).unlink(missing_ok=True)

    def forget_old(self):
        for file in self._folder.iterdir():
            try:
                if time.time() - file.stat().st_mtime > KEPT:
                    file.unlink()
            except FileNotFoundError:  # Another process has forgotten it, or given it its name.
                pass
