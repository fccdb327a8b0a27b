# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes files whole or not at all: each is first written to a temporary folder beside its place, then all are moved.

A symbolic link stays, and the file that it points at is replaced. The new file gets the mode and the owner of the file
that it replaces. A hard link to the replaced file keeps the old content.
"""

import contextlib
import os
import shutil
import stat
import tempfile
import threading
import time
from pathlib import Path

from ..errors import NotWritten, Refused

# The lock is held while temporary folders are made or removed and while files are moved. remove_all() takes it, so that
# the process ends only after the last move.
_lock = threading.RLock()
_folders = set()

_TRIES = 50  # The end of the process tries so often to remove a folder, 0.01 s apart.


class Target:
    """A file that is to be written. Raises Refused where no file can be written."""

    def __init__(self, path, option=""):
        self.path = Path(path)
        self.name = f"{option} {path}".strip()  # how messages call the file
        try:
            self.is_device = _is_device(path)
            self.place = Path(path if self.is_device else os.path.realpath(path))
            if self.place.is_symlink() and not self.is_device:
                raise Refused(f"{self.name}: its symbolic links form a circle")
            if not self.place.parent.is_dir():
                raise Refused(f"{self.name}: the folder {self.place.parent} does not exist")
            if self.place.is_dir():
                raise Refused(f"{self.name}: this is a folder")
        except OSError as error:  # for example, the name is too long
            raise Refused(f"{self.name}: {error.strerror}") from None

    def failed(self, error):
        """Returns the NotWritten for `error`, an OSError or a text."""
        return NotWritten(f"{self.name}: {getattr(error, 'strerror', None) or error}")


def _is_device(path):
    """Whether the path exists and is neither a file nor a folder, but a pipe, a terminal or the like of /dev/null."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


def identity(path):
    """Returns a value that is equal for all paths of one file, through symbolic and hard links, even before it exists."""
    try:
        found = os.stat(path)
        return found.st_dev, found.st_ino
    except OSError:
        real = os.path.realpath(path)
    try:
        folder = os.stat(os.path.dirname(real))
    except OSError:
        return real
    return folder.st_dev, folder.st_ino, os.path.basename(real)


def require_apart(written, read):
    """Raises Refused where two of the written files are the same file, or a written file is also read.

    written, read: pairs (the name for messages, path).
    """
    names = {identity(path): f"{name}, which is read" for name, path in read}
    for name, path in written:
        found = identity(path)
        if found in names:
            raise Refused(f"{name} is the same file as {names[found]}: choose another name")
        names[found] = name


class Staged:
    """The files that one command writes, in temporary folders until publish() moves all of them to their places.

    It is a context manager: leaving the context removes the temporary folders.
    """

    def __init__(self):
        self._beside = {}  # Target -> its temporary folder
        self._moves = []  # (Target, the file that is moved there, whether the move must not replace a file)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with _lock:
            for folder in self._beside.values():
                shutil.rmtree(folder, ignore_errors=True)
                _folders.discard(folder)

    def folder(self, target):
        """Returns a temporary folder beside the place of a target.

        A command asks for the folder before its work, so that a place where nothing can be written is refused early.
        """
        if target not in self._beside:
            if target.place.exists() and not os.access(target.place, os.W_OK):
                raise target.failed("the file is write-protected; make it writable, or choose another name")
            try:
                with _lock:
                    made = Path(tempfile.mkdtemp(prefix=".tolvol-", dir=target.place.parent))
                    _folders.add(made)
            except OSError as error:
                raise target.failed(error) from None
            self._beside[target] = made
        return self._beside[target]

    def write(self, target, data):
        """Adds a file with these bytes. A device or a pipe cannot be replaced: the bytes are written to it at once."""
        file = target.place if target.is_device else self.folder(target) / target.place.name
        try:
            file.write_bytes(data)
        except OSError as error:
            raise target.failed(error) from None
        if not target.is_device:
            self.add(target, file)

    def add(self, target, file, new=False):
        """Adds a file that lies in a folder() of this object. new: publish() fails if the place is taken by then."""
        # A symbolic link may have led to another file system, where a move is not possible: the file is copied there.
        if file.parent.parent != target.place.parent:
            try:
                file = Path(shutil.copyfile(file, self.folder(target) / target.place.name))
            except OSError as error:
                raise target.failed(error) from None
        self._moves.append((target, file, new))

    def publish(self):
        """Moves all files in the order in which they were added. When a move fails, the moves before it are undone."""
        for target, file, _ in self._moves:
            try:
                _finish(file, target.place)
            except OSError as error:
                raise target.failed(error) from None
        with contextlib.ExitStack() as alone:
            for folder in sorted({target.place.parent for target, _, _ in self._moves}):
                alone.enter_context(_alone_in(folder))
            alone.enter_context(_lock)
            self._move()

    def _move(self):
        undo = []
        try:
            for target, file, new in self._moves:
                last = (target, file, new) == self._moves[-1]
                kept = None
                if target.place.exists():
                    if new:
                        raise FileExistsError(0, "another program has just written this file; run the command again")
                    kept = None if last else _second_name(target.place, file)
                os.replace(file, target.place)
                undo.append((target.place, kept))
        except OSError as error:
            for place, kept in reversed(undo):
                if kept:
                    os.replace(kept, place)
                else:
                    place.unlink()
            raise target.failed(error) from None


def _finish(file, place):
    """Flushes a file to the disk, which fails if the disk is full, and gives it the owner and mode of the replaced file."""
    with open(file, "rb+") as opened:
        os.fsync(opened.fileno())
    if place.exists():
        old, new = place.stat(), file.stat()
        if (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
            with contextlib.suppress(OSError):  # Only root may give a file to another owner.
                os.chown(file, old.st_uid, old.st_gid)
        if stat.S_IMODE(file.stat().st_mode) != stat.S_IMODE(old.st_mode):
            os.chmod(file, stat.S_IMODE(old.st_mode))


def _second_name(place, file):
    """Keeps the file that is at `place` now under a second name beside the file that replaces it. Returns that name."""
    kept = file.with_name(file.name + ".replaced")
    try:
        os.link(place, kept)
    except OSError:  # Some file systems have no hard links.
        shutil.copy2(place, kept)
    return kept


@contextlib.contextmanager
def _alone_in(folder):
    """Keeps other runs of these commands from moving files into the folder, so that the files of one run stay together."""
    try:
        import fcntl

        descriptor = os.open(folder, os.O_RDONLY)
    # Windows has no fcntl, and a folder that cannot be listed cannot be opened: each single file is still whole.
    except (ImportError, OSError):
        yield
        return
    try:
        with contextlib.suppress(OSError):  # Some network folders have no locks.
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def remove_all():
    """Removes all temporary folders and keeps the lock, so that nothing more is made or moved: for the end of the process."""
    _lock.acquire()
    for folder in _folders:
        # Another thread may be writing a file there, so that the folder is not empty at once.
        for _ in range(_TRIES):
            shutil.rmtree(folder, ignore_errors=True)
            if not folder.exists():
                break
            time.sleep(0.01)
