# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds damage in a mesh file that Blender's readers do not report, and reads PLY, STL and OBJ files.

Blender's readers turn coordinates that are not finite into zeros, drop faces that name a missing vertex, read a truncated
STL file as an empty one, and skip the first line of an OBJ file if a byte order mark stands before it. check() finds such
damage in the file itself. It also counts the faces of the file, so that the faces that a reader drops (repeated faces and
faces with a repeated corner) can be reported.
"""

import codecs
import re
from pathlib import Path

from ..errors import Refused
from . import gltf_check, obj_file, ply_file, stl_file
from .content import Content


def known_extension(path, known):
    """Returns the extension of a path. Raises Refused for one that is not in `known`, and lists those."""
    extension = Path(path).suffix.lower()
    if extension not in known:
        raise Refused(f"{path}: unknown extension {extension or '(none)'}; the known ones are {' '.join(known)}")
    return extension


def data_of(path):
    """Returns the bytes of a file. Raises Refused, which names the file."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise Refused(f"{path}: {error.strerror}") from None


def check(extension, data, folder):
    """Returns the Content of a file. `folder` holds the files that the content may name.

    Raises Refused with a message that says what is wrong and does not name the file.
    """
    if not data:
        raise Refused("the file is empty")
    if extension in (".gltf", ".glb"):
        return Content(gltf_check.check(data, folder))
    if extension == ".obj" and re.match(codecs.BOM_UTF8 + rb"[ \t]*[^\s#]", data):
        raise Refused("a byte order mark hides its first line from Blender: save it as UTF-8 without this mark")
    return {".obj": obj_file, ".ply": ply_file, ".stl": stl_file}[extension].read(data)
