# SPDX-License-Identifier: GPL-3.0-or-later
"""tolvol decimate with --scheduler: the tasks of Dask, workers that die, and a scheduler that goes away."""

import signal
import subprocess
import sys
import time

import psutil
import pytest
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


def started(torus, out, *extra):
    pipe = subprocess.PIPE
    return subprocess.Popen(words(*asked(torus, out, *extra)), stdout=pipe, stderr=pipe, text=True, env=ENVIRONMENT)


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
    code = "import sys, time; from distributed import LocalCluster\nif __name__ == '__main__':\n"
    code += " with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:\n"
    code += "  print(cluster.scheduler_address, flush=True); time.sleep(600)\n"
    (tmp_path / "cluster.py").write_text(code)
    cluster = subprocess.Popen(
        [sys.executable, str(tmp_path / "cluster.py")], stdout=subprocess.PIPE, text=True, env=ENVIRONMENT
    )
    address = cluster.stdout.readline().strip()
    process = started(torus, out, "--scheduler", address)
    try:
        wait_for(tmp_path / "out.ply.tolvol/round0_00001.json", process)
    finally:
        for child in psutil.Process(cluster.pid).children(recursive=True):
            child.kill()
        cluster.kill()
        cluster.communicate()
    text, error = process.communicate(timeout=120)
    assert process.returncode == 1 and "go on with --resume" in error.splitlines()[-1], (text, error)
    assert not out.exists()
    succeeded(command(*asked(torus, out, "--resume", "--scheduler", "local:1")))
    assert out.read_bytes() == whole


def test_wrong_schedulers_are_refused(torus, tmp_path):
    out = tmp_path / "out.ply"
    for wrong in ("local:0", "local", "host"):
        refused(command(*asked(torus, out, "--scheduler", wrong)), "is neither local:N nor an address")
    refused(command("decimate", torus, out, "--tolerance", "1%", "--scheduler", "local:2"), "needs --memory")
    environment = {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1s"}
    refused(command(*asked(torus, out, "--scheduler", "tcp://127.0.0.1:9"), **environment), "no connection")
