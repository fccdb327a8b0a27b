# SPDX-License-Identifier: GPL-3.0-or-later
import hashlib
import os

import bpy
import numpy as np
import pytest

import addon
from addon import native
from commands import end_served, save
from scenes import empty_scene, torus_arrays


@pytest.fixture(scope="session", autouse=True)
def _registered():
    assert native.module is not None, native.reason
    addon.register()
    yield
    end_served()
    addon.unregister()


@pytest.fixture(autouse=True)
def _empty_scene(_registered):
    empty_scene()


@pytest.fixture(scope="session")
def _spreads():
    """{what was measured: its DeviationResult}"""
    return {}


@pytest.fixture
def measured_once(monkeypatch, _spreads):
    """Measures the statistics of each pair of surfaces once in the session: that takes as long for a small mesh."""
    deviation = native.module.deviation

    def once(*arrays, threads=None, progress=None, **options):
        assert not any(isinstance(value, np.ndarray) for value in options.values())  # repr() shortens arrays.
        content = hashlib.sha256(repr(sorted(options.items())).encode())
        for array in arrays:
            content.update(repr((array.shape, array.dtype)).encode() + np.ascontiguousarray(array).tobytes())
        key = content.digest()
        if key not in _spreads:
            _spreads[key] = deviation(*arrays, threads=threads, progress=progress, **options)
        return _spreads[key]

    monkeypatch.setattr(native.module, "deviation", once)


@pytest.fixture(scope="session")
def gl():
    """Skips tests that draw if nothing can be drawn here, or fails them if TOLVOL_REQUIRE_GL is set."""
    try:
        native.module.renderer()
    except native.module.GlUnavailable as error:
        if os.environ.get("TOLVOL_REQUIRE_GL"):
            raise
        pytest.skip(str(error))


@pytest.fixture
def scan(tmp_path):
    """A file with a rough torus."""
    return save(tmp_path / "scan.ply", ("scan", *torus_arrays()))


@pytest.fixture
def chosen_preferences():
    """Preferences that the user has chosen for the installed add-on."""
    installed = bpy.context.preferences.addons.new()
    installed.module = addon.__name__
    yield installed.preferences
    bpy.context.preferences.addons.remove(installed)
