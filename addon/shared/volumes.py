# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the native tolerance volumes of surfaces and keeps the last used ones."""

from . import package
from .volume_cache import VolumeCache

_volumes = VolumeCache(most_bytes=600_000_000)


def native_volume(surface, tolerance, threads=None, progress=None):
    """Returns the tolerance volume of a surface. A volume that was built for the same content is used again."""
    return _volumes.get(_key(surface, tolerance), lambda: _build(surface, tolerance, threads, progress), progress)


def passing_volume(surface, tolerance, threads=None, progress=None):
    """Returns the tolerance volume of a surface, and does not keep one that it builds: others in memory stay there."""
    return _volumes.built(_key(surface, tolerance)) or _build(surface, tolerance, threads, progress)


def kept(fingerprint, matrix, tolerance):
    """Returns the volume of a surface if it is in memory, else None. It never waits: panels may call it.

    fingerprint: of the arrays of the surface.
    """
    return _volumes.built((fingerprint, matrix.tobytes(), tolerance))


def _key(surface, tolerance):
    return surface.arrays.fingerprint(), surface.matrix.tobytes(), tolerance


def _build(surface, tolerance, threads, progress):
    return package.module.ToleranceVolume(
        surface.arrays.vertices,
        surface.arrays.triangles,
        tolerance,
        to_world=surface.matrix,
        threads=threads,
        progress=progress,
    )


def forget():
    _volumes.clear()
