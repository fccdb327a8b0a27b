# SPDX-License-Identifier: GPL-3.0-or-later
"""ToleranceVolume.check(method=): names, groups, threads, errors without GL, and memory."""

import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
import tolvol

import meshes

OUTSIDE, UNPROVED, INSIDE = tolvol.Verdict
LABELS = {
    "certificate": "certificate",
    "gl_certificate": "gl_certificate",
    "occlusion_query": "occlusion_query",
    "paper": "paper (not conservative)",
    "paper_half_h": "paper, h/2 (not conservative)",
}
GL_METHODS = [method for method in LABELS if method != "certificate"]
PLATE = meshes.plate(9)
TORUS = meshes.torus(48, 24)
TOLERANCE = 0.05

pytestmark = pytest.mark.usefixtures("gl")


def torus_volume():
    return tolvol.ToleranceVolume(*TORUS, TOLERANCE, precision=5)


def moved(seed, share=0.5):
    return TORUS[0] + share * TOLERANCE * np.random.default_rng(seed).uniform(-1, 1, TORUS[0].shape)


@pytest.mark.parametrize("method", LABELS)
def test_each_method_sees_both_sides_and_names_itself(method):
    volume = tolvol.ToleranceVolume(*PLATE, 0.1, precision=5)
    corners = np.array([[0.2, 0.2, 0], [0.8, 0.3, 0], [0.4, 0.9, 0]])
    points = (corners[None] + np.array([0, 0.05, 0.101, 0.3])[:, None, None] * [0, 0, 1]).reshape(-1, 3)
    faces = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    result = volume.check(points, faces, method=method)
    assert (result.verdicts == INSIDE).tolist() == [True, True, False, False]
    assert result.method == LABELS[method]
    assert result.renderer == ("CPU" if method == "certificate" else tolvol.renderer())
    # Only two kinds of methods have the verdict outside: the certificate, which proves it, and the paper's check, which has
    # no verdict unproved.
    says_outside = method in ("certificate", "paper", "paper_half_h")
    assert result.verdicts[3] == (OUTSIDE if says_outside else UNPROVED)
    grouped = volume.check(points, faces, groups=np.array([1, 1, 0, 1], np.int32), method=method)
    assert (grouped.verdicts == INSIDE).tolist() == [False] * 4


@pytest.mark.parametrize("method", GL_METHODS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_gl_methods_take_what_the_certificate_takes(method, dtype):
    volume = tolvol.ToleranceVolume(*PLATE, 0.1, precision=5)
    quad = np.array([[0.2, 0.2, 0], [0.8, 0.2, 0], [0.8, 0.8, 0], [0.2, 0.8, 0]], dtype)
    for corners in (2, 3, 4):
        face = np.arange(corners, dtype=np.int64)[None]
        assert volume.check(quad, face, method=method).verdicts.tolist() == [INSIDE]
        lift = meshes.matrix(np.eye(3), (0, 0, 0.2))
        assert volume.check(quad, face, to_world=lift, method=method).verdicts.tolist() != [INSIDE]
    assert volume.check(quad, np.empty((0, 3), np.int32), method=method).verdicts.shape == (0,)


def test_an_unknown_method_is_refused_with_the_names_of_the_others():
    with pytest.raises(tolvol.InvalidInput, match='unknown method "papers".*' + ", ".join(LABELS)):
        torus_volume().check(*TORUS, method="papers")


def test_a_grid_too_coarse_to_interpolate_is_refused_with_the_precision_that_will_do():
    coarse = tolvol.ToleranceVolume(*TORUS, TOLERANCE)
    with pytest.raises(tolvol.InvalidInput, match="finer grid") as error:
        coarse.check(*TORUS, method="occlusion_query")
    precision = float(re.search(r"precision=(\S+)", str(error.value))[1])
    fine = tolvol.ToleranceVolume(*TORUS, TOLERANCE, precision=precision)
    assert (fine.check(*TORUS, method="occlusion_query").verdicts == INSIDE).all()


@pytest.mark.parametrize("method", GL_METHODS)
def test_a_gl_method_can_be_cancelled(method):
    progress = tolvol.Progress()
    progress.cancel()
    with pytest.raises(tolvol.Cancelled):
        torus_volume().check(*TORUS, method=method, progress=progress)


@pytest.mark.parametrize("shared", [False, True], ids=["two volumes", "one volume"])
def test_two_threads_get_what_one_gets(shared):
    volumes = [torus_volume()] * 2 if shared else [torus_volume(), torus_volume()]
    points = [moved(1, 1.5), moved(2, 1.5)]
    methods = ["occlusion_query", "gl_certificate"]
    expected = [v.check(p, TORUS[1], method=m).verdicts for v, p, m in zip(volumes, points, methods)]
    assert all(len(np.unique(e)) > 1 for e in expected)
    results = [[], []]

    def work(i):
        for _ in range(8):
            results[i].append(volumes[i].check(points[i], TORUS[1], method=methods[i]).verdicts)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for i in range(2):
        assert len(results[i]) == 8
        assert all(np.array_equal(verdict, expected[i]) for verdict in results[i])


def test_what_was_shut_down_says_so_once_and_starts_again():
    volume = torus_volume()
    for method in GL_METHODS:
        assert (volume.check(*TORUS, method=method).verdicts == INSIDE).any()
        tolvol.shutdown()
        with pytest.raises(tolvol.GlUnavailable, match="^GL unavailable: "):
            volume.check(*TORUS, method=method)
        assert (volume.check(*TORUS, method=method).verdicts == INSIDE).any()


def resident():
    return 1024 * int(re.search(r"VmRSS:\s+(\d+) kB", Path("/proc/self/status").read_text())[1])


def test_hundreds_of_volumes_leave_nothing_in_memory():
    vertices, triangles = meshes.torus(16, 8)

    def use(count):
        for _ in range(count):
            volume = tolvol.ToleranceVolume(vertices, triangles, 0.2, precision=3, threads=1)
            for method in GL_METHODS:
                assert (volume.check(vertices, triangles, method=method).verdicts == INSIDE).any()

    use(100)
    before = resident()
    use(400)
    assert resident() - before < 2e6


WITHOUT_GL = """
import sys
sys.path[:0] = sys.argv[1:]
import numpy as np, tolvol, meshes
volume = tolvol.ToleranceVolume(*meshes.plate(9), 0.1, precision=5)
calls = {
    method: lambda method=method: volume.check(*meshes.plate(9), method=method)
    for method in ("gl_certificate", "occlusion_query", "paper", "paper_half_h")
}
calls["field"] = lambda: tolvol.ToleranceVolume(*meshes.plate(9), 0.1, field="gl")
for name, call in calls.items():
    try:
        call()
        raise SystemExit(name + " answered")
    except tolvol.GlUnavailable as error:
        assert str(error).startswith("GL unavailable: "), error
assert (volume.check(*meshes.plate(9)).verdicts == tolvol.Verdict.INSIDE).all()
print("certificate alone")
"""


def test_without_egl_the_certificate_still_answers():
    paths = [str(Path(tolvol.__file__).parents[1]), str(Path(meshes.__file__).parent)]
    environment = {**os.environ, "__EGL_VENDOR_LIBRARY_FILENAMES": "/dev/null"}
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_GL, *paths], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.stdout == "certificate alone\n", done.stderr
