# SPDX-License-Identifier: GPL-3.0-or-later
"""The scratch folder of a run, from which a run that was interrupted goes on.

It holds run.json, which says what was asked, the chunks, and a record with a checksum for each step that is done: a JSON file
that appears as a whole, after the chunk of the step.
"""

import contextlib
import json
import os
import shutil
import uuid
import zlib
from fnmatch import fnmatch
from pathlib import Path

from ..shared.errors import Refused
from . import chunks

_ASKED = "run"
_FORMAT = 2  # A run with other files in its folder cannot go on with these.


class Scratch:
    """A folder that one run uses at a time.

    asked: a dictionary of what the result depends on; resume: whether to go on with what is there. Raises Refused where the
    folder holds something else than that, or another run uses it, and NotWritten where it cannot be written to.
    """

    def __init__(self, folder, asked, resume):
        # Records name chunks by their path, which other working directories and the workers of Dask have to find.
        self.folder = Path(os.path.realpath(folder))
        try:
            self.folder.mkdir(exist_ok=True)
            self._require_own()
            self._lock = os.open(self.folder / "lock", os.O_RDWR | os.O_CREAT)
        except OSError as error:
            raise chunks.failed(error, self.folder) from None
        try:
            self._take(asked, resume)
        except BaseException:
            os.close(self._lock)
            raise

    def _take(self, asked, resume):
        asked = {"the format of the scratch folder": _FORMAT, **asked}
        with contextlib.suppress(ImportError):  # Windows has no fcntl.
            import fcntl

            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise Refused(f"{self.folder}: another run uses this scratch folder") from None
        for path in self.folder.glob("*.partial"):  # what an interrupted run was writing
            path.unlink()
        before = self.record(_ASKED)
        if before is None:
            self.keep(_ASKED, asked)
        elif not resume:
            raise Refused(f"{self.folder} holds a run that was interrupted: go on with --resume, or remove the folder")
        elif changed := [name for name in asked if before.get(name) != asked[name]]:
            name = changed[0]
            raise Refused(
                f"--resume: {name} was {before.get(name)} and is {asked[name]} now: run again as before, or remove "
                f"{self.folder}"
            )

    def _require_own(self):
        """Raises Refused for a folder of other files, into which nothing is written."""
        names = sorted(path.name for path in self.folder.iterdir())
        # A run that was killed while it wrote its first record has left a part of that.
        others = [name for name in names if name != "lock" and not fnmatch(name, f"{_ASKED}.*.partial")]
        if others and f"{_ASKED}.json" not in names:
            raise Refused(f"{self.folder}: this folder holds other files ({others[0]}): choose an empty one")

    def path(self, name):
        return self.folder / name

    def record(self, name):
        """Returns the record of a step, or None if it is not done."""
        try:
            found = json.loads(self.path(f"{name}.json").read_text())
            if found["checksum"] != _checksum(found["record"]):
                raise ValueError
            return found["record"]
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, KeyError):
            raise Refused(f"{self.path(name)}.json is damaged: remove {self.folder} and start again") from None

    def keep(self, name, record):
        """Notes that a step is done."""
        keep(self.path(name), record)

    def remove_chunks(self, removed):
        """Removes the files of chunks. The records of their steps stay, so that no step is done again."""
        for chunk in removed:
            Path(chunk.path).unlink(missing_ok=True)

    def close(self, discard):
        """Lets others use the folder. discard: whether the run is done, so that the folder is removed."""
        if discard:
            shutil.rmtree(self.folder, ignore_errors=True)
        os.close(self._lock)


def keep(path, record):
    """Writes the record of a step whose chunk is, or would be, at `path`."""
    partial = Path(f"{path}.{uuid.uuid4().hex}.partial")
    try:
        with open(partial, "w") as file:
            json.dump({"checksum": _checksum(record), "record": record}, file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, f"{path}.json")
    except OSError as error:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise chunks.failed(error, path) from None


def _checksum(record):
    return zlib.crc32(json.dumps(record).encode())
