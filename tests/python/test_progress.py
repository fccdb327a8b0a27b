# SPDX-License-Identifier: GPL-3.0-or-later
"""Long calls show their progress to another thread, which can stop them."""

import _thread
import signal
import threading
import time

import numpy as np
import pytest
import tolvol

import meshes

LARGE = meshes.torus(400, 150, noise=0.0005)
TOLERANCE = 0.005 * tolvol.diagonal(*LARGE)
# Large enough for a refinement that takes long.
SMALLER = meshes.torus(120, 60, noise=0.0005)


def watch(call):
    """Runs call(progress) in a thread; returns progress, thread, and a list that receives result or exception."""
    progress, outcome = tolvol.Progress(), []

    def work():
        try:
            outcome.append(call(progress))
        except tolvol.TolvolError as error:
            outcome.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    return progress, thread, outcome


CALLS = {
    "ToleranceVolume": lambda progress: tolvol.ToleranceVolume(*LARGE, TOLERANCE, progress=progress),
    "check": lambda progress: VOLUME.check(LARGE[0], LARGE[1], progress=progress),
    "decimate": lambda progress: tolvol.decimate(*LARGE, VOLUME, progress=progress),
    "constrain": lambda progress: tolvol.constrain(LARGE[0], LARGE[0] + TOLERANCE, LARGE[1], VOLUME, progress=progress),
    "Guard": lambda progress: tolvol.Guard(LARGE[0].astype(np.float32), LARGE[1], VOLUME, progress=progress),
    "smooth": lambda progress: tolvol.smooth(*LARGE, VOLUME, progress=progress),
    "hausdorff": lambda progress: tolvol.hausdorff(*LARGE, *meshes.torus(), progress=progress),
    "directed_hausdorff": lambda progress: tolvol.directed_hausdorff(*LARGE, *meshes.torus(), progress=progress),
    "distance": lambda progress: VOLUME.distance(LARGE[0], progress=progress),
    "grid": lambda progress: VOLUME.grid(signed=True, progress=progress),
    "DisplayTree": lambda progress: tolvol.DisplayTree(VOLUME, progress=progress),
    "deform": lambda progress: tolvol.deform(LARGE[0], LATTICE, LARGE[1], VOLUME, progress=progress),
    "close_holes": lambda progress: tolvol.close_holes(*LARGE, VOLUME, progress=progress),
    "deviation": lambda progress: tolvol.deviation(*LARGE, *meshes.torus(), progress=progress),
}
LATTICE = tolvol.Lattice(tolvol.lattice_points(4))
VOLUME = tolvol.ToleranceVolume(*LARGE, TOLERANCE)
VOLUME_OF_SMALLER = tolvol.ToleranceVolume(*SMALLER, TOLERANCE)


def test_progress_moves_while_python_runs_on():
    progress, thread, outcome = watch(CALLS["decimate"])
    seen = []
    while thread.is_alive():
        seen.append((progress.stage, progress.fraction))
        time.sleep(0.001)
    assert not isinstance(outcome[0], Exception)
    assert len(set(seen)) > 5
    assert all(0 <= fraction <= 1 for _, fraction in seen)
    assert any(stage for stage, _ in seen)
    assert not progress.cancelled


def test_progress_does_not_go_back_between_the_directions():
    progress, thread, outcome = watch(CALLS["hausdorff"])
    seen = []
    while thread.is_alive():
        seen.append(progress.fraction)
        time.sleep(0.0005)
    assert not isinstance(outcome[0], Exception)
    assert seen == sorted(seen) and 0.5 < progress.fraction <= 1


def test_a_part_of_the_progress_ends_with_its_context():
    progress = tolvol.Progress()
    with pytest.raises(ZeroDivisionError), progress.part(0.25, 0.5):
        CALLS["check"](progress)
        assert 0.25 <= progress.fraction <= 0.5
        raise ZeroDivisionError
    CALLS["hausdorff"](progress)
    assert progress.fraction > 0.5


@pytest.mark.parametrize("ends", [(-0.1, 0.5), (0.5, 0.4), (0.5, 1.1), (float("nan"), 1), (0, float("nan"))])
def test_a_part_of_the_progress_is_from_0_to_1(ends):
    with pytest.raises(tolvol.InvalidInput, match="0 <= first <= last <= 1"):
        tolvol.Progress().part(*ends)


def test_cancel_from_another_thread():
    progress, thread, outcome = watch(CALLS["decimate"])
    while thread.is_alive() and progress.fraction == 0:
        time.sleep(0.0005)
    assert thread.is_alive()
    progress.cancel()
    thread.join()
    assert isinstance(outcome[0], tolvol.Cancelled)
    assert progress.cancelled


