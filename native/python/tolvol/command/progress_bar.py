# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows how far a native call is, on a terminal."""

import contextlib
import sys
import threading

_LOOK = 0.1  # seconds from one look at the progress to the next


def followed(title, work, progress):
    """Returns work(progress). While it runs, a bar on stderr shows its stage, if that is a terminal.

    progress: a Progress of the package; title: what is worked on.
    """
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


@contextlib.contextmanager
def _bar(title):
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task(title, total=1.0)

        def show(progress):
            counts = progress.count and progress.stage in {"decimating", "refining"}
            count = f", {progress.count:,} triangles left" if counts else ""
            bars.update(task, completed=progress.fraction, description=f"{title}: {progress.stage}{count}")

        yield show
