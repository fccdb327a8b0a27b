# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol decimate with --scheduler: the tasks of Dask, workers that die or find no memory, and a scheduler that goes away."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import psutil
import pytest
import tolvol
from dask.utils import key_split
from distributed import Client
from tolvol.tiles import plan

from commands import ENVIRONMENT, command, refused, scan, succeeded, words

SMALL = f"{plan.FIXED + 800 * plan.OF_FIRST_IF_SHORT}"  # bytes, for at most 800 triangles in a cell


@pytest.fixture(scope="module")
def torus(tmp_path_factory):
    return scan(tmp_path_factory.mktemp("scan") / "scan.ply", columns=64, rows=32)


@pytest.fixture(scope="module")
def whole(torus):
    """The bytes of a run without Dask."""
    out = torus.with_name("whole.ply")
    succeeded(command(*asked(torus, out)))
    return out.read_bytes()


def asked(torus, out, *extra):
    return ("decimate", torus, out, "--tolerance", "0.02", "--memory", SMALL, *extra)


def started(torus, out, *extra, **environment):
    pipe = subprocess.PIPE
    return subprocess.Popen(
        words(*asked(torus, out, *extra)), stdout=pipe, stderr=pipe, text=True, env={**ENVIRONMENT, **environment}
    )


# What each worker runs when it starts: its first cells do what a test asks for.
_WORKER = """
import os, signal, numpy as np
from tolvol.tiles import tile
decimate = tile.decimate

def instead(one, path, progress):
    if path.endswith("round0_00002") and len(os.listdir({signs!r})) < {times}:
        open(os.path.join({signs!r}, str(os.times().elapsed)), "w").close()
        {does}
    return decimate(one, path, progress)

tile.decimate = instead
"""
NO_MEMORY, KILLED = "np.empty(1 << 50)", "os.kill(os.getpid(), signal.SIGKILL)"


def failing(folder, does, times):
    """Returns the environment of workers which do that in place of the work in a cell, so many times, and the folder in which a
    file appears each time."""
    signs = folder / "signs"
    signs.mkdir()
    (folder / "sitecustomize.py").write_text(_WORKER.format(signs=str(signs), times=times, does=does))
    return {"PYTHONPATH": f"{folder}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"}, signs


@contextlib.contextmanager
def cluster(folder, workers, **environment):
    """Gives the address of a scheduler with so many workers, and its process."""
    code = "import sys, time; from distributed import LocalCluster\nif __name__ == '__main__':\n"
    code += f" with LocalCluster(n_workers={workers}, threads_per_worker=1, dashboard_address=None) as cluster:\n"
    code += "  print(cluster.scheduler_address, flush=True); time.sleep(600)\n"
    (folder / "cluster.py").write_text(code)
    process = subprocess.Popen(
        [sys.executable, str(folder / "cluster.py")],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={**ENVIRONMENT, **environment},
    )
    try:
        yield process.stdout.readline().strip(), process
    finally:
        end(process)


def end(process):
    with contextlib.suppress(psutil.NoSuchProcess):
        for child in psutil.Process(process.pid).children(recursive=True):
            child.kill()
    process.kill()
    process.wait()


def wait_for(path, process):
    while not path.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.001)


def test_a_killed_worker_changes_no_byte(torus, tmp_path, whole):
    out = tmp_path / "out.ply"
    process = started(torus, out, "--scheduler", "local:2")
    wait_for(tmp_path / "out.ply.tolvol/round0_00001.json", process)
    # The workers are children of their nannies, which run in the command itself.
    children = [child for child in psutil.Process(process.pid).children() if "spawn_main" in " ".join(child.cmdline())]
    assert len(children) == 2
    children[0].send_signal(signal.SIGKILL)
    text, error = process.communicate(timeout=120)
    assert process.returncode == 0, (text, error)
    assert "dashboard of Dask: http://" in text
    assert out.read_bytes() == whole and not (tmp_path / "out.ply.tolvol").exists()


