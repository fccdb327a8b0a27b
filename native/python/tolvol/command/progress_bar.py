# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows how far a native call is, on a terminal."""

import contextlib
import os
import sys
import threading

from ..shared import package

_LOOK = 0.1  # seconds from one look at the progress to the next


def followed(title, work):
    """Returns work(progress), with a Progress of the package.

    While it runs, a bar on stderr shows the title and the stage, if stderr is a terminal.
    """
    progress = package.module.Progress()
    if not sys.stderr.isatty():
        return work(progress)
    outcome = []

    def run():
        try:
            outcome.append((work(progress), None))
        except BaseException as error:
            outcome.append((None, error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    with _bar(title) as show:
        while thread.is_alive():
            thread.join(_LOOK)
            show(progress)
    result, error = outcome[0]
    if error is not None:
        raise error
    return result


def counted(title, results, total):
    """Yields some results as they come. A bar on stderr shows how many of `total` came, if stderr is a terminal."""
    if not sys.stderr.isatty():
        yield from results
        return
    with _bars() as bars:
        task = bars.add_task(title, total=total)
        for number, result in enumerate(results, 1):
            bars.update(task, completed=number, description=f"{title}: {number} of {total}")
            yield result


def end():
    """Leaves the terminal as it was: a signal ends the process while a bar may be shown, which hides the cursor."""
    if sys.stderr.isatty():
        os.write(sys.stderr.fileno(), b"\r\x1b[K\x1b[?25h")


def _bars():
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn()
    return Progress(*columns, console=Console(stderr=True), transient=True)


@contextlib.contextmanager
def _bar(title):
    with _bars() as bars:
        task = bars.add_task(title, total=1.0)

        def show(progress):
            counts = progress.count and progress.stage in {"decimating", "refining"}
            count = f", {progress.count:,} triangles left" if counts else ""
            bars.update(task, completed=progress.fraction, description=f"{title}: {progress.stage}{count}")

        yield show
