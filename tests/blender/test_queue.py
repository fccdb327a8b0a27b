# SPDX-License-Identifier: GPL-3.0-or-later
"""The queue of work that nobody waits for."""

import time

from addon.background import queue


def ended(tasks):
    """Runs the tasks, each (prepare, finish), one after the other until none is left."""
    queue.stop()
    for number, (prepare, finish) in enumerate(tasks):
        queue.later(("task", number), 0, prepare, finish, rank=number)
    for _ in range(1000):
        if queue._tick() is None:
            return
        time.sleep(0.01)
    raise AssertionError("the queue goes on")


def fails(*_):
    raise RuntimeError("this task is wrong")


def test_a_task_that_fails_does_not_end_the_others(capsys):
    outcomes = []
    ended(
        [
            (fails, fails),
            (lambda: lambda _progress: "unwanted", fails),
            (lambda: fails, fails),
            (lambda: lambda _progress: "done", lambda *outcome: outcomes.append(outcome)),
        ]
    )
    assert outcomes == [("done", None)]
    assert capsys.readouterr().err.count("RuntimeError: this task is wrong") == 3
