# SPDX-License-Identifier: GPL-3.0-or-later
"""The native tolerance volumes of references; the last ones used are kept."""

from .. import native
from . import snapshots, tolerances
from .volume_cache import VolumeCache

_volumes = VolumeCache(most_bytes=600_000_000)


def built_of(ob):
    """The tolerance volume of the reference that is set, if it is in memory; cheap enough to draw."""
    tolerance = tolerances.tolerance_length(ob.tolvol, snapshots.snapshot_size(ob))
    return _volumes.built((ob.tolvol.snapshot_fingerprint, snapshots.reference_matrix(ob).tobytes(), tolerance))


def native_volume(surface, tolerance, threads=0, progress=None):
    """The tolerance volume of a surface: built, or the one that was built of the same content before."""
    key = (surface.arrays.fingerprint(), surface.matrix.tobytes(), tolerance)

    def build():
        return native.module.ToleranceVolume(
            surface.arrays.vertices,
            surface.arrays.triangles,
            tolerance,
            to_world=surface.matrix,
            threads=threads,
            progress=progress,
        )

    return _volumes.get(key, build, progress)


def forget():
    _volumes.clear()
