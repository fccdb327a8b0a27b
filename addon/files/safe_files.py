# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are written whole or not at all: first beside their place, then moved there together.

Symbolic links are followed: what they point at is replaced, they stay. A file that is replaced passes its mode and its
owner on. Other names of it (hard links) keep what they had.
"""

import contextlib
import os
import shutil
import stat
import tempfile
import threading
from pathlib import Path

from ..errors import NotWritten, Refused

# Held while temporary folders come and go and while files are moved: who ends the process waits for the last move.
_lock = threading.RLock()
_folders = set()


class Target:
    """A file that is to be written. Raises Refused where none can be."""

    def __init__(self, path, option=""):
        self.path = Path(path)
        self.name = f"{option} {path}".strip()  # as messages have it
        try:
            self.is_device = _is_device(path)
            self.place = Path(path if self.is_device else os.path.realpath(path))
            if self.place.is_symlink() and not self.is_device:
                raise Refused(f"{self.name}: its symbolic links lead in a circle")
            if not self.place.parent.is_dir():
                raise Refused(f"{self.name}: the folder {self.place.parent} does not exist")
            if self.place.is_dir():
                raise Refused(f"{self.name}: this is a folder")
        except OSError as error:  # a name that is too long
            raise Refused(f"{self.name}: {error.strerror}") from None

    def failed(self, error):
        """The NotWritten for an OSError, or for words."""
        return NotWritten(f"{self.name}: {getattr(error, 'strerror', None) or error}")


def _is_device(path):
    """Whether it is there and is neither a file nor a folder: a pipe, a terminal, /dev/null."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


def identity(path):
    """The same for all paths of one file, by symbolic links or hard links, whether it is there yet or not."""
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
    """Raises Refused where two written files are one, or one of them is also read. Pairs (what messages call it, path)."""
    names = {identity(path): f"{name}, which is read" for name, path in read}
    for name, path in written:
        found = identity(path)
        if found in names:
            raise Refused(f"{name} is the same file as {names[found]}: choose another name")
        names[found] = name


class Staged:
    """The files that one command writes, until publish() moves all of them to their places. Leaving it removes the rest."""

    def __init__(self):
        self._beside = {}  # Target -> its temporary folder
        self._moves = []  # (Target, what is moved there, whether it must not replace anything)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with _lock:
            for folder in self._beside.values():
                shutil.rmtree(folder, ignore_errors=True)
                _folders.discard(folder)

    def folder(self, target):
        """A temporary folder beside the place of a target. Asked for early, it tells early that nothing can be written."""
        if target not in self._beside:
            if target.place.exists() and not os.access(target.place, os.W_OK):
                raise target.failed("it is protected against writing; make it writable, or choose another name")
            try:
                with _lock:
                    made = Path(tempfile.mkdtemp(prefix=".tolvol-", dir=target.place.parent))
                    _folders.add(made)
            except OSError as error:
                raise target.failed(error) from None
            self._beside[target] = made
        return self._beside[target]

    def write(self, target, data):
        """Adds a file of these bytes. A device or a pipe cannot be replaced: it gets them at once."""
        file = target.place if target.is_device else self.folder(target) / target.place.name
        try:
            file.write_bytes(data)
        except OSError as error:
            raise target.failed(error) from None
        if not target.is_device:
            self.add(target, file)

    def add(self, target, file, new=False):
        """Adds a file from a folder() of this; new: publish() fails where there is a file of that name by then."""
        if file.parent.parent != target.place.parent:  # a link leads elsewhere, perhaps to another file system
            try:
                file = Path(shutil.copyfile(file, self.folder(target) / target.place.name))
            except OSError as error:
                raise target.failed(error) from None
        self._moves.append((target, file, new))

    def publish(self):
        """Moves everything, in the order in which it was added; when a move fails the ones before it are undone."""
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
                        raise FileExistsError(0, "another program has just written it; run the command again")
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
    """Brings a file onto the disk, which may be full, with the owner and the mode of the one that it replaces."""
    with open(file, "rb+") as opened:
        os.fsync(opened.fileno())
    if place.exists():
        old, new = place.stat(), file.stat()
        if (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
            with contextlib.suppress(OSError):  # who is not root cannot give files away
                os.chown(file, old.st_uid, old.st_gid)
        if stat.S_IMODE(file.stat().st_mode) != stat.S_IMODE(old.st_mode):
            os.chmod(file, stat.S_IMODE(old.st_mode))


def _second_name(place, file):
    """What is at a place now, kept beside the file that is to replace it."""
    kept = file.with_name(file.name + ".replaced")
    try:
        os.link(place, kept)
    except OSError:  # not every file system has hard links
        shutil.copy2(place, kept)
    return kept


@contextlib.contextmanager
def _alone_in(folder):
    """No other run moves its files there meanwhile, so that files that belong together stay together."""
    try:
        import fcntl

        descriptor = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):  # Windows, or a folder that cannot be listed: each file is whole all the same
        yield
        return
    try:
        with contextlib.suppress(OSError):  # some network folders know no locks
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def remove_all():
    """Removes all temporary folders and lets nobody make another or move a file: for the end of the process."""
    _lock.acquire()
    for folder in _folders:
        shutil.rmtree(folder, ignore_errors=True)
