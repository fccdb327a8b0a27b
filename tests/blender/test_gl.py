# SPDX-License-Identifier: GPL-3.0-or-later
"""Smoke tests of GL inside Blender, whose main thread may have a context of its own."""

import numpy as np
import pytest

import addon
from addon import native
from commands import command
from scenes import torus_arrays

pytestmark = pytest.mark.usefixtures("gl")

TOLERANCE = 0.03


def torus():
    """Returns (vertices, triangles) in the world."""
    vertices, faces = torus_arrays()
    faces = np.asarray(faces)
    triangles = faces if faces.shape[1] == 3 else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    return np.asarray(vertices, float), triangles


def test_the_renderer_has_a_name():
    assert "GL 4" in native.module.renderer()


def test_occlusion_queries_say_what_the_certificate_says():
    surface = torus()
    volume = native.module.ToleranceVolume(*surface, TOLERANCE, precision=4)
    found = volume.check(*surface, method="occlusion_query")
    assert found.renderer == native.module.renderer()
    assert (found.verdicts == native.module.Verdict.INSIDE).all() and (
        volume.check(*surface).verdicts == native.module.Verdict.INSIDE
    ).all()
    far = surface[0] + (0, 0, 3 * TOLERANCE)
    assert not (volume.check(far, surface[1], method="occlusion_query").verdicts == native.module.Verdict.INSIDE).all()


def test_a_picture_shows_the_mesh():
    surface = torus()
    volume = native.module.ToleranceVolume(*surface, TOLERANCE)
    picture = native.module.render_distance(*surface, volume, size=(80, 60))
    assert picture.shape == (60, 80, 4)
    assert 0.2 < (picture[..., 3] == 255).mean() < 0.9 and len(np.unique(picture.reshape(-1, 4), axis=0)) > 100


def test_unregistering_ends_gl_and_it_starts_again():
    surface = torus()
    volume = native.module.ToleranceVolume(*surface, TOLERANCE)
    before = native.module.render_distance(*surface, volume, size=(40, 30))
    addon.unregister()
    try:
        with pytest.raises(native.module.GlUnavailable):
            native.module.render_distance(*surface, volume, size=(40, 30))
    finally:
        addon.register()
    assert np.array_equal(native.module.render_distance(*surface, volume, size=(40, 30)), before)


def test_without_egl_a_picture_is_refused_before_the_work(scan, tmp_path):
    out, picture = tmp_path / "out.ply", tmp_path / "picture.png"
    hidden = "import os; os.environ['__EGL_VENDOR_LIBRARY_FILENAMES'] = '/dev/null'"
    code, said, error = command("decimate.py", scan, out, "--tolerance", "1%", "--picture", picture, before=hidden)
    assert code == 2 and "--picture: GL unavailable: " in error and "triangles" not in said
    assert not out.exists() and not picture.exists()


def test_without_egl_a_page_has_no_pictures_and_says_so(scan, tmp_path):
    hidden = "import os; os.environ['__EGL_VENDOR_LIBRARY_FILENAMES'] = '/dev/null'"
    code, said, error = command("report.py", scan, scan, "--report", tmp_path / "r.html", before=hidden)
    assert (code, error) == (0, "") and "note: no pictures in the report: GL unavailable: " in said
    assert "<img" not in (tmp_path / "r.html").read_text()
