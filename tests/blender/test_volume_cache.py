# SPDX-License-Identifier: GPL-3.0-or-later
"""The cache of volumes with several threads: panels are drawn while jobs build."""

import sys
import threading
import time

import pytest

from addon import native, reference
from addon.reference import snapshots
from addon.reference.built import volume_of
from addon.shared import volumes
from scenes import torus

PATIENCE = 60  # seconds after which a thread counts as stuck


@pytest.fixture
def builds(monkeypatch):
    """Builds volumes. Building waits for .go and then calls .end(); .begun counts the builds.

    .second is set once a second thread waits for the one that builds, or builds as well.
    """

    class Builds:
        begun, go, second, end = 0, threading.Event(), threading.Event(), staticmethod(lambda: None)

    build, pause = native.module.ToleranceVolume, native.module.pause

    def waits(seconds):
        Builds.second.set()
        pause(seconds)

    def built(*arguments, **options):
        Builds.begun += 1
        if Builds.begun > 1:
            Builds.second.set()
        assert Builds.go.wait(PATIENCE)
        Builds.end()
        return build(*arguments, **options)

    monkeypatch.setattr(native.module, "ToleranceVolume", built)
    monkeypatch.setattr(native.module, "pause", waits)
    reference.forget_all()
    return Builds


class Asking(threading.Thread):
    def __init__(self, surface, tolerance):
        super().__init__(daemon=True)
        self.surface, self.tolerance = surface, tolerance
        self.progress, self.volume, self.error = native.module.Progress(), None, None
        self.start()

    def run(self):
        try:
            self.volume = volumes.native_volume(self.surface, self.tolerance, 1, self.progress)
        except Exception as error:
            self.error = error

    def ended(self):
        self.join(PATIENCE)
        return not self.is_alive()


def test_a_panel_is_drawn_while_jobs_add_and_drop_volumes(monkeypatch):
    ob = torus(around=12, across=6)
    surface = snapshots.surface_of(ob)
    snapshots.set_reference(ob, surface)
    monkeypatch.setattr(native.module, "ToleranceVolume", lambda *_, **__: type("Volume", (), {"memory": 1}))
    going = threading.Event()

    def add():
        for i in range(1_000):
            volumes.native_volume(surface, 1 + i)
        going.set()

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    thread = threading.Thread(target=add, daemon=True)
    try:
        thread.start()
        while not going.is_set():
            volume_of(ob)
    finally:
        sys.setswitchinterval(interval)
        thread.join(PATIENCE)
        reference.forget_all()


def test_two_jobs_that_need_one_volume_build_it_once(builds):
    surface = snapshots.surface_of(torus(around=12, across=6))
    jobs = [Asking(surface, 0.1) for _ in range(2)]
    assert builds.second.wait(PATIENCE)
    builds.go.set()
    assert all(job.ended() for job in jobs)
    assert builds.begun == 1 and jobs[0].volume is jobs[1].volume is not None


def test_a_job_that_waits_for_anothers_volume_can_be_cancelled(builds):
    surface = snapshots.surface_of(torus(around=12, across=6))
    first = Asking(surface, 0.1)
    while not builds.begun:
        time.sleep(0.001)
    second = Asking(surface, 0.1)
    assert builds.second.wait(PATIENCE)
    second.progress.cancel()
    assert second.ended() and isinstance(second.error, native.module.Cancelled)
    builds.go.set()
    assert first.ended() and first.volume is not None and builds.begun == 1


def test_a_volume_that_failed_is_built_by_the_job_that_waited_for_it(builds):
    surface = snapshots.surface_of(torus(around=12, across=6))

    def fail_once():
        if builds.begun == 1:
            raise MemoryError

    builds.end = fail_once
    jobs = [Asking(surface, 0.1) for _ in range(2)]
    assert builds.second.wait(PATIENCE)
    builds.go.set()
    assert all(job.ended() for job in jobs)
    assert sorted(type(job.error) for job in jobs if job.error) == [MemoryError]
    assert builds.begun == 2 and sum(job.volume is not None for job in jobs) == 1
