# SPDX-License-Identifier: GPL-3.0-or-later
"""The only importer of the compiled module `tolvol`.

`module` is the compiled module, found at `path`, or None; then `reason` says why, and the panel shows it. Looked for, in
this order: the add-on's own folder (bin/ or beside this file), the folders in the environment variable
TOLVOL_PYTHON_PATH, and build/release/python of a checkout.

What is loaded is a private copy named by its content: Blender unloads no library, so that a file which is replaced
while it is mapped (the add-on installed again, the module built again) would crash the running session. The copy is put
into the first folder that programs may be started from: the one for temporary files is mounted `noexec` on some machines.
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

_FOLDER = Path(__file__).resolve().parent


def _folders():
    yield _FOLDER / "bin"
    yield _FOLDER
    for entry in os.environ.get("TOLVOL_PYTHON_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry)
    yield _FOLDER.parent / "build" / "release" / "python"


def _binaries():
    """(the first file this Python can load or None, the names of those made for another Python)."""
    others = []
    for folder in _folders():
        if not folder.is_dir():
            continue
        files = sorted(p for p in folder.iterdir() if p.name.startswith("tolvol.") and p.suffix in {".so", ".pyd"})
        for path in files:
            if any(path.name == "tolvol" + suffix for suffix in importlib.machinery.EXTENSION_SUFFIXES):
                return path, others
        others += [path.name for path in files]
    return None, others


def _load():
    """(module, where it was found, None) or (None, None, reason)."""
    path, others = _binaries()
    python = f"Python {sys.version_info.major}.{sys.version_info.minor}"
    if path is None and others:
        return None, None, f"{others[0]} is not made for this Blender's {python}: install the package built for it"
    if path is None:
        return None, None, "The compiled module tolvol is missing: install the add-on's zip, or build it with setup.sh"
    name = f"tolvol_{hashlib.blake2b(path.read_bytes(), digest_size=8).hexdigest()}"
    # The registry outlives this file's reload, so that one content is loaded once per session.
    if name not in sys.modules:
        problems = []
        for folder in _folders_for_copies():
            try:
                sys.modules[name] = _load_copy(path, name, folder)
                break
            except (ImportError, OSError) as error:
                problems.append((folder, error))
        else:
            return None, None, _why_not_loaded(path, problems)
    return sys.modules[name], path, None


def _folders_for_copies():
    """Where a copy may be loaded from, the best first."""
    yield Path(tempfile.gettempdir())
    yield Path(bpy.app.tempdir)  # the preferences may have set it
    yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    yield _FOLDER


def _load_copy(path, name, parent):
    # Once loaded the copy needs no name in the file system; where it cannot be removed then (Windows) it stays.
    with tempfile.TemporaryDirectory(prefix="tolvol-", dir=parent, ignore_cleanup_errors=True) as folder:
        copy = Path(folder) / name / path.name
        copy.parent.mkdir()
        # With the libraries that the package brings along: the module looks for them beside itself.
        for file in (path, *path.parent.glob("lib*.so*")):
            shutil.copyfile(file, copy.with_name(file.name))
        spec = importlib.util.spec_from_file_location("tolvol", copy)
        loaded = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(loaded)
    return loaded


def _why_not_loaded(path, problems):
    """problems: (folder, error) of every try."""
    able = [error for folder, error in problems if not _forbids_programs(folder) and not isinstance(error, OSError)]
    if able:  # the module itself is what does not load
        return f"{path} does not load: {able[0]}"
    tried = "; ".join(f"{folder}: {error}" for folder, error in problems)
    return (
        f"{path} does not load: none of the folders that were tried takes a copy that may be started ({tried}). "
        "Start Blender with the environment variable TMPDIR set to a folder on a disk that is not mounted noexec"
    )


def _forbids_programs(folder):
    try:
        return bool(os.statvfs(folder).f_flag & os.ST_NOEXEC)
    except (AttributeError, OSError):  # Windows, or no such folder
        return False


module, path, reason = _load()


# How the module speaks of options that have other names in Blender, or none.
_WORDS = (
    (', or keep them (outside="keep")', "; Select Outside shows them"),
    (
        'keep one direction only (two_sided=False), or go on from what there is (outside="keep")',
        "or set Keep to One Way",
    ),
)


def said(error):
    """What an error of the module says, in the panel's words."""
    text = str(error)
    for words, instead in _WORDS:
        text = text.replace(words, instead)
    return text


def shutdown():
    """Ends the module's GL thread, if there is one; what needs it starts it again."""
    if module is not None:
        module.shutdown()
