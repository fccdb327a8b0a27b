# SPDX-License-Identifier: GPL-3.0-or-later
"""Workers run Python code only while another thread waits for them."""

import _thread
import contextlib
import gc
import signal
import subprocess
import sys
import threading
import time
import weakref
from pathlib import Path

import numpy as np
import pytest
import tolvol

import meshes

SPHERE = meshes.sphere(3)
VOLUME = tolvol.ToleranceVolume(*SPHERE, 0.01)
WITHIN = 60  # seconds in which a worker ends on any machine


def until_workers_rest():
    """Lets Python's other threads run until all of them sleep, at several looks: a worker that could go on has done so."""
    looks, deadline = 0, time.monotonic() + WITHIN
    while looks < 5:
        assert time.monotonic() < deadline
        time.sleep(0.001)
        looks = looks + 1 if all(state == "S" for state in states_of_other_threads()) else 0


def states_of_other_threads():
    """Yields a letter for each other thread of this process, S for one that sleeps."""
    for task in Path("/proc/self/task").iterdir():
        if int(task.name) != threading.get_native_id():
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # It has just ended.
                yield (task / "stat").read_text().rpartition(")")[2].split()[0]


def test_a_worker_runs_only_while_it_is_waited_for():
    ran = []
    worker = tolvol.Worker(lambda: ran.append(threading.get_ident()))
    until_workers_rest()
    assert not ran
    worker.join()
    assert len(ran) == 1 and ran[0] != threading.get_ident() and worker.done()


def test_a_worker_does_not_come_back_from_the_module_before_it_is_waited_for():
    stages = []

    def work():
        stages.append("before")
        stages.append(len(VOLUME.check(*SPHERE).verdicts))
        tolvol.pause(0.0)
        stages.append("after")

    worker = tolvol.Worker(work)
    while not stages:
        worker.done()
    seen = len(stages)
    until_workers_rest()
    assert len(stages) == seen
    worker.join()
    assert stages == ["before", len(SPHERE[1]), "after"]


def test_the_module_works_while_nobody_waits():
    progress = tolvol.Progress()
    large = meshes.torus(240, 120, noise=0.0005)
    volume = tolvol.ToleranceVolume(*large, 0.001)
    worker = tolvol.Worker(lambda: tolvol.decimate(*large, volume, progress=progress))
    while not progress.stage:
        worker.done()
    before, deadline = (progress.stage, progress.count), time.monotonic() + WITHIN
    while (progress.stage, progress.count) == before and time.monotonic() < deadline:
        time.sleep(0.01)
    assert (progress.stage, progress.count) != before
    worker.join()


def test_a_glance_lets_a_worker_run_that_wants_to():
    glances, done = 0, []
    worker = tolvol.Worker(lambda: [tolvol.pause(0.0) for _ in range(3)] and done.append(1))
    while not worker.done() and glances < 10_000:
        glances += 1
        time.sleep(0.001)
    assert done and worker.done()


def test_who_waits_gets_back_only_between_the_python_code_of_workers():
    inside, seen = [], []

    def work():
        for _ in range(200):
            inside.append(1)
            sum(range(2000))
            inside.pop()
            tolvol.pause(0.0)

    workers = [tolvol.Worker(work) for _ in range(4)]
    while not all(worker.done(0.001) for worker in workers):
        seen.append(len(inside))
    assert not any(seen)


@pytest.mark.parametrize("seconds", [0.0, 0.05])
def test_waiting_takes_at_least_as_long_as_asked(seconds):
    release = threading.Event()

    def work():
        while not release.is_set():
            tolvol.pause(0.001)

    worker = tolvol.Worker(work)
    started = time.monotonic()
    assert not worker.done(seconds)
    assert seconds <= time.monotonic() - started
    started = time.monotonic()
    tolvol.pause(seconds)
    assert seconds <= time.monotonic() - started
    release.set()
    worker.join()


def test_a_worker_may_wait_for_another_one():
    made = []

    def waits():
        while not made:
            tolvol.pause(0.001)
        made.append(2)

    second = tolvol.Worker(waits)
    first = tolvol.Worker(lambda: made.append(1))
    second.join()
    assert made == [1, 2] and first.done()


def test_a_worker_that_waits_lets_no_other_one_run():
    made = []
    first = tolvol.Worker(lambda: made.append(1))
    second = tolvol.Worker(first.join)
    third = tolvol.Worker(lambda: first.done(0.1))
    until_workers_rest()
    assert not made
    second.join()
    third.join()
    assert made == [1]


@pytest.mark.parametrize("seconds", [-1.0, -float("inf")])
def test_a_time_that_is_over_is_no_time(seconds):
    release = []

    def work():
        while not release:
            tolvol.pause(0.0)

    worker = tolvol.Worker(work)
    assert not worker.done(seconds)
    tolvol.pause(seconds)
    release.append(1)
    assert worker.done(float("inf"))


def test_a_time_that_is_no_number_is_refused():
    worker = tolvol.Worker(lambda: None)
    for call in (worker.done, tolvol.pause):
        with pytest.raises(tolvol.InvalidInput, match="seconds"):
            call(float("nan"))
    worker.join()


def test_an_exception_is_told_and_ends_the_worker(monkeypatch):
    told = []
    monkeypatch.setattr(sys, "unraisablehook", lambda about: told.append(about.exc_type))
    worker = tolvol.Worker(lambda: 1 / 0)
    worker.join()
    assert told == [ZeroDivisionError]


def test_errors_of_the_module_arrive_in_the_worker():
    caught = []

    def work():
        progress = tolvol.Progress()
        progress.cancel()
        try:
            tolvol.decimate(*SPHERE, VOLUME, progress=progress)
        except tolvol.Cancelled as error:
            caught.append(error)

    tolvol.Worker(work).join()
    assert len(caught) == 1


def test_what_a_worker_holds_is_freed_when_it_ends():
    array = np.zeros(3)
    alive = weakref.ref(array)
    worker = tolvol.Worker(lambda held=array: None)
    del array
    worker.join()
    gc.collect()
    assert alive() is None


def test_a_worker_may_be_forgotten_while_it_runs():
    ran = []
    tolvol.Worker(lambda: ran.append(1))
    while not ran:
        tolvol.pause(0.01)


def test_a_signal_ends_waiting():
    wanted, release, late, deadline = [], [], [], time.monotonic() + WITHIN

    def work():
        """It runs only while it is waited for. If waiting does not end by the signal, the work does at the deadline."""
        while not release and not late:
            if wanted:
                _thread.interrupt_main(wanted.pop())
            late.extend([1] * (time.monotonic() > deadline))
            tolvol.pause(0.001)

    worker = tolvol.Worker(work)
    for wait in (worker.join, lambda: worker.done(2 * WITHIN), lambda: tolvol.pause(2 * WITHIN)):
        wanted.append(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            wait()
        assert not wanted and not late
    release.append(1)
    worker.join()


def test_the_process_ends_although_a_worker_never_had_its_turn():
    script = "import tolvol; tolvol.Worker(lambda: print('unwanted')); print('end')"
    environment = {"PYTHONPATH": str(next(iter(tolvol.__path__)))[: -len("/tolvol")]}
    ended = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=WITHIN, env=environment
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "end\n", "")
