# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of written files share: commands whose writing fails, and what a folder holds afterwards."""

import contextlib

from commands import SCRIPTS
from scenes import sheet_arrays

WITHIN = 60  # seconds in which anything here ends on any machine

# Python code that runs in a command before the command itself. patch() is that of serve_commands.py.
FAILING_REPLACE = """
import os
replace = os.replace
def failing(source, place):
    if os.path.basename(place) == {name!r} and not str(source).endswith(".replaced"):
        raise PermissionError(1, "Operation not permitted")
    replace(source, place)
patch(os, "replace", failing)
"""
# This code simulates a full disk by a limit of the length of files: from the export of OUT on, or after the export.
FULL_DISK = f"""
import resource, signal, sys
sys.path.insert(0, {str(SCRIPTS.parent)!r})
from addon.files import file_io
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
write = file_io.write_file
def limited(*arguments):
    {{0}}
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
    {{1}}
file_io.write_file = limited
"""
PROTECTED = (
    "import os; access = os.access; "
    "patch(os, 'access', lambda path, mode: access(path, mode) and '{name}' not in str(path))"
)


@contextlib.contextmanager
def unchanged(folder):
    """Asserts at the end that the folder holds the same files with the same content, and that none was replaced or added."""

    def found():
        return {
            path.name: (path.lstat().st_ino, path.readlink() if path.is_symlink() else path.read_bytes())
            for path in folder.iterdir()
            if path.is_symlink() or path.is_file()
        }

    before, folders = found(), sorted(path.name for path in folder.iterdir())
    yield
    assert found() == before and sorted(path.name for path in folder.iterdir()) == folders


def failed(done, code, *words):
    """Asserts this exit code, and one line on stderr with all these words."""
    assert done[0] == code, done
    # Under FULL_DISK a library prints a line of its own.
    assert len([line for line in done[2].splitlines() if not line.startswith("ftruncate() failed")]) == 1, done
    for word in words:
        assert str(word) in done[2], done
    return done


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def painted(path, name="sheet", image=None):
    """Writes an OBJ file with a material, and with a texture if an image is given."""
    vertices, quads = sheet_arrays(count=8)
    lines = [f"mtllib {path.stem}.mtl", f"o {name}", *("v %f %f %f" % tuple(v) for v in vertices)]
    lines += ["vt %f %f" % (v[0] / 2 + 0.5, v[1] / 2 + 0.5) for v in vertices]
    lines += ["usemtl red", *("f " + " ".join(f"{i + 1}/{i + 1}" for i in quad) for quad in quads)]
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".mtl").write_text("newmtl red\nKd 1 0 0\n" + (f"map_Kd {image}\n" if image else ""))
    return path
