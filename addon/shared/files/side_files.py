# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the files that belong to a mesh file: the files that it names and the files that are written with it."""

import itertools
import json
import os
import re
from pathlib import Path
from urllib.parse import quote, unquote

from ..errors import Refused
from . import gltf_check

# Extension of a mesh file -> extension of the file that Blender's exporter writes beside it, besides textures.
_WRITTEN = {".obj": ".mtl", ".gltf": ".bin"}
_GLTF = (".gltf", ".glb")


def written_with(place, extension):
    """Returns the paths that may be written with a file of this format, without textures."""
    return [Path(place).with_suffix(_WRITTEN[extension])] if extension in _WRITTEN else []


def read_with(path):
    """Returns the files on the disk that a mesh file names (materials, textures, buffers); [] if it cannot be read."""
    extension = Path(path).suffix.lower()
    if extension not in (".obj", *_GLTF):
        return []
    try:
        data = Path(path).read_bytes()
    except OSError:
        return []
    named = _named_by_gltf(data) if extension in _GLTF else _named_by_obj(data, Path(path).parent)
    return [file for name in named if (file := _file(Path(path).parent, name))]


def _file(folder, name):
    try:
        return folder / name if (folder / name).is_file() else None
    except (OSError, ValueError):  # No file can have this name.
        return None


def _named_by_gltf(data):
    try:
        document, _ = gltf_check.parts(data)
        entries = [*document.get("buffers", ()), *document.get("images", ())]
        uris = [entry.get("uri") for entry in entries]
    except (Refused, AttributeError, TypeError):
        return []
    return [unquote(uri) for uri in uris if isinstance(uri, str) and not uri.startswith("data:")]


def _named_by_obj(data, folder):
    for library in _names(data, rb"mtllib"):
        yield library
        if file := _file(folder, library):
            yield from _names(file.read_bytes(), rb"map_\w+|bump|disp|decal|refl|norm")


def _names(data, keys):
    """Yields all names that lines with these keys may mean: options may stand before a name, and a name may have spaces."""
    for line in re.findall(rb"^[ \t]*(?:" + keys + rb")[ \t]+([^\r\n]+)", data, re.MULTILINE | re.IGNORECASE):
        words = os.fsdecode(line).split()
        for first, last in itertools.combinations(range(len(words) + 1), 2):
            yield " ".join(words[first:last])


def keep_textures(exported, folder, taken):
    """Renames the textures beside an exported .gltf file so that none of them replaces a file in `folder`.

    A texture that `folder` holds with the same content keeps its name. taken(path) tells whether a path is reserved for
    another file. Returns the textures that have to be moved to `folder`.
    """
    document = json.loads(exported.read_bytes())
    settled, textures = {}, []
    for image in document.get("images", ()):
        uri = image.get("uri", "data:")
        if uri.startswith("data:"):
            continue
        if uri not in settled:
            texture = exported.parent / unquote(uri)
            content = texture.read_bytes()
            name = next(
                path.name
                for path in _numbered(texture)
                if (path == texture or not path.exists()) and _is_free(folder / path.name, content, taken)
            )
            settled[uri] = texture.rename(texture.with_name(name))
            if not (folder / name).exists():
                textures.append(settled[uri])
        image["uri"] = quote(settled[uri].name)
    exported.write_text(json.dumps(document, separators=(",", ":")), encoding="utf-8")
    return textures


def _numbered(path):
    yield path
    for number in itertools.count(2):
        yield path.with_name(f"{path.stem}-{number}{path.suffix}")


def _is_free(place, content, taken):
    if taken(place):
        return False
    return not os.path.lexists(place) or (place.is_file() and place.read_bytes() == content)
