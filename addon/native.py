# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads the package `tolvol` for all of the add-on.

`module` is the package, and `path` is its compiled module. If it cannot be loaded, `module` is None and `reason` says
why; the panel shows the reason. The package is searched in this order: in the add-on's own folder bin/, in the folders
of the environment variable TOLVOL_PYTHON_PATH, and in build/release/python of a checkout.

The add-on loads a private copy of the package, named by its content. Blender never unloads a library, and replacing a
library file that is in use (by installing the add-on or building the module again) would crash the session. The name
also keeps the copy apart from a package tolvol that the user has installed. The copy is put into the first folder from
which libraries may be loaded: some machines mount the folder for temporary files `noexec`.
"""

import hashlib
import importlib.machinery
import importlib.util
import os
import shutil
import sys
import tempfile
from pathlib import Path

import bpy

from .shared import package

_FOLDER = Path(__file__).resolve().parent


def _folders():
    yield _FOLDER / "bin"
    for entry in os.environ.get("TOLVOL_PYTHON_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry)
    yield _FOLDER.parent / "build" / "release" / "python"


def _binaries():
    """Returns (the first file that this Python can load or None, the names of the files for other Pythons)."""
    others = []
    for folder in _folders():
        files = sorted(p for p in (folder / "tolvol").glob("_native.*") if p.suffix in {".so", ".pyd"})
        for path in files:
            if any(path.name == "_native" + suffix for suffix in importlib.machinery.EXTENSION_SUFFIXES):
                return path, others
        others += [path.name for path in files]
    return None, others


def _load():
    """Returns (package, path of its compiled module, None) or (None, None, reason)."""
    path, others = _binaries()
    python = f"Python {sys.version_info.major}.{sys.version_info.minor}"
    if path is None and others:
        return None, None, f"{others[0]} is not made for this Blender's {python}: install the package for that version"
    if path is None:
        return None, None, "The package tolvol is missing: install the add-on's zip, or build it with setup.sh"
    files = [path, *sorted(path.parent.glob("*.py"))]
    name = f"tolvol_{hashlib.blake2b(b''.join(file.read_bytes() for file in files), digest_size=8).hexdigest()}"
    # The libraries of the package are copied too: the compiled module looks for them beside itself.
    files += path.parent.glob("lib*.so*")
    # sys.modules survives a reload of this file, so that a package with the same content is loaded once per session.
    if name not in sys.modules:
        problems = []
        for folder in _folders_for_copies():
            try:
                _load_copy(files, name, folder)
                break
            except (ImportError, OSError) as error:
                problems.append((folder, error))
        else:
            return None, None, _why_not_loaded(path, problems)
    return sys.modules[name], path, None


def _folders_for_copies():
    """Yields the folders to which the package may be copied, the preferred one first."""
    yield Path(tempfile.gettempdir())
    yield Path(bpy.app.tempdir)  # Blender's preferences may set another folder than the system's.
    yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    yield _FOLDER


def known_folders():
    """Returns the folders that `reason` may name."""
    return [*_folders(), *_folders_for_copies()]


def _load_copy(files, name, parent):
    """Loads a copy of the files as the package `name`."""
    # The loaded copy needs no file any more, so the folder is removed. Windows cannot remove a loaded file: it stays there.
    with tempfile.TemporaryDirectory(prefix="tolvol-", dir=parent, ignore_cleanup_errors=True) as folder:
        copy = Path(folder) / name
        copy.mkdir()
        for file in files:
            shutil.copyfile(file, copy / file.name)
        spec = importlib.util.spec_from_file_location(
            name, copy / "__init__.py", submodule_search_locations=[str(copy)]
        )
        sys.modules[name] = importlib.util.module_from_spec(spec)
        try:
            spec.loader.exec_module(sys.modules[name])
        except BaseException:
            del sys.modules[name]
            raise


def _why_not_loaded(path, problems):
    """Returns a message. problems: (folder, error) of every try."""
    able = [error for folder, error in problems if not _forbids_programs(folder) and not isinstance(error, OSError)]
    if able:  # The folder permits it, so the error is one of the module itself.
        return f"{path} does not load: {able[0]}"
    tried = "; ".join(f"{folder}: {error}" for folder, error in problems)
    return (
        f"{path} does not load: none of the folders that were tried permits a copy of it to be loaded ({tried}). "
        "Start Blender with the environment variable TMPDIR set to a folder on a disk that is not mounted noexec"
    )


def _forbids_programs(folder):
    try:
        return bool(os.statvfs(folder).f_flag & os.ST_NOEXEC)
    except (AttributeError, OSError):  # Windows has no statvfs; or there is no such folder.
        return False


module, path, reason = _load()
package.module = module


# The add-on's own sentences for errors of the package by their code, where the package's sentences name its options.
_SENTENCES = {
    "input_outside": "{count:,} faces are not within the tolerance of the reference, the first is face {first}; take a "
    "larger tolerance, replace the reference, or choose Outside: Keep, which Decimate has under Advanced. If a reference "
    "is set, Select Outside shows these faces",
    "reference_outside": "{count:,} faces of the reference are not within the tolerance of the mesh, the first is face "
    "{first}; take a larger tolerance, tick Close if the mesh has holes, replace the reference, or set Keep to One Way",
}


def says_outside(error):
    """Whether the package refused a mesh because it is not within the tolerance to begin with, in either direction."""
    return error.code in ("input_outside", "reference_outside")


def said(error):
    """Returns the message of a Refused or of an error of the package, with the names of settings as in Blender."""
    sentence = _SENTENCES.get(getattr(error, "code", None))
    return sentence.format(count=error.count, first=error.first) if sentence else str(error)


def shutdown():
    """Ends the module's GL thread if there is one. The next call that needs the thread starts it again."""
    if module is not None:
        module.shutdown()
