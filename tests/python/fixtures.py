# SPDX-License-Identifier: GPL-3.0-or-later
"""Fixtures of the tests of the package and of its command."""

import os

import pytest


@pytest.fixture(scope="session")
def gl():
    """Skips tests that draw if nothing can be drawn here, or fails them if TOLVOL_REQUIRE_GL is set."""
    import tolvol

    try:
        tolvol.renderer()
    except tolvol.GlUnavailable as error:
        if os.environ.get("TOLVOL_REQUIRE_GL"):
            raise
        pytest.skip(str(error))
