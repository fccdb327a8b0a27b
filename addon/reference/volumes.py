# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the native tolerance volumes of references and keeps the last used ones."""

from .. import native
from . import snapshots, tolerances
from .volume_cache import VolumeCache

_volumes = VolumeCache(most_bytes=600_000_000)


def built_of(ob):
    """Returns the tolerance volume of the stored reference if it is in memory. It is quick enough to be called in drawing."""
    tolerance = tolerances.tolerance_length(ob.tolvol, snapshots.snapshot_size(ob))
    return _volumes.built((ob.tolvol.snapshot_fingerprint, snapshots.reference_matrix(ob).tobytes(), tolerance))


def native_volume(surface, tolerance, threads=None, progress=None):
    """Returns the tolerance volume of a surface. A volume that was built for the same content is used again."""
    return _volumes.get(_key(surface, tolerance), lambda: _build(surface, tolerance, threads, progress), progress)


def passing_volume(surface, tolerance, threads=None, progress=None):
    """Returns the tolerance volume of a surface, and does not keep one that it builds: others in memory stay there."""
    return _volumes.built(_key(surface, tolerance)) or _build(surface, tolerance, threads, progress)


def _key(surface, tolerance):
    return surface.arrays.fingerprint(), surface.matrix.tobytes(), tolerance


def _build(surface, tolerance, threads, progress):
    return native.module.ToleranceVolume(
        surface.arrays.vertices,
        surface.arrays.triangles,
        tolerance,
        to_world=surface.matrix,
        threads=threads,
        progress=progress,
    )


def forget():
    _volumes.clear()
