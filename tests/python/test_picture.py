# SPDX-License-Identifier: GPL-3.0-or-later
"""render_distance, render_volume, Camera and transfer_colours: the content of pictures, and bad input."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
import tolvol

import meshes

TOLERANCE = 0.03


@pytest.fixture(scope="module")
def torus():
    return meshes.torus(128, 64)


@pytest.fixture(scope="module")
def volume(torus, gl):
    return tolvol.ToleranceVolume(*torus, TOLERANCE)


def offset(share):
    """Returns the torus, moved by `share` tolerances away from the reference."""
    return meshes.torus(128, 64, tube=0.4 + share * TOLERANCE)


def striped(picture):
    """Tells which pixels of a picture with one sample per pixel are marked as outside."""
    colours = np.array(tolvol.OUTSIDE_COLOURS, np.uint8)
    return (picture[..., None, :3] == colours).all(-1).any(-1) & (picture[..., 3] == 255)


def draw(surface, volume, **options):
    return tolvol.render_distance(*surface, volume, **{"size": (120, 80), "samples": 1, **options})


def test_a_picture_has_the_asked_size_and_a_transparent_background(torus, volume):
    picture = draw(torus, volume)
    assert picture.shape == (80, 120, 4) and picture.dtype == np.uint8
    assert (picture[0, 0] == 0).all() and (picture[..., 3] == 255).mean() > 0.2
    assert not striped(picture).any()


def test_top_row_first(torus, volume):
    # The camera looks below the torus, so the torus is high up in the picture.
    camera = tolvol.Camera((0, -9, 0), (0, 0, -1.5), angle=30)
    rows = np.flatnonzero(draw(torus, volume, camera=camera)[..., 3].any(1))
    assert rows.mean() < 30


def test_transfers_show_their_colours(volume):
    # The nearest point of the torus is in the middle of the picture.
    camera = tolvol.Camera((0, -20, 0), (0, 0, 0), angle=1)
    for transfer, lowest in (("signed", -1), ("magnitude", 0)):
        colours = tolvol.transfer_colours(transfer).astype(int)
        assert colours.shape == (256, 3)
        for share in (-0.8, -0.2, 0.3, 0.9):
            picture = draw(offset(share), volume, camera=camera, transfer=transfer, size=(9, 9))
            value = share if lowest else abs(share)
            expected = colours[round(255 * (value - lowest) / (1 - lowest))]
            assert np.abs(picture[4, 4, :3] - expected).max() < 10, (transfer, share)


def test_what_is_outside_is_striped_and_nothing_else(volume):
    for share, outside in ((0.97, False), (1.03, True), (-1.03, True), (40, True)):
        picture = draw(offset(share), volume)
        assert striped(picture).any() == outside, share
        assert not outside or striped(picture).sum() == (picture[..., 3] > 0).sum()


def test_to_world_places_the_mesh(torus, volume):
    vertices, triangles = torus
    turn = np.array([[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]], float)
    local = (vertices - turn[:3, 3]) @ turn[:3, :3]
    camera = tolvol.Camera.framing(vertices, triangles)
    there = draw((local, triangles), volume, camera=camera, to_world=turn)
    assert np.abs(there.astype(int) - draw(torus, volume, camera=camera)).mean() < 0.1
    assert np.allclose(tolvol.Camera.framing(local, triangles, to_world=turn).eye, camera.eye)


def test_a_mirrored_reference_keeps_its_inside(torus, volume):
    mirror = np.diag([-1.0, 1, 1, 1])
    mirrored = tolvol.ToleranceVolume(*torus, TOLERANCE, to_world=mirror)
    for surface in (offset(0.8), offset(-0.8)):
        assert np.abs(draw(surface, mirrored).astype(int) - draw(surface, volume)).mean() < 2


def test_options_change_the_picture(torus, volume):
    plain = draw(torus, volume)
    assert not np.array_equal(plain, draw(torus, volume, edges=True))
    smooth = draw(torus, volume, samples=3)
    assert ((smooth[..., 3] > 0) & (smooth[..., 3] < 255)).any() and not (
        (plain[..., 3] > 0) & (plain[..., 3] < 255)
    ).any()
    camera = tolvol.Camera.framing(*torus, size=(120, 80), margin=1.0)
    assert (draw(torus, volume, camera=camera)[..., 3] > 0).sum() < 0.6 * (plain[..., 3] > 0).sum()


def test_float32_and_float64_look_the_same(torus, volume):
    vertices, triangles = torus
    single = draw((vertices.astype(np.float32), triangles.astype(np.int64)), volume)
    assert np.abs(single.astype(int) - draw(torus, volume)).mean() < 0.1


def test_a_volume_is_drawn_around_its_reference(torus, volume):
    size = 150, 100
    alone = tolvol.render_volume(volume, size=size, samples=1)
    camera = tolvol.Camera.framing(*torus, size=size, margin=TOLERANCE)

    def inside_of(mesh):
        return tolvol.render_volume(volume, camera=camera, size=size, vertices=mesh[0], triangles=mesh[1], samples=1)

    assert np.array_equal(alone, inside_of(torus))
    bare = tolvol.render_volume(volume, camera=camera, size=size, samples=1, cut=((0, 0, -5), (0, 0, 1)))
    mesh = bare[..., 3] > 0
    shell = (alone[..., 3] > 0) & ~mesh
    assert mesh.mean() > 0.1 and (alone[mesh][:, 3] == 255).all() and 0.003 < shell.mean() < 0.2
    assert np.abs(bare[mesh].astype(int) - alone[mesh]).mean() > 10
    smaller = inside_of(meshes.torus(32, 16, tube=0.1))
    assert (smaller[..., 3] == 255).sum() < 0.5 * mesh.sum()


def test_bad_input_is_named(torus, volume):
    vertices, triangles = torus
    broken = vertices.copy()
    broken[17, 1] = np.nan
    huge = vertices.copy()
    huge[17, 1] = 1e200
    nothing = np.empty((0, 3)), np.empty((0, 3), np.int32)
    for surface, message in (
        ((broken, triangles), "vertex 17"),
        ((huge, triangles), "vertex 17"),
        (nothing, "no vertices"),
        ((vertices, triangles + 1), "vertex"),
    ):
        for camera in (None, tolvol.Camera((0, -9, 0), (0, 0, 0))):
            with pytest.raises(tolvol.InvalidInput, match=message):
                draw(surface, volume, camera=camera)
    for options, message in (
        ({"size": (0, 10)}, "width and height"),
        ({"size": (10, 10**6)}, "width and height must be from 1 to"),
        ({"samples": 0}, "samples"),
        ({"samples": 9}, "samples"),
        ({"transfer": "rainbow"}, "rainbow"),
        ({"threads": -1}, "threads"),
        ({"to_world": np.zeros((4, 4))}, ""),
    ):
        with pytest.raises(tolvol.InvalidInput, match=message):
            draw(torus, volume, **options)
    with pytest.raises(tolvol.InvalidInput, match="both"):
        tolvol.render_volume(volume, vertices=vertices)
    with pytest.raises(tolvol.InvalidInput, match="cut"):
        tolvol.render_volume(volume, cut=((0, 0, 0), (0, 0, 0)))
    with pytest.raises(tolvol.InvalidInput, match="rainbow"):
        tolvol.transfer_colours("rainbow")
    for bad in ({"eye": (0, 0, 0)}, {"eye": (0, 0, 1)}, {"angle": 0}, {"angle": 180}, {"eye": (np.inf, 0, 0)}):
        with pytest.raises(tolvol.InvalidInput, match="camera"):
            tolvol.Camera(**{"eye": (0, -1, 0), "target": (0, 0, 0), **bad})
    assert draw(torus, volume).any()


def test_a_camera_says_what_it_is():
    camera = tolvol.Camera((1, 2, 3), (4, 5, 6), up=(0, 1, 0), angle=20)
    assert (camera.eye, camera.target, camera.up, camera.angle) == ([1, 2, 3], [4, 5, 6], [0, 1, 0], 20)


def test_progress_and_stop(torus, gl):
    volume = tolvol.ToleranceVolume(*torus, TOLERANCE)
    progress = tolvol.Progress()
    tolvol.render_distance(*torus, volume, size=(50, 50), progress=progress)
    assert progress.stage == "picture"
    progress.cancel()
    for call in (
        lambda: draw(torus, volume, progress=progress),
        lambda: tolvol.render_volume(volume, progress=progress),
    ):
        with pytest.raises(tolvol.Cancelled):
            call()
    assert draw(torus, volume).any()


def test_after_a_shutdown_pictures_are_the_same(torus, volume):
    before = draw(torus, volume), tolvol.render_volume(volume, size=(60, 40))
    tolvol.shutdown()
    with pytest.raises(tolvol.GlUnavailable):
        draw(torus, volume)  # The kept buffers were lost with the context: the picture must still be complete.
    after = draw(torus, volume), tolvol.render_volume(volume, size=(60, 40))
    assert all(np.array_equal(a, b) for a, b in zip(before, after))


def test_threads_draw_side_by_side(torus, volume):
    other = tolvol.ToleranceVolume(*torus, 2 * TOLERANCE)
    expected = {id(v): draw(torus, v) for v in (volume, other)}
    wrong = []

    def work(v):
        for _ in range(5):
            if not np.array_equal(draw(torus, v), expected[id(v)]):
                wrong.append(v)

    threads = [threading.Thread(target=work, args=(v,)) for v in (volume, other, volume)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_dropped_volumes_leave_no_memory(gl):
    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    surface = meshes.torus(24, 12)

    def make(count):
        for _ in range(count):
            tolvol.render_distance(*surface, tolvol.ToleranceVolume(*surface, 0.1), size=(16, 16))
        tolvol.renderer()  # This call runs after the calls that were posted before.

    make(30)
    before = resident()
    make(100)
    assert resident() - before < 5e6


def test_without_gl_the_reason_is_said(torus):
    script = """
import sys, meshes, tolvol
volume = tolvol.ToleranceVolume(*meshes.torus(), 0.03)
for draw in (lambda: tolvol.render_distance(*meshes.torus(), volume), lambda: tolvol.render_volume(volume)):
    try:
        draw()
        sys.exit("drawn")
    except tolvol.GlUnavailable as error:
        assert str(error).startswith("GL unavailable: "), error
print(volume.check(*meshes.torus()).verdicts.min())
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "__EGL_VENDOR_LIBRARY_FILENAMES": "/dev/null"},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout.strip()) == (0, "2"), done.stderr