def test_a_scheduler_that_goes_away_is_said_and_the_run_goes_on(torus, tmp_path, whole):
    out = tmp_path / "out.ply"
    with cluster(tmp_path, workers=1) as (address, scheduler):
        process = started(torus, out, "--scheduler", address)
        wait_for(tmp_path / "out.ply.tolvol/round0_00001.json", process)
        end(scheduler)
    text, error = process.communicate(timeout=120)
    assert process.returncode == 1 and "go on with --resume" in error.splitlines()[-1], (text, error)
    assert not out.exists()
    succeeded(command(*asked(torus, out, "--resume", "--scheduler", "local:1")))
    assert out.read_bytes() == whole


def test_a_cell_that_finds_no_memory_is_done_again(torus, tmp_path, whole):
    out = tmp_path / "out.ply"
    environment, signs = failing(tmp_path, NO_MEMORY, times=2)
    process = started(torus, out, "--scheduler", "local:2", **environment)
    text, error = process.communicate(timeout=120)
    assert process.returncode == 0, (text, error)
    assert len(list(signs.iterdir())) == 2 and out.read_bytes() == whole


@pytest.mark.parametrize("does, said", [(NO_MEMORY, "found no memory 11 times"), (KILLED, "ended its worker")])
def test_a_cell_that_never_has_enough_memory_is_said_and_the_run_goes_on(torus, tmp_path, whole, does, said):
    out = tmp_path / "out.ply"
    environment, signs = failing(tmp_path, does, times=11 if does == NO_MEMORY else 1)
    environment["DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES"] = "0"
    with cluster(tmp_path, workers=1, **environment) as (address, _):
        process = started(torus, out, "--scheduler", address)
        text, error = process.communicate(timeout=120)
        refused((process.returncode, text, error), "round 1: the work in a cell has", said, "go on with --resume")
        assert signs.is_dir() and not out.exists()
        succeeded(command(*asked(torus, out, "--resume", "--scheduler", address)))
    assert out.read_bytes() == whole


def test_the_dashboard_shows_rounds_and_cells(torus, tmp_path):
    with cluster(tmp_path, workers=1) as (address, _), Client(address) as client:
        client.get_task_stream()  # From here on the scheduler remembers what the dashboard draws.
        succeeded(command(*asked(torus, tmp_path / "out.ply", "--scheduler", address)))
        groups = {}
        for task in client.get_task_stream():
            groups.setdefault(key_split(task["key"]), []).append(task["key"].split("-")[1])
    rounds = [f"round {number}" for number in range(1, len(groups))]
    assert len(rounds) >= 3 and list(groups) == [*rounds, "measuring"]
    for cells in groups.values():
        assert sorted(cells) == sorted(f"cell {number + 1}" for number in range(len(cells)))
    assert len(groups["round 1"]) >= 6


@pytest.mark.parametrize("version", [tolvol.__version__, "9.9"])
def test_a_run_waits_for_its_first_worker_and_asks_for_its_version(torus, tmp_path, whole, version):
    out = tmp_path / "out.ply"
    (tmp_path / "sitecustomize.py").write_text(f"import tolvol\ntolvol.__version__ = {version!r}\n")
    path = f"{tmp_path}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"
    with cluster(tmp_path, workers=0) as (address, _):
        process = started(torus, out, "--scheduler", address)
        lines = []
        while not any("there are no workers yet" in line for line in lines):
            lines.append(process.stdout.readline())
            assert lines[-1], process.communicate()
        worker = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", address], env={**ENVIRONMENT, "PYTHONPATH": path}
        )
        try:
            text, error = process.communicate(timeout=120)
        finally:
            end(worker)
    if version == tolvol.__version__:
        assert process.returncode == 0 and out.read_bytes() == whole, (text, error)
    else:
        refused((process.returncode, text, error), "has '9.9' in place of tolvol", tolvol.__version__)


def test_wrong_schedulers_are_refused(torus, tmp_path):
    out = tmp_path / "out.ply"
    for wrong in ("local:0", "local", "host"):
        refused(command(*asked(torus, out, "--scheduler", wrong)), "is neither local:N nor an address")
    refused(command("decimate", torus, out, "--tolerance", "1%", "--scheduler", "local:2"), "needs --memory")
    environment = {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1s"}
    refused(command(*asked(torus, out, "--scheduler", "tcp://127.0.0.1:9"), **environment), "no connection")
