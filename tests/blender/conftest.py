# SPDX-License-Identifier: GPL-3.0-or-later
import os

import bpy
import pytest

import addon
from addon import native
from commands import end_served, save
from scenes import torus_arrays


@pytest.fixture(scope="session", autouse=True)
def _registered():
    assert native.module is not None, native.reason
    addon.register()
    yield
    end_served()
    addon.unregister()


@pytest.fixture(autouse=True)
def _empty_scene(_registered):
    bpy.ops.wm.read_factory_settings(use_empty=True)


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
