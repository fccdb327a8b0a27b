# SPDX-License-Identifier: GPL-3.0-or-later
"""Does the work in all cells of a round: in this process, or as tasks of Dask."""

import contextlib
import logging
import re
import uuid

from ..shared import package
from ..shared.command.arguments import Stop
from .progress_bar import counted, followed

_GO_ON = "what is done is kept: go on with --resume"
_SHORT = "as it does where memory is short: give the workers more"
# A task whose worker dies, or that finds no memory, is done anew so many times. Another scheduler than that of local:N has a
# setting of its own for workers that die.
_MOST_TRIES = 10
# The level of the logs of the workers on this machine. A worker reads it when it starts. One that is ended in the middle of a
# heartbeat would log an error after all is done; the command says itself where a task fails.
_LOG_LEVEL = "distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED"


def here(title, work, jobs):
    """Yields work(job, progress) for all jobs, an iterable with a length, in this process and one after another."""
    for number, job in enumerate(jobs, 1):
        yield followed(f"{title}: {number} of {len(jobs)}", lambda progress, job=job: work(job, progress))


def local_count(scheduler):
    """Returns N of a scheduler "local:N", or None for the address of another one. Raises ValueError for neither."""
    if match := re.fullmatch(r"local:([1-9]\d*)", scheduler):
        return int(match[1])
    if not re.fullmatch(r"\w+://\S+", scheduler):
        raise ValueError
    return None


@contextlib.contextmanager
def dask(scheduler):
    """Yields a function like here() whose jobs are tasks of Dask. They find the scratch folder under the same path.

    scheduler: "local:N" starts N worker processes on this machine, and ends them; all else is the address of a scheduler.
    """
    import dask.config
    from distributed import Client, LocalCluster

    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # The command says itself what has failed.
    with contextlib.ExitStack() as stack:
        stack.enter_context(
            dask.config.set({"distributed.scheduler.allowed-failures": _MOST_TRIES, _LOG_LEVEL: "critical"})
        )
        if count := local_count(scheduler):
            # The native code has its own idea of the memory: a worker is not stopped for it.
            cluster = LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                memory_limit=None,
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
            scheduler = stack.enter_context(cluster)
        try:
            client = stack.enter_context(Client(scheduler))
        except OSError as error:
            raise Stop(f"--scheduler {scheduler}: no connection ({error})") from None
        print(f"dashboard of Dask: {client.dashboard_link}", flush=True)
        if not client.scheduler_info()["workers"]:
            print(f"--scheduler {scheduler}: there are no workers yet; waiting for one", flush=True)
            client.wait_for_workers(1)
        _require_same_version(client)
        yield lambda title, work, jobs: _tasks(client, title, work, jobs)


def _require_same_version(client):
    own = package.module.__version__
    for worker, version in client.run(_version, on_error="return").items():
        if version != own:
            raise Stop(f"--scheduler: the worker {worker} has {version!r} in place of tolvol {own}")


def _version():
    import tolvol

    return tolvol.__version__


def _tasks(client, title, work, jobs):
    from distributed import as_completed
    from distributed.client import FutureCancelledError
    from distributed.comm import CommClosedError
    from distributed.scheduler import KilledWorker

    # The dashboard shows what stands before the first "-" as the group of the task. The last part is of this call alone.
    own = uuid.uuid4().hex
    names = [f"{title}-cell {job.cell}-{own}" for job in jobs]
    futures = client.map(_attempt, [work] * len(jobs), jobs, key=names, retries=_MOST_TRIES, pure=False)
    try:
        for future in counted(title, as_completed(futures), len(jobs)):
            if error := future.result():
                raise error
            yield None
    except KilledWorker as error:
        ended = f"{error.allowed_failures + 1} workers" if error.allowed_failures else "its worker"
        raise Stop(f"{title}: the work in a cell has ended {ended}, {_SHORT}; {_GO_ON}") from None
    except MemoryError:
        raise Stop(
            f"{title}: the work in a cell has found no memory {_MOST_TRIES + 1} times, {_SHORT}; {_GO_ON}"
        ) from None
    except (CommClosedError, FutureCancelledError):
        raise Stop(f"{title}: the connection to the scheduler is lost; {_GO_ON}", 1) from None
    finally:
        client.cancel(futures)


def _attempt(work, job):
    """Returns the error that ended the work, or None. Dask does a task anew that raises one, as only a lack of memory does here:
    other work on the machine may take less of it later. All other errors would come again."""
    try:
        work(job)
        return None
    except MemoryError as error:
        text = str(error)
    except Exception as error:
        return error
    raise MemoryError(text)  # without the stack, which would keep the arrays of the work in memory
