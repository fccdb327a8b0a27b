# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates the memory that Decimate takes at its peak, so that the panel can name it before Decimate is pressed."""

import re
from pathlib import Path

from ..mesh import mesh_io
from ..reference import snapshots

# Bytes by themselves, and for each triangle of the mesh and of its reference, with the copies in Blender. Where edges are much
# longer than the tolerance, Decimate takes more.
_FIXED, _OF_MESH, _OF_REFERENCE = 40_000_000, 650, 350
# The memory of smaller meshes is not worth a sentence.
LEAST = 500_000_000


def needed(ob):
    """Returns how many bytes Decimate takes for an object, or None if it has no reference."""
    reference = ob.tolvol.snapshot
    if reference is None:
        source = snapshots.source_object(ob)
        if source is None or source.type != "MESH":
            return None
        reference = source.data
    return _FIXED + _OF_MESH * mesh_io.triangle_count(ob.data) + _OF_REFERENCE * mesh_io.triangle_count(reference)


def free():
    """Returns how many bytes the system can still give, or None where it does not tell."""
    try:
        found = re.search(r"MemAvailable:\s+(\d+) kB", Path("/proc/meminfo").read_text())
    except OSError:
        return None
    return 1024 * int(found[1]) if found else None


def told(ob):
    """Returns (a sentence about the memory that Decimate takes for an object, whether there is not as much), or None for a small
    mesh."""
    need = needed(ob)
    if need is None or need < LEAST:
        return None
    sentence, there = f"Decimate takes about {_gigabytes(need)} of memory", free()
    if there is None:
        return sentence, False
    return f"{sentence}, and {_gigabytes(there)} are free", need > there


def _gigabytes(size):
    return f"{size / 1e9:.2g} GB"
