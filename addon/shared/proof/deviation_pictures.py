# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws both surfaces of a deviation, each coloured by its distance from the other, by the native pictures.

The pictures need neither Blender's window nor another package. They prove nothing.
"""

import struct
import zlib
from dataclasses import dataclass

import numpy as np

from .. import package, volumes
from ..surface import joined

SIZE = (720, 600)  # pixels
_EDGES_UP_TO = 5000  # triangles; the edges of a mesh with more triangles would hide the colours
# Without a tolerance the colours end at the largest distance, or at this share of the size if that is more.
_LEAST_REACH = 1e-6

# Axis that is up -> a view from the front, the right and above.
VIEWS = {"Y": {"direction": (0.55, 0.4, 1), "up": (0, 1, 0)}, "Z": {"direction": (0.55, -1, 0.4), "up": (0, 0, 1)}}


@dataclass(frozen=True)
class Picture:
    caption: str
    png: bytes
    reach: float = 0.0  # the distance, in the unit of the deviation, at which the colours end; 0: no legend
    signed: bool = False  # whether the colours tell inside from outside


def unavailable():
    """Why no picture can be made here, or None."""
    try:
        package.module.renderer()
    except package.module.GlUnavailable as error:
        return str(error)
    return None


def reach(run):
    """Returns the distance at which the colours end: the tolerance, if there is one."""
    largest = max(run[way]["largest"][1] for way in ("forward", "backward"))
    return run["tolerance"]["absolute"] if run["tolerance"] else max(largest, _LEAST_REACH * run["size"])


def drawn(surface, reference, run, captions, factor=1.0, up="Z", threads=None, progress=None):
    """Returns the Pictures of two Surfaces from the same point of view: of the first and of the reference.

    run: their deviation() in world units; captions: texts for both; factor: from world lengths to those of the pictures; up:
    the axis that points upwards.
    """
    both = joined((surface, reference))
    view = package.module.Camera.framing(both.world(), both.arrays.triangles, size=SIZE, **VIEWS[up])
    pictures = []
    for way, own, other, caption in (
        ("forward", surface, reference, captions[0]),
        ("backward", reference, surface, captions[1]),
    ):
        # The tolerance of a volume is at most the size of its reference. Parts that are farther away are striped.
        wanted = min(reach(run), other.size())
        # The volume of the reference is kept for the next operation. That of the mesh is needed here alone.
        volume = (
            volumes.native_volume(other, wanted, threads, progress)
            if other is reference
            else package.module.ToleranceVolume(
                other.world(), other.arrays.triangles, wanted, threads=threads, progress=progress
            )
        )
        signed = bool(run[way]["sides"])
        pixels = package.module.render_distance(
            own.arrays.vertices,
            own.arrays.triangles,
            volume,
            camera=view,
            size=SIZE,
            transfer="signed" if signed else "magnitude",
            to_world=own.matrix,
            edges=len(own.arrays.triangles) <= _EDGES_UP_TO,
            threads=threads,
            progress=progress,
        )
        pictures.append(Picture(caption, png(on_white(pixels)), wanted * factor, signed))
    return pictures


def on_white(pixels):
    """Returns (height, width, 3) uint8 of pixels in RGBA on a white page."""
    alpha = pixels[..., 3:].astype(np.uint16)
    return ((pixels[..., :3] * alpha + 255 * (255 - alpha) + 127) // 255).astype(np.uint8)


def png(pixels):
    """Returns the bytes of a PNG of (height, width, 3) uint8."""
    height, width, _ = pixels.shape
    rows = pixels.reshape(height, width * 3)
    # The filter "Up" stores the difference from the row above: the background and plain parts become zeros.
    rows = np.concatenate([rows[:1], np.diff(rows, axis=0)])
    data = np.concatenate([np.full((height, 1), 2, np.uint8), rows], 1).tobytes()

    def chunk(name, content):
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data, 6)) + chunk(b"IEND", b"")