def test_cancel_while_the_input_is_compared_with_the_reference():
    vertices, triangles = LARGE
    volume = tolvol.ToleranceVolume(vertices, triangles, TOLERANCE)
    moved = vertices + 0.4 * TOLERANCE * np.array([1, 0, 0])
    progress, thread, outcome = watch(lambda progress: tolvol.decimate(moved, triangles, volume, progress=progress))
    while thread.is_alive() and not (progress.stage == "comparing" and progress.fraction > 0):
        time.sleep(0.0005)
    progress.cancel()
    while thread.is_alive():
        assert progress.stage == "comparing", "it went on"
        time.sleep(0.0005)
    assert isinstance(outcome[0], tolvol.Cancelled)


def test_finish_keeps_the_last_state_of_a_thorough_decimation():
    fast = tolvol.decimate(*SMALLER, VOLUME_OF_SMALLER)
    progress, thread, outcome = watch(
        lambda progress: tolvol.decimate(*SMALLER, VOLUME_OF_SMALLER, effort="thorough", progress=progress)
    )
    while thread.is_alive() and not (progress.stage == "refining" and progress.count < len(fast.triangles) - 4):
        time.sleep(0.001)
    assert thread.is_alive() and not progress.finishing
    progress.finish()
    thread.join()
    assert progress.finishing and outcome[0].report["stopped_by"] == "request"
    assert len(outcome[0].triangles) < len(fast.triangles)
    result = outcome[0].vertices, outcome[0].triangles
    # Without the bound the interval may reach beyond the tolerance although the true distance is within it.
    assert tolvol.directed_hausdorff(*result, *SMALLER, bound=TOLERANCE).upper <= TOLERANCE
    assert tolvol.directed_hausdorff(*SMALLER, *result, bound=TOLERANCE).upper <= TOLERANCE


@pytest.mark.parametrize("call", CALLS)
def test_a_call_that_is_cancelled_before_it_starts(call):
    progress = tolvol.Progress()
    progress.cancel()
    with pytest.raises(tolvol.Cancelled):
        CALLS[call](progress)


def interrupted(when):
    """Starts a thread that presses Ctrl-C as soon as when() is true."""

    def interrupt():
        while not when():
            time.sleep(0.0005)
        _thread.interrupt_main()

    thread = threading.Thread(target=interrupt)
    thread.start()
    return thread


def test_ctrl_c_stops_a_call():
    progress = tolvol.Progress()
    thread = interrupted(lambda: progress.fraction > 0)
    with pytest.raises(KeyboardInterrupt):
        tolvol.decimate(*LARGE, VOLUME, effort="thorough", progress=progress)
    thread.join()
    assert progress.stage != "refining", "it went on"
    # The cancelled call does not affect the next one.
    assert (VOLUME.check(*LARGE).verdicts == tolvol.Verdict.INSIDE).all()


def test_a_handler_of_ctrl_c_may_keep_what_a_thorough_decimation_has():
    progress = tolvol.Progress()
    before = signal.signal(signal.SIGINT, lambda *_: progress.finish())

    thread = interrupted(lambda: progress.stage == "refining")
    try:
        result = tolvol.decimate(*SMALLER, VOLUME_OF_SMALLER, effort="thorough", progress=progress)
    finally:
        signal.signal(signal.SIGINT, before)
    thread.join()
    assert result.report["stopped_by"] == "request"
    assert tolvol.directed_hausdorff(result.vertices, result.triangles, *SMALLER, bound=TOLERANCE).upper <= TOLERANCE


def test_max_seconds_ends_the_fast_phase_with_what_is_proved():
    whole = tolvol.decimate(*SMALLER, VOLUME_OF_SMALLER)
    result = tolvol.decimate(*SMALLER, VOLUME_OF_SMALLER, max_seconds=1e-9)
    assert result.report["stopped_by"] == "time" and len(result.triangles) > len(whole.triangles)
    assert tolvol.directed_hausdorff(result.vertices, result.triangles, *SMALLER, bound=TOLERANCE).upper <= TOLERANCE


def test_progress_changes_no_result():
    vertices, triangles = meshes.torus(48, 24)
    volume = tolvol.ToleranceVolume(vertices, triangles, 0.03)
    plain = tolvol.decimate(vertices, triangles, volume)
    watched = tolvol.decimate(vertices, triangles, volume, progress=tolvol.Progress())
    assert np.array_equal(plain.vertices, watched.vertices) and np.array_equal(plain.triangles, watched.triangles)
